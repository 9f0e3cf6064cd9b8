"""How far the fabric is stretched: the larger principal stretch of every triangle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.read_back import read
from tryon_solver.materials.device import RestShape

wp.set_module_options({"enable_backward": False})


@wp.func
def larger_stretch(v: wp.vec3i, g: wp.vec2, h: wp.vec2, x: wp.array(dtype=wp.vec3)) -> float:
    """sqrt of the larger eigenvalue of F^T F, F = sum_i x_i grad_i^T from the sides that leave corner 0 of the triangle
    v; g and h are the other corners' grad_i."""
    side = x[v[1]] - x[v[0]]
    other = x[v[2]] - x[v[0]]
    along = side * g[0] + other * h[0]
    across = side * g[1] + other * h[1]
    half = 0.5 * (wp.dot(along, along) + wp.dot(across, across))
    difference = 0.5 * (wp.dot(along, along) - wp.dot(across, across))
    shear = wp.dot(along, across)
    return wp.sqrt(half + wp.sqrt(difference * difference + shear * shear))


@wp.kernel
def larger_kernel(
    faces: wp.array(dtype=wp.vec3i),
    gradients: wp.array2d(dtype=wp.vec2),
    x: wp.array(dtype=wp.vec3),
    stretch_out: wp.array(dtype=wp.float32),
):
    """Larger principal stretch of each triangle."""
    t = wp.tid()
    stretch_out[t] = larger_stretch(faces[t], gradients[t, 1], gradients[t, 2], x)


@dataclass(frozen=True)
class StretchMeter:
    """Of the triangles at `rest`; `stretch` (F,) float32 is where the last measurement is."""

    rest: RestShape
    stretch: wp.array

    @staticmethod
    def build(rest: RestShape) -> StretchMeter:
        """With nothing measured yet."""
        return StretchMeter(rest, wp.zeros(rest.face_count, dtype=wp.float32, device=rest.faces.device))

    def larger(self, x: wp.array) -> np.ndarray:
        """(F,) float32 larger principal stretch of each triangle at x (A,) m, the cloth's vertices first. Waits for the
        device."""
        self.measure(x)
        return read(self.stretch)[0]

    def measure(self, x: wp.array) -> None:
        """The same, put into `stretch` (F,) float32 on the device."""
        triangles = [self.rest.faces, self.rest.gradients]
        launch(larger_kernel, len(self.stretch), [*triangles, x], [self.stretch], device=x.device)
