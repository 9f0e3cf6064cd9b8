"""Frames that can't follow each other on a body: a vertex that leaps, a unit that changes on the way."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tryon_solver.files.raw_mesh import MeshFileError

SPEED_MAX = 30.0  # m/s, of any point of a body from one frame to the next: a metre at 30 frames a second; ours
GROWTH_MAX = 3.0  # times that a frame may be as large as the first, or as small: below feet to metres, 3.28; ours
REACH_MAX = 1e4  # m from the origin; beyond, a float32 holds no millimetres


def refuse_jumps(frames: np.ndarray, used: np.ndarray, dt: float, place: Callable[[int], str]) -> None:
    """Look at the vertices `used` (U,) of `frames` (T, V, 3) m, `dt` s apart; `place` says where a frame is.

    Raises MeshFileError naming the frame and, counted from 0, the vertex.
    """
    size = 0.0
    before = frames[0][used].astype(np.float64)
    for k in range(len(frames)):
        here = frames[k][used].astype(np.float64)
        far = np.abs(here).max(axis=1)
        if far.max() > REACH_MAX:
            worst = int(far.argmax())
            raise MeshFileError(
                f"vertex {used[worst]} is {far[worst]:.3g} m from the origin, more than {REACH_MAX:g}",
                place(k),
                "Correct it, or move the body to where the origin is",
            )
        extent = float(np.ptp(here, axis=0).max())
        size = size or extent
        if not size / GROWTH_MAX <= extent <= size * GROWTH_MAX:
            raise MeshFileError(
                f"the body is {extent:.3g} m large, in the first frame {size:.3g} m: more than {GROWTH_MAX:g} times off"
                f"{_furthest(here, before, used)}",
                place(k),
                "Export every frame in one unit, and correct vertices that fly off",
            )
        speed = np.linalg.norm(here - before, axis=1) / dt
        if speed.max() > SPEED_MAX:
            worst = int(speed.argmax())
            raise MeshFileError(
                f"vertex {used[worst]} moves {speed[worst] * dt:.3g} m from the frame before, which is "
                f"{speed[worst]:.3g} m/s at {1 / dt:g} frames a second, more than {SPEED_MAX:g}; "
                f"{int((speed > SPEED_MAX).sum())} of {len(used)} vertices do so",
                place(k),
                "Correct the frame, cut the motion where it jumps, or say its frames a second with --body-fps",
            )
        before = here


def _furthest(here: np.ndarray, before: np.ndarray, used: np.ndarray) -> str:
    distance = np.linalg.norm(here - before, axis=1)
    worst = int(distance.argmax())
    return f"; vertex {used[worst]} moves {distance[worst]:.3g} m from the frame before"
