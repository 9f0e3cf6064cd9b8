"""The rest shape on the device, shared by every model that works on triangles, and what follows from it alone.

Everything is computed from the corners' places in the pattern by the same kernels, when a simulation is built and when
the garment that it wears gets another shape: the same shape has the same bits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from tryon_solver.geometry.garment import Garment
from tryon_solver.linalg.launch import launch

wp.set_module_options({"enable_backward": False})


@dataclass(frozen=True)
class RestShape:
    """`faces` (F,) vec3i; `flat` (3 F,) vec2d m, the corners' places in the pattern; of these follow `gradients` (F, 3)
    vec2 1/m, corner gradients, and `area` (F,) float32 m^2, and at the vertices `mass` (N,) float64 kg and `lumped`
    (N,) float64 m^2, a third of what is around, `spread`, the same as float32, and `reach` (N,) float32 m, at which
    cloth begins to feel cloth: half the smallest altitude around.

    `density` (F,) float64 kg/m^2; `corners` (3 F,) int32 those at each vertex i, from `starts[i]` to `starts[i + 1]`.
    """

    faces: wp.array
    flat: wp.array
    gradients: wp.array
    area: wp.array
    mass: wp.array
    lumped: wp.array
    spread: wp.array
    reach: wp.array
    density: wp.array
    corners: wp.array
    starts: wp.array
    face_count: int

    @staticmethod
    def build(garment: Garment, density: np.ndarray, device: str) -> RestShape:
        """Room for the shape of the garment, whose triangles weigh `density` (F,) kg/m^2; `take` comes next."""
        faces, vertices = len(garment.faces), garment.vertex_count
        corners, starts = garment.connectivity.corners
        return RestShape(
            wp.array(garment.faces.astype(np.int32), dtype=wp.vec3i, device=device),
            wp.zeros(3 * faces, dtype=wp.vec2d, device=device),
            wp.zeros((faces, 3), dtype=wp.vec2, device=device),
            wp.zeros(faces, dtype=wp.float32, device=device),
            wp.zeros(vertices, dtype=wp.float64, device=device),
            wp.zeros(vertices, dtype=wp.float64, device=device),
            wp.zeros(vertices, dtype=wp.float32, device=device),
            wp.zeros(vertices, dtype=wp.float32, device=device),
            wp.array(density, dtype=wp.float64, device=device),
            wp.array(corners, dtype=wp.int32, device=device),
            wp.array(starts, dtype=wp.int32, device=device),
            faces,
        )

    def take(self, uv_corners: np.ndarray) -> None:
        """Let the corners lie at `uv_corners` (F, 3, 2) float64 m."""
        device = self.faces.device
        self.flat.assign(np.ascontiguousarray(uv_corners).reshape(-1, 2))
        launch(measure_kernel, self.face_count, [self.flat], [self.gradients, self.area], device=device)
        at_vertices = [self.mass, self.lumped, self.spread, self.reach]
        launch(
            gather_kernel,
            len(self.mass),
            [self.corners, self.starts, self.flat, self.density],
            at_vertices,
            device=device,
        )


@wp.func
def sides(flat: wp.array(dtype=wp.vec2d), t: int):
    """From corner 0 of triangle t to the others, m."""
    return flat[3 * t + 1] - flat[3 * t], flat[3 * t + 2] - flat[3 * t]


@wp.func
def signed_area(a: wp.vec2d, b: wp.vec2d):
    """m^2, of the triangle with these sides."""
    return wp.float64(0.5) * (a[0] * b[1] - a[1] * b[0])


@wp.func
def corner_gradients(a: wp.vec2d, b: wp.vec2d):
    """1/m, of each corner's barycentric coordinate, by the sides from corner 0."""
    twice = wp.float64(2.0) * signed_area(a, b)
    second = wp.vec2d(b[1] / twice, -b[0] / twice)
    third = wp.vec2d(-a[1] / twice, a[0] / twice)
    return -second - third, second, third


@wp.kernel
def measure_kernel(
    flat: wp.array(dtype=wp.vec2d), gradients_out: wp.array2d(dtype=wp.vec2), area_out: wp.array(dtype=wp.float32)
):
    t = wp.tid()
    a, b = sides(flat, t)
    g0, g1, g2 = corner_gradients(a, b)
    gradients_out[t, 0] = wp.vec2(wp.float32(g0[0]), wp.float32(g0[1]))
    gradients_out[t, 1] = wp.vec2(wp.float32(g1[0]), wp.float32(g1[1]))
    gradients_out[t, 2] = wp.vec2(wp.float32(g2[0]), wp.float32(g2[1]))
    area_out[t] = wp.float32(signed_area(a, b))


@wp.kernel
def gather_kernel(
    corners: wp.array(dtype=wp.int32),
    starts: wp.array(dtype=wp.int32),
    flat: wp.array(dtype=wp.vec2d),
    density: wp.array(dtype=wp.float64),
    mass_out: wp.array(dtype=wp.float64),
    lumped_out: wp.array(dtype=wp.float64),
    spread_out: wp.array(dtype=wp.float32),
    reach_out: wp.array(dtype=wp.float32),
):
    i = wp.tid()
    mass = wp.float64(0.0)
    lumped = wp.float64(0.0)
    lowest = wp.float64(1.0e30)
    for k in range(starts[i], starts[i + 1]):
        t = corners[k] // 3
        a, b = sides(flat, t)
        area = signed_area(a, b)
        longest = wp.max(wp.max(wp.length(a), wp.length(b)), wp.length(b - a))
        lowest = wp.min(lowest, wp.float64(2.0) * area / longest)
        lumped += area / wp.float64(3.0)
        mass += density[t] * area / wp.float64(3.0)
    mass_out[i] = mass
    lumped_out[i] = lumped
    spread_out[i] = wp.float32(lumped)
    reach_out[i] = wp.float32(wp.float64(0.5) * lowest)
