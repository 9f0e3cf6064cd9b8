"""Plays a row of the array and has its frames judged."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from covered_limits import FASTEST, STRETCHED
from covered_scene import CoveredScene, make_scene
from covering_array import Row
from frame_judge import FrameJudge, FrameVerdict, principal_stretches

G = 9.81  # m/s^2


def play(row: Row, seconds: float, device: str = "cpu") -> dict[str, Any]:
    """The figures of a run; `broken` names what does not hold, each with its first frame."""
    begun = time.perf_counter()
    scene = make_scene(row, device)
    built = time.perf_counter()
    run = Judged(scene)
    for k in range(1, round(seconds * scene.rate) + 1):
        at = k / scene.rate
        scene.write(at)
        ticked = time.perf_counter()
        try:
            report = scene.sim.advance(scene.stance(at), at)
        except (ValueError, RuntimeError, AssertionError, FloatingPointError) as error:
            run.broken.append(f"frame {k}: {type(error).__name__}: {error}")
            break
        run.ms.append(1e3 * (time.perf_counter() - ticked))
        run.see(k, report)
        if not run.finite:
            break
    return {**run.figures(), "built": built - begun, "seconds": seconds}


class Judged:
    """What is found in the frames of a run."""

    def __init__(self, scene: CoveredScene) -> None:
        self.scene, self.finite = scene, True
        self.ms: list[float] = []
        self.broken: list[str] = []
        self.crossing: list[int] = []
        self.judged = self.free = self.void = self.asleep = 0
        self.fastest = self.stretch = 0.0
        self.last_speed = self.usual = 0.0
        self.stretched_at: list[str] = []
        sim = scene.sim
        self.start = self.x = sim.cloth_positions().astype(np.float64)
        self.body = scene.row["body contact"] == "on"
        self.cloth = scene.row["self contact"] == "on"
        surface, faces = sim.body_positions(), np.zeros((0, 3), np.int32)
        if sim.scene.body is not None:
            faces = sim.scene.body.faces
        self.judge = FrameJudge(sim.scene.garment.faces, faces, self.x, surface)
        self._ask(0)

    def see(self, frame: int, report: Any) -> None:
        """The frame as it has become."""
        before, sim = self.x, self.scene.sim
        self.x = sim.cloth_positions().astype(np.float64)
        if not np.isfinite(self.x).all():
            self.finite = False
            self.broken.append(f"frame {frame}: a position is not a finite number")
            return
        self.void += report.retries
        self.asleep += report.asleep
        self._look(frame, before)
        self._ask(frame)

    def _look(self, frame: int, before: np.ndarray) -> None:
        """Speeds and stretches."""
        garment = self.scene.sim.scene.garment
        speeds = np.linalg.norm(self.x - before, axis=1) * self.scene.rate
        falls = 2 * G * np.maximum(self.start[:, 1] - self.x[:, 1], 0) * (self.scene.row["gravity"] == "down")
        each = np.sqrt(np.maximum(speeds**2 - falls, 0))
        own = each.max()
        if own > FASTEST >= self.fastest:
            self.broken.append(f"frame {frame}: a vertex goes at {own:.1f} m/s")
        stretches = principal_stretches(self.x, garment.faces, garment.uv_corners)[:, 1]
        stretch = stretches.max()
        if stretch > STRETCHED >= self.stretch:
            self.broken.append(f"frame {frame}: a triangle is stretched to {stretch:.2f}")
        if own > self.fastest:
            self.usual = float(np.median(each))
        if stretch > self.stretch:
            self.stretched_at = self.scene.acting_on(garment.faces[stretches.argmax()])
        self.fastest, self.stretch = max(self.fastest, float(own)), max(self.stretch, float(stretch))
        self.last_speed = float(np.sqrt((speeds**2).mean()))

    def _ask(self, frame: int) -> None:
        """IPC Toolkit, of what the scene asks to be kept apart; where that is nothing, nothing is judged."""
        if not (self.body or self.cloth):
            self.free += 1
            return
        verdict = self.judge.judge(self.x, self.scene.sim.body_positions())
        self.judged += 1
        if crosses(verdict, self.cloth, self.body):
            self.crossing.append(frame)
            self.broken.append(f"frame {frame}: {verdict}")

    def figures(self) -> dict[str, Any]:
        """For the table."""
        return {
            "vertices": len(self.x),
            "frames": len(self.ms),
            "judged": self.judged,
            "free": self.free,
            "crossing": self.crossing,
            "fastest": self.fastest,
            "usual": self.usual,
            "stretch": self.stretch,
            "stretched_at": self.stretched_at,
            "speed_at_end": self.last_speed,
            "void": self.void,
            "asleep": self.asleep,
            "ms": float(np.median(self.ms)) if self.ms else 0.0,
            "broken": self.broken,
        }


def crosses(verdict: FrameVerdict, cloth: bool, body: bool) -> bool:
    """Does it say so of a surface that contact keeps?"""
    return (cloth and verdict.self_intersecting) or (body and (verdict.body_intersecting or verdict.inside > 0))
