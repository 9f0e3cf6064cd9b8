"""What IPC Toolkit says in float64, of a frame and of every sub-step that the solver has accepted on the way to it."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from itertools import pairwise

import ipctk
import numpy as np
import warp as wp
from frame_judge import FrameJudge, FrameVerdict

from tryon_solver.linalg import device_loop
from tryon_solver.simulation import Simulation
from tryon_solver.stepping import correct, move_body, record

PIECES = 16


class Oracle:
    """Prepared for one simulation, from its state."""

    def __init__(self, cloth_faces: np.ndarray, body_faces: np.ndarray, cloth: np.ndarray, surface: np.ndarray) -> None:
        self.frames = FrameJudge(cloth_faces, body_faces, cloth, surface)
        faces = np.vstack([cloth_faces, body_faces + len(cloth)]).astype(np.int32)
        faces = np.asfortranarray(faces)
        rest = np.asfortranarray(np.vstack([cloth, surface]).astype(np.float64))
        self.paths = ipctk.CollisionMesh(rest, ipctk.edges(faces), faces)
        self.paths.can_collide = ipctk.make_static_obstacle_filter(len(cloth))

    @staticmethod
    def of(sim: Simulation) -> Oracle:
        """For cloth and collision surface of a simulation."""
        body = np.zeros((0, 3), np.int32) if sim.scene.body is None else sim.scene.body.faces
        return Oracle(sim.scene.garment.faces, body, sim.cloth_positions(), sim.body_positions())

    def judge(self, cloth: np.ndarray, surface: np.ndarray) -> FrameVerdict:
        """Of one frame; ipctk says that what is not a number intersects nothing, so that is asked first."""
        return self.frames.judge(cloth, surface)

    def is_free(self, before: np.ndarray, after: np.ndarray) -> bool:
        """Is the straight way of all vertices (A, 3) m free of collisions? False where something is not finite.

        The toolkit answers no where it can't tell, by a tolerance that grows with the way: centimetres beside a fabric
        of micrometres. Its no is asked again of each of PIECES parts of the way; the whole is free if they all are.
        """
        if not (np.isfinite(before).all() and np.isfinite(after).all()):
            return False
        start, end = (np.asfortranarray(x.astype(np.float64)) for x in (before, after))
        if ipctk.is_step_collision_free(self.paths, start, end):
            return True
        ends = np.linspace(0.0, 1.0, PIECES + 1)
        places = [np.asfortranarray(start + share * (end - start)) for share in ends]
        return all(ipctk.is_step_collision_free(self.paths, a, b) for a, b in pairwise(places))


class SubSteps:
    """The moves that the solver has accepted since they were last taken: pairs of positions (A, 3) float32 m."""

    def __init__(self) -> None:
        self.moves: list[tuple[np.ndarray, np.ndarray]] = []

    def take(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """The moves, oldest first; they are forgotten."""
        moves, self.moves = self.moves, []
        return moves


@contextlib.contextmanager
def listening(by_launches: bool = False) -> Iterator[SubSteps]:
    """Hear of every move along a proven path: carried sub-steps, and the correction's.

    Of the latter not on a GPU: they are one graph there, in which nobody can listen. But `by_launches` a GPU keeps no
    graphs, and all of them are heard.
    """
    heard = SubSteps()
    keepers = (device_loop, record) if by_launches else ()
    kept = {module: module.keeps_graphs for module in keepers}
    for module in kept:
        module.keeps_graphs = never  # type: ignore[attr-defined]
    verbs = ((move_body, "carry_once"), (correct, "take_within_region"))
    originals = {(module, name): getattr(module, name) for module, name in verbs}

    def hear(original: Callable[..., object]) -> Callable[..., object]:
        def heard_move(sim: Simulation, *arguments: object, **named: object) -> object:
            recorded = wp.get_device(sim.device).is_cuda and not by_launches
            if original.__name__ != "carry_once" and recorded:
                return original(sim, *arguments, **named)
            before = sim.state.x.numpy().copy()
            answer = original(sim, *arguments, **named)
            heard.moves.append((before, sim.state.x.numpy().copy()))
            return answer

        return heard_move

    for (module, name), original in originals.items():
        setattr(module, name, hear(original))
    try:
        yield heard
    finally:
        for (module, name), original in originals.items():
            setattr(module, name, original)
        for module, keeps_graphs in kept.items():
            module.keeps_graphs = keeps_graphs  # type: ignore[attr-defined]


def never(_device: str) -> bool:
    """In place of `keeps_graphs`."""
    return False
