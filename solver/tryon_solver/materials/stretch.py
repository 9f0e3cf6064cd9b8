"""How far the fabric is stretched: the larger principal stretch of every triangle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from tryon_solver.geometry.garment import Garment
from tryon_solver.linalg.read_back import read

wp.set_module_options({"enable_backward": False})


@wp.kernel
def larger_kernel(
    faces: wp.array(dtype=wp.vec3i),
    gradients: wp.array(dtype=wp.mat22),
    x: wp.array(dtype=wp.vec3),
    stretch_out: wp.array(dtype=wp.float32),
):
    """sqrt of the larger eigenvalue of F^T F, F = sum_i x_i grad_i^T from the sides that leave corner 0."""
    t = wp.tid()
    v = faces[t]
    g = gradients[t]
    side = x[v[1]] - x[v[0]]
    other = x[v[2]] - x[v[0]]
    along = side * g[0, 0] + other * g[1, 0]
    across = side * g[0, 1] + other * g[1, 1]
    half = 0.5 * (wp.dot(along, along) + wp.dot(across, across))
    difference = 0.5 * (wp.dot(along, along) - wp.dot(across, across))
    shear = wp.dot(along, across)
    stretch_out[t] = wp.sqrt(half + wp.sqrt(difference * difference + shear * shear))


@dataclass(frozen=True)
class StretchMeter:
    """`faces` (F,) vec3i; `gradients` (F,) mat22 1/m: of the linear functions of corners 1 and 2, a row each."""

    faces: wp.array
    gradients: wp.array
    stretch: wp.array

    @staticmethod
    def build(garment: Garment, device: str) -> StretchMeter:
        """Rest quantities of the garment."""
        gradients = garment.corner_gradients()[:, 1:].astype(np.float32)
        return StretchMeter(
            wp.array(garment.faces.astype(np.int32), dtype=wp.vec3i, device=device),
            wp.array(gradients, dtype=wp.mat22, device=device),
            wp.zeros(len(garment.faces), dtype=wp.float32, device=device),
        )

    def larger(self, x: wp.array) -> np.ndarray:
        """(F,) float32 larger principal stretch of each triangle at x (A,) m, the cloth's vertices first. Waits for the
        device."""
        self.measure(x)
        return read(self.stretch)[0]

    def measure(self, x: wp.array) -> None:
        """The same, put into `stretch` (F,) float32 on the device."""
        wp.launch(
            larger_kernel, len(self.stretch), [self.faces, self.gradients, x], [self.stretch], device=x.device
        )
