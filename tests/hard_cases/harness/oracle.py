"""What IPC Toolkit says in float64, of a frame and of every sub-step that the solver has accepted on the way to it."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise

import ipctk
import numpy as np
import warp as wp
from frame_judge import FrameJudge, FrameVerdict
from scipy.spatial.transform import Rotation

from tryon_solver import step
from tryon_solver.linalg import device_loop
from tryon_solver.simulation import PoseInterval, Simulation
from tryon_solver.stepping import correct, move_body, record, take

Move = tuple[np.ndarray, np.ndarray]
"""Positions (A, 3) float32 m before and after."""

PIECES = 16, 128  # of a way that the toolkit can't tell of whole
TOGETHER = 0.01  # m: wider boxes find more that may meet than looking again costs
AT_A_GLANCE, ALL_THE_SAME = ipctk.AdditiveCCD(), 8
AS_ONE = 5e-6  # m by which rounding may leave a vertex from where a common motion takes it


class Oracle:
    """Prepared for one simulation, from its state."""

    def __init__(self, cloth_faces: np.ndarray, body_faces: np.ndarray, cloth: np.ndarray, surface: np.ndarray) -> None:
        self.frames = FrameJudge(cloth_faces, body_faces, cloth, surface)
        faces = np.vstack([cloth_faces, body_faces + len(cloth)]).astype(np.int32)
        faces = np.asfortranarray(faces)
        rest = np.asfortranarray(np.vstack([cloth, surface]).astype(np.float64))
        self.paths = ipctk.CollisionMesh(rest, ipctk.edges(faces), faces)
        self.paths.can_collide = ipctk.make_static_obstacle_filter(len(cloth))
        self.asked = 0  # ways

    @staticmethod
    def of(sim: Simulation) -> Oracle:
        """For cloth and collision surface of a simulation."""
        body = np.zeros((0, 3), np.int32) if sim.scene.body is None else sim.scene.body.faces
        return Oracle(sim.scene.garment.faces, body, sim.cloth_positions(), sim.body_positions())

    def judge(self, cloth: np.ndarray, surface: np.ndarray) -> FrameVerdict:
        """Of one frame; ipctk says that what is not a number intersects nothing, so that is asked first."""
        return self.frames.judge(cloth, surface)

    def distances(self, cloth: np.ndarray, surface: np.ndarray, reach: float) -> tuple[float, float]:
        """Smallest distance [m] of cloth from body and of cloth from cloth; `reach` where it is no smaller."""
        both = np.vstack([cloth, surface]).astype(np.float64)
        found = []
        for mesh, x in ((self.frames.together, both), (self.frames.alone, both[: len(cloth)])):
            near = ipctk.NormalCollisions()
            near.build(mesh, np.asfortranarray(x), reach)
            apart = near.compute_minimum_distance(mesh, np.asfortranarray(x)) if len(near) else np.inf
            found.append(float(min(np.sqrt(apart), reach)))
        return found[0], found[1]

    def colliding(self, ways: Sequence[Move]) -> list[int]:
        """Numbers of the straight ways of all vertices (A, 3) m that are not free of collisions, or not finite.

        What may meet on one of them is looked for once for several, within the box that each vertex stays in on all.
        """
        finite = [np.isfinite(before).all() and np.isfinite(after).all() for before, after in ways]
        found = [number for number, said in enumerate(finite) if not said]
        for group in near_each_other(ways, [number for number, said in enumerate(finite) if said]):
            places = np.array([place for number in group for place in ways[number]], np.float64)
            may_meet = ipctk.Candidates()
            lowest, highest = (np.asfortranarray(ends) for ends in (places.min(0), places.max(0)))
            may_meet.build(self.paths, lowest, highest, broad_phase=ipctk.LBVH())
            found += [number for number in group if not self.is_free(may_meet, *ways[number])]
        return sorted(found)

    def is_free(self, may_meet: ipctk.Candidates, before: np.ndarray, after: np.ndarray) -> bool:
        """Is the straight way of all vertices (A, 3) m free of collisions among those that may meet on it?

        The toolkit's additive detection says yes at a glance, as a rule; its no is asked again of the inclusion-based
        one, and so is each ALL_THE_SAME-th way, for the additive one is not proven against rounding. The other answers
        no where it can't tell, by a tolerance that grows with the way: centimetres beside a fabric of micrometres. Its
        no is asked again of each of so many parts as PIECES says, few and then many; the whole is free if they all are.
        """
        start, end = (np.asfortranarray(x.astype(np.float64)) for x in (before, after))
        self.asked += 1
        glance = self.asked % ALL_THE_SAME > 0
        if glance and may_meet.is_step_collision_free(self.paths, start, end, narrow_phase_ccd=AT_A_GLANCE):
            return True
        if may_meet.is_step_collision_free(self.paths, start, end):
            return True
        return any(self.is_free_in_parts(start, end, pieces) for pieces in PIECES)

    def is_free_in_parts(self, start: np.ndarray, end: np.ndarray, pieces: int) -> bool:
        """Is each of so many equal parts of the way free by the inclusion-based detection? Of what may meet on all of
        it most is far off on each part, and may be what it can't tell of."""
        ends = np.linspace(0.0, 1.0, pieces + 1)
        return all(self.is_part_free(*part) for part in pairwise(start + share * (end - start) for share in ends))

    def is_part_free(self, before: np.ndarray, after: np.ndarray) -> bool:
        a, b = np.asfortranarray(before), np.asfortranarray(after)
        may_meet = ipctk.Candidates()
        may_meet.build(self.paths, a, b, broad_phase=ipctk.LBVH())
        return bool(may_meet.is_step_collision_free(self.paths, a, b))


def near_each_other(ways: Sequence[Move], numbers: Sequence[int]) -> list[list[int]]:
    """Numbers of ways in groups of consecutive ones on all of which no coordinate spans more than TOGETHER."""
    groups: list[list[int]] = []
    lowest = highest = np.zeros((0, 3))
    for number in numbers:
        low, high = np.minimum(*ways[number]), np.maximum(*ways[number])
        if groups and (np.maximum(high, highest) - np.minimum(low, lowest)).max() <= TOGETHER:
            groups[-1].append(number)
            lowest, highest = np.minimum(low, lowest), np.maximum(high, highest)
        else:
            groups.append([number])
            lowest, highest = low, high
    return groups


class SubSteps:
    """The moves that the solver has accepted since they were last taken.

    Where a move of everything as one led to is in `turned`, and how many others were before it. `setting_out` until the
    first carried sub-step of a step begins, which is where the body's root has led.
    """

    def __init__(self, by_launches: bool) -> None:
        self.by_launches = by_launches
        self.moves: list[Move] = []
        self.turned: list[tuple[int, np.ndarray]] = []
        self.setting_out = False

    def take(self) -> list[Move]:
        """The moves, oldest first; they are forgotten."""
        moves, self.moves, self.turned = self.moves, [], []
        return moves

    def lead(self, start: np.ndarray, end: np.ndarray) -> bool:
        """Do the moves lead from `start` to `end` (A, 3) without a leap? To be asked where all of them are heard.

        A move begins where another began or ended, for a step may fall back on what it had: at `start`, or there after
        a move of everything as one.
        """
        known = {start.tobytes()}
        for number, place in self.turned:
            if not is_moved_as_one([start, *(after for _, after in self.moves[:number])], place):
                return False
            known.add(place.tobytes())
        for before, after in self.moves:
            if before.tobytes() not in known:
                return False
            known.add(after.tobytes())
        return end.tobytes() in known


def on_the_way(moves: Sequence[Move], end: np.ndarray) -> list[int]:
    """Numbers of the moves by which `end` (A, 3) was reached; those that a step gave up again are not among them."""
    goal, found = end.tobytes(), []
    for number in reversed(range(len(moves))):
        before, after = moves[number]
        if after.tobytes() == goal:
            found.append(number)
            goal = before.tobytes()
    return found[::-1]


def is_moved_as_one(places: Sequence[np.ndarray], place: np.ndarray) -> bool:
    """Is (A, 3) m one of `places` turned and shifted, but for rounding?"""
    rounding = AS_ONE + 4 * np.finfo(np.float32).eps * float(np.abs(place).max())
    return any(farthest_off(other.astype(np.float64), place.astype(np.float64)) < rounding for other in places)


def farthest_off(x: np.ndarray, goal: np.ndarray) -> float:
    """How far from `goal` (A, 3) m the rigid motion that takes x nearest to it leaves a vertex [m] (Kabsch 1976)."""
    a, b = x - x.mean(0), goal - goal.mean(0)
    turn = Rotation.align_vectors(b, a)[0]
    return float(np.abs(turn.apply(a) - b).max())


def turned_with_root(sim: Simulation) -> np.ndarray:
    """(A, 3) m: where cloth and surface were once the body's root had taken them all along."""
    x = sim.state.x_committed.numpy()
    assert sim.body is not None
    along = sim.body.carry.root.numpy()[0]
    return np.asarray(x + x @ along[:, :3].T + along[:, 3], np.float32)


@contextlib.contextmanager
def listening(by_launches: bool = False) -> Iterator[SubSteps]:
    """Hear of every move along a proven path: carried sub-steps, and the correction's; and where all went as one.

    Of the latter not on a GPU: they are one graph there, in which nobody can listen. But `by_launches` a GPU keeps no
    graphs, and all of them are heard.
    """
    heard = SubSteps(by_launches)
    keepers = (device_loop, record) if by_launches else ()
    kept = {module: module.keeps_graphs for module in keepers}
    for module in kept:
        module.keeps_graphs = never  # type: ignore[attr-defined]
    proven = (correct, take)  # what a correction that led astray goes of a direction is taken by the latter
    verbs = (
        (move_body, "carry_once"),
        *((module, "take_within_region") for module in proven),
        (correct, "retreat_if_overshot"),
    )
    originals = {(module, name): getattr(module, name) for module, name in verbs}

    def hear(original: Callable[..., object]) -> Callable[..., object]:
        def heard_move(sim: Simulation, *arguments: object, **named: object) -> object:
            recorded = wp.get_device(sim.device).is_cuda and not by_launches
            if original.__name__ != "carry_once" and recorded:
                return original(sim, *arguments, **named)
            before = sim.state.x.numpy().copy()
            if heard.setting_out and original.__name__ == "carry_once":  # the root has turned all
                heard.turned.append((len(heard.moves), before))
                heard.setting_out = False
            answer = original(sim, *arguments, **named)
            after = sim.state.x.numpy().copy()
            if original.__name__ != "retreat_if_overshot" or not np.array_equal(before, after):
                heard.moves.append((before, after))
            return answer

        return heard_move

    set_out, coast, keep_momentum = step.move_body, step.coast, correct.keep_momentum

    def hear_setting_out(sim: Simulation, interval: PoseInterval, solve_freely: Callable[[Simulation], None]) -> None:
        heard.setting_out = True
        set_out(sim, interval, solve_freely)
        if sim.under_way:  # a GPU has taken all of the motion by itself
            heard.setting_out = False
            turned = turned_with_root(sim)
            heard.turned.append((len(heard.moves), turned))
            heard.moves.append((turned, sim.state.x_feasible.numpy().copy()))

    def hear_coasting(sim: Simulation) -> None:
        if wp.get_device(sim.device).is_cuda and not by_launches:
            coast(sim)
            return
        before = sim.state.x_feasible.numpy().copy()
        coast(sim)
        after = sim.state.x_feasible.numpy().copy()
        if not np.array_equal(before, after):
            heard.turned.append((len(heard.moves), after))

    def hear_keeping(sim: Simulation) -> None:
        hear(keep_momentum)(sim)
        if heard.moves and np.array_equal(*heard.moves[-1]):
            heard.moves.pop()  # nothing was to be kept

    hear_setting_out.__name__, hear_coasting.__name__ = set_out.__name__, coast.__name__
    for (module, name), original in originals.items():
        setattr(module, name, hear(original))
    step.move_body, step.coast, correct.keep_momentum = hear_setting_out, hear_coasting, hear_keeping
    try:
        yield heard
    finally:
        for (module, name), original in originals.items():
            setattr(module, name, original)
        step.move_body, step.coast, correct.keep_momentum = set_out, coast, keep_momentum
        for module, keeps_graphs in kept.items():
            module.keeps_graphs = keeps_graphs  # type: ignore[attr-defined]


def never(_device: str) -> bool:
    """In place of `keeps_graphs`."""
    return False
