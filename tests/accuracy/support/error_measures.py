"""How far a step ended from the reference's, in measures of position, strain, direction and energy."""

from __future__ import annotations

from typing import Any

import numpy as np
from against_reference import ReferenceStep
from contact_scenes import ContactScene
from frame_judge import FrameJudge, principal_stretches
from harness.crossed import Crossings

from tryon_solver.baselines.newton_ipc import Reference
from tryon_solver.baselines.newton_ipc.march import TOLERANCE
from tryon_solver.baselines.newton_ipc.newton import NotConvergedError, solve
from tryon_solver.geometry.garment import Garment

DIGITS = 5  # that are written down


class Measures:
    """Prepared for one case; `begin` for each of the reference's steps, `of` for each end that is held to it."""

    def __init__(self, scene: ContactScene, x: np.ndarray, dt: float) -> None:
        """x (A, 3) m: any places of cloth and surface."""
        self.scene, self.dt = scene, dt
        self.reference = Reference(scene.scene)
        self.garment = scene.scene.garment
        n = self.garment.vertex_count
        assert scene.scene.body is not None
        body = scene.scene.body.faces
        self.judge = FrameJudge(self.garment.faces, body, x[:n], x[n:])
        self.crossings = Crossings(self.garment.faces, body, n)

    def begin(self, step: ReferenceStep) -> None:
        """Hold what follows to this step."""
        problem = self.reference.problem(step.before, self.scene.pose_at(step.number), self.dt)
        self.lagged = self.reference.at(problem, step.after.x)
        self.least = self.lagged.energy(step.after.x)
        self.exact = step.after.x[: self.garment.vertex_count]
        self.stretches = self._stretches(self.exact)
        self.normals = unit_normals(self.garment, self.exact)

    def of(self, x: np.ndarray) -> dict[str, Any]:
        """Of an end x (A, 3) m: RMS and largest distance of the cloth's vertices `error`, `largest` [mm], difference of
        principal stretches `strain`, `strain_largest` [%], angle between triangles' normals `normal`, `normal_largest`
        [degrees], incremental potential above the reference's `energy` [mJ], with what is lagged as it is there; none
        where a pair is under its offset, which the potential does not allow; and how many triangles `crossed` another
        or the body. An end that is not a number has none of these but `crossed`, which is all of them."""
        n = self.garment.vertex_count
        cloth = x[:n]
        if not np.isfinite(x).all():
            names = ("error", "largest", "strain", "strain_largest", "normal", "normal_largest", "energy")
            return {**dict.fromkeys(names), "crossed": len(self.garment.faces)}
        distance = np.linalg.norm(cloth - self.exact, axis=1)
        strain = np.abs(self._stretches(cloth) - self.stretches)
        cosine = (unit_normals(self.garment, cloth) * self.normals).sum(1)
        angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
        figures = {
            "error": 1e3 * rms(distance),
            "largest": 1e3 * distance.max(),
            "strain": 100 * rms(strain),
            "strain_largest": 100 * strain.max(),
            "normal": rms(angle),
            "normal_largest": angle.max(),
            "energy": self._energy(x),
        }
        return {**{name: rounded(value) for name, value in figures.items()}, "crossed": self._crossed(cloth, x[n:])}

    def own_balance(self, x: np.ndarray) -> float | None:
        """How far [mm], RMS over the cloth's vertices, Newton goes from x (A, 3) m to balance: of the several that a
        step of slack cloth can have, to the one it was on the way to. None where it does not get there."""
        n = self.garment.vertex_count
        try:
            there = solve(self.lagged.problem, self.reference.search, x, TOLERANCE).x
        except (ValueError, NotConvergedError):  # a pair at or under its offset, or no end
            return None
        return rounded(1e3 * rms(np.linalg.norm(there[:n] - x[:n], axis=1)))

    def _energy(self, x: np.ndarray) -> float | None:
        try:
            return 1e3 * (self.lagged.energy(x) - self.least)
        except ValueError:  # a pair at or under its offset
            return None

    def _stretches(self, cloth: np.ndarray) -> np.ndarray:
        return principal_stretches(cloth, self.garment.faces, self.garment.uv_corners)

    def _crossed(self, cloth: np.ndarray, surface: np.ndarray) -> int:
        """The triangles are counted where IPC Toolkit says that anything crosses."""
        verdict = self.judge.judge(cloth, surface)
        if verdict.clean:
            return 0
        return max(int(self.crossings.among(cloth, surface).sum()), verdict.inside, 1)


def rms(values: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def rounded(value: float | None) -> float | None:
    """To so many digits as are written down."""
    return None if value is None else float(f"{value:.{DIGITS}g}")


def unit_normals(garment: Garment, cloth: np.ndarray) -> np.ndarray:
    """(F, 3) of the triangles at positions (N, 3) m."""
    a, b, c = (cloth[garment.faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    return normal / np.linalg.norm(normal, axis=1, keepdims=True)
