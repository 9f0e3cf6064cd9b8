"""How far the fabric is stretched: principal stretches of every triangle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from tryon_solver.geometry.garment import Garment


@dataclass(frozen=True)
class StretchMeter:
    """Measures on the host, from positions copied there."""

    faces: np.ndarray
    gradients: np.ndarray
    count: int

    @staticmethod
    def build(garment: Garment) -> StretchMeter:
        """Rest quantities of the garment."""
        return StretchMeter(garment.faces, garment.corner_gradients(), garment.vertex_count)

    def principal(self, x: np.ndarray) -> np.ndarray:
        """(F, 2) smaller and larger principal stretch of each triangle at positions x (N, 3) m."""
        f = np.einsum("tia,tid->tad", x[self.faces].astype(np.float64), self.gradients)
        c = np.einsum("tad,tae->tde", f, f)
        half = 0.5 * (c[:, 0, 0] + c[:, 1, 1])
        radius = np.sqrt(0.25 * (c[:, 0, 0] - c[:, 1, 1]) ** 2 + c[:, 0, 1] ** 2)
        return np.sqrt(np.maximum(np.column_stack([half - radius, half + radius]), 0))

    def larger(self, x: wp.array) -> np.ndarray:
        """(F,) larger principal stretch of each triangle."""
        return self.principal(x.numpy()[: self.count])[:, 1]
