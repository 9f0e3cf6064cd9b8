"""A garment of which all edits were taken back, held to one that was never edited.

The same pattern is the same mesh, and all that is made of it the same bits; where it hangs is decided by friction too,
so that of the cloth only the hem's height is compared. A garment that is put on from where it hung when it was dressed
goes on to the same bits each time.

Where the hem hangs elsewhere, the never edited one is put where the edited one hangs. If it hangs there, too, nothing
is left of the edits but where they brought the cloth: there is more than one way to hang.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from edited_session import EditedSession, Script, Shown

from tryon_protocol import DecodedFrame
from tryon_server.runtime.motions import load_motion
from tryon_server.runtime.order import DrapeOrder
from tryon_server.runtime.production import build_drape
from tryon_server.runtime.solver_drape import PackedDrape, SolverDrape
from tryon_server.runtime.sources import LONGEST_MOVE, MotionSource, PoseSource, StillSource
from tryon_solver.body.motion import Motion
from tryon_solver.body.pose import Pose
from tryon_solver.geometry.boundary_loops import boundary_loops
from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.pattern import parse_pattern
from tryon_solver.geometry.size import mesh_in_size
from tryon_solver.geometry.weld import weld
from tryon_solver.redesign.history import History
from tryon_solver.simulation import FACTOR_DIGITS, Simulation, build
from tryon_solver.subspace.basis import reduced_matrix

HEM_LIMIT = 5e-3  # m between the mean heights of the hems
COMPARED = 0.5  # of the frames that both go on for by the same poses: so much at their end the hem is averaged over
ALIKE = 15  # frames that a garment put on twice has to have the same bits
FACTOR = "factor"  # of the steps that were taken last
ELSEWHERE = "it is worn in another shape than its mesh was made in"
UNDER_WAY = "its shape was still on its way"
NOT_THERE = "its factor was still being made"
SETTLING = 300  # frames in which a reduced matrix's inverse has to be there


class Undone:
    """Prepared for an order and the motion in which it is worn."""

    def __init__(self, order: DrapeOrder, motion: str, continued: int) -> None:
        """`continued`: frames that it and one that was never edited go on for."""
        self.order, self.motion, self.continued = order, motion, continued
        self.vertices = 0
        self.broken: list[str] = []
        self.hem: tuple[float, float] | None = None  # m over the root: of the edited one and of the other
        self.hem_there: float | None = None  # of the other put where the edited one hangs, if their hems differ
        self.same: list[str] = []  # what was found to have the same bits

    def hang_up(self) -> None:
        """Dress it once, so that all others start from where it hung then. Raises ProblemError."""
        self.vertices = build_drape(self.order, silent).simulation.cloth_count

    def plain(self) -> dict[str, Any]:
        """Ready for JSON."""
        return {"same": self.same, "hem": self.hem, "hem_there": self.hem_there, "broken": self.broken}

    def compare(self, session: EditedSession, history: History, see: Callable[[Shown], None], worn: int) -> Script:
        """Go on with the session, worn for so many frames since it was dressed, and with one that was never edited and
        worn in the motion for as long, and compare them."""
        frames: list[DecodedFrame] = []
        hung: list[PackedDrape] = []  # after each frame, the last ones
        while len(frames) < self.continued or (not settled(session.drape) and len(frames) < SETTLING):
            shown = yield from session.frame()
            see(shown)
            frames.append(shown.frame)
            hung = [*hung[-self.averaged :], session.drape.packed()]
        edited = session.drape.simulation
        one, other = (build_drape(self.order, silent) for _ in range(2))
        source = self._alike(one, other)
        if history.specification != history.beginning:
            self.broken.append("all edits taken back, the pattern is not what it was")
        self._same("all edits taken back", edited, one.simulation)
        poses = [Pose(frame.root, frame.rotations.astype(np.float64)) for frame in frames]
        played(one, source, max(worn - ALIKE, 0), one._time)
        self._hem(frames, edited, one, poses, hung[0])

    def _alike(self, one: SolverDrape, other: SolverDrape) -> MotionSource:
        """Put on twice from where it hung: the same bits, and still after some frames; what goes on moving the one."""
        sources = [MotionSource(load_motion(self.motion, drape.outfit.body), drape.pose) for drape in (one, other)]
        for drape, source in zip((one, other), sources):
            played(drape, source, ALIKE)
        self._same("put on again", one.simulation, other.simulation)
        if not np.array_equal(one.cloth_positions(), other.cloth_positions()):
            self.broken.append("put on again from where it hung, it does not move to the same bits")
        else:
            self.same.append(f"put on again: the cloth after {ALIKE} frames")
        return sources[0]

    def _same(self, when: str, one: Simulation, other: Simulation) -> None:
        first, second = made_of_shape(one), made_of_shape(other)
        for name in first:
            if np.array_equal(first[name], second[name]):
                self.same.append(f"{when}: {name}")
            else:
                self.broken.append(f"{when}, other bits than at first: {name}")

    @property
    def averaged(self) -> int:
        """Frames at the end over which the hem is averaged."""
        return round(COMPARED * self.continued)

    def _hem(
        self,
        frames: Sequence[DecodedFrame],
        edited: Simulation,
        never: SolverDrape,
        poses: Sequence[Pose],
        hung: PackedDrape,
    ) -> None:
        """Lead the one that was never edited through the poses of the other, and compare; `hung` is that as it was
        before the frames that are averaged over."""
        there = never.packed()
        roots, turns = np.array([p.root for p in poses]), np.array([p.rotations for p in poses])
        source = MotionSource(Motion(roots, turns, LONGEST_MOVE, "the edited one's"), never._stance)
        heights = played(never, source, round(source._lead_seconds / LONGEST_MOVE), never._time)
        for pose in poses[1:]:  # as they were: played by the source, the way's end would be led back to its beginning
            heights += played(never, StillSource(pose), 1, never._time)
        its = [hem_height(f.cloth, edited.scene.garment.faces, f.root) for f in frames]
        last = self.averaged
        self.hem = float(np.mean(its[-last:])), float(np.mean(heights[-last:]))
        if abs(self.hem[0] - self.hem[1]) <= HEM_LIMIT:
            return
        scene = replace(there.scene, x_start=hung.scene.x_start)
        *_, put = replace(there, scene=scene, pose=hung.pose, surface=hung.surface, origin=hung.origin).unpacking()
        assert put is not None
        heights = [height for pose in poses[-last:] for height in played(put, StillSource(pose), 1, put._time)]
        self.hem_there = float(np.mean(heights))
        if abs(self.hem[0] - self.hem_there) > HEM_LIMIT:
            off, there_off = (1e3 * (self.hem[0] - other) for other in (self.hem[1], self.hem_there))
            self.broken.append(
                f"all edits taken back, its hem hangs {off:+.1f} mm from where that of another does, and "
                f"{there_off:+.1f} mm from where that does if it is put where it hangs"
            )


def other_than_from_scratch(drape: SolverDrape, order: DrapeOrder) -> tuple[list[str], str]:
    """What of a garment worn in a mesh that was made for it has other bits than if it were built of its pattern, from
    nothing, for steps as the last one was; and why something was left out, or all, or ""."""
    sim = drape.simulation
    if drape.own.shown != drape.specification:
        return [], ELSEWHERE
    if drape.on_the_way:
        return [], UNDER_WAY
    assert drape.specification is not None
    assert order.edge_length is not None
    assert sim.body is not None
    joined = weld(mesh_in_size(parse_pattern(drape.specification), order.edge_length, order.size or 1.0))
    garment = Garment(joined.vertex_of_corner, joined.uv_corners, joined.panel_of_face, joined.vertex_count)
    surface = sim.body_positions().astype(np.float64)
    scene = replace(sim.scene, garment=garment)
    scratch = build(scene, sim.settings, sim.device, sim.body.pose, surface, tangled=True)
    scratch.use_time_step(round(sim.dt, FACTOR_DIGITS), round(sim.whole, FACTOR_DIGITS))
    one, other = made_of_shape(sim), made_of_shape(scratch)
    its_own = sim.factor_key in sim.inverses
    alike = {name: np.array_equal(one[name], other[name]) for name in one}
    alike[FACTOR] = not its_own or same_but_rounded(one[FACTOR], other[FACTOR])
    return [name for name in alike if not alike[name]], "" if its_own else NOT_THERE


def same_but_rounded(one: np.ndarray, other: np.ndarray) -> bool:
    """Are two inverses the same but for how their entries are rounded to float32? Made in float64, their last bits
    depend on where in memory that is done."""
    return one.shape == other.shape and bool(np.abs(one - other).max() <= np.spacing(np.abs(other).max()))


def silent(_stage: str, _share: float | None) -> None:
    """Nobody is told."""


def settled(drape: SolverDrape) -> bool:
    """Has it the shape that is wanted, and the inverse that belongs to that?"""
    return drape.own.edit is None or drape.own.edit.settled


def played(drape: SolverDrape, source: PoseSource, frames: int, t: float = 0.0) -> list[float]:
    """Move it for so many frames from `t` s on; the heights of its hem [m] over the root."""
    heights = []
    for _ in range(frames):
        move = source.next(LONGEST_MOVE)
        t += move.dt
        drape.leap(move.leap)
        drape.advance(move.pose, t)
        heights.append(hem_height(drape.cloth_positions() + drape.origin, drape.outfit.faces, move.pose.root))
    return heights


def hem_height(cloth: np.ndarray, faces: np.ndarray, root: np.ndarray) -> float:
    """Of the lowest of its openings, the mean height [m] over the root."""
    return float(min(cloth[loop, 1].mean() for loop in boundary_loops(faces)) - root[1])


def made_of_shape(sim: Simulation) -> dict[str, np.ndarray]:
    """The rest shape and what is made of it: matrices in a step of 1/30 s, and the inverse that is in use."""
    garment, stiffness = sim.scene.garment, sim.stiffness_matrix
    system = stiffness + sp.diags(sim.mass / LONGEST_MOVE**2)
    return {
        "triangles": garment.faces,
        "rest shape": garment.uv_corners,
        "masses": sim.mass,
        "stiffness, its columns": stiffness.indices,
        "stiffness": stiffness.data,
        "basis": sp.csr_matrix(sim.basis).data,
        "reduced matrix": np.asarray(reduced_matrix(sim.basis, system)),
        FACTOR: sim.search.inverse.numpy(),
    }
