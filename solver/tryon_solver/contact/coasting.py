"""The way that cloth which touches itself alone goes as one (stepping/coast.py), and where all coast to by themselves.

A motion that all vertices have in common brings no two of them nearer: it needs no proof, and moves the anchors of the
region in which candidates are known along.
"""

from __future__ import annotations

import warp as wp

from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.one_block import sum_up

wp.set_module_options({"enable_backward": False})


@wp.kernel
def spread_diagonal_kernel(diagonal: wp.array(dtype=wp.float32), spread_out: wp.array(dtype=wp.vec3)):
    i = wp.tid()
    spread_out[i] = wp.vec3(diagonal[i])


@wp.kernel
def find_way_kernel(
    least: float,
    slowest: float,
    dt: wp.array(dtype=wp.float32),
    total: wp.array(dtype=wp.vec3),
    stiffness: wp.array(dtype=wp.vec3),
    way_out: wp.array(dtype=wp.vec3),
):
    """-total/stiffness where that is longer than `least` and `slowest` dt; the three of `stiffness` are equal."""
    way = -total[0] / stiffness[0][0]
    way_out[0] = wp.where(wp.length(way) > wp.max(least, slowest * dt[0]), way, wp.vec3())


@wp.kernel
def go_along_kernel(
    way: wp.array(dtype=wp.vec3), x: wp.array(dtype=wp.vec3), anchor: wp.array(dtype=wp.vec3)
):
    i = wp.tid()
    x[i] = x[i] + way[0]
    anchor[i] = anchor[i] + way[0]


@wp.kernel
def coast_kernel(
    x_start: wp.array(dtype=wp.vec3),
    v: wp.array(dtype=wp.vec3),
    dt: wp.array(dtype=wp.float32),
    coasted_out: wp.array(dtype=wp.vec3),
):
    i = wp.tid()
    coasted_out[i] = x_start[i] + dt[0] * v[i]


def coast(x_start: wp.array, v: wp.array, dt: wp.array, coasted_out: wp.array) -> None:
    """Where each vertex of the cloth comes to from `x_start` m by its velocity `v` (N,) m/s alone in `dt` (1,) s."""
    launch(coast_kernel, len(v), [x_start, v, dt], [coasted_out], device=v.device)


class Coasting:
    """`total` (1,) N of dE/dx, `stiffness` (1,) N/m, thrice, and the `way` (1,) m, that at the step's end beside it."""

    def __init__(self, device: str) -> None:
        places = (wp.zeros(1, dtype=wp.vec3, device=device) for _ in range(4))
        self.total, self.stiffness, self.way, self.way_at_end = places

    def find_way(
        self,
        gradient: wp.array,
        diagonal: wp.array,
        spread: wp.array,
        dt: wp.array,
        least: float,
        slowest: float,
        way_out: wp.array,
    ) -> None:
        """Where forces balance as one: -sum dE/dx / sum d of `gradient` (N,) N and `diagonal` (N,) N/m, none if that is
        shorter than `least` m or slower than `slowest` m/s. `spread` (N,) vec3 is scratch."""
        count, device = len(spread), gradient.device
        sum_up(gradient, count, self.total)
        launch(spread_diagonal_kernel, count, [diagonal], [spread], device=device)
        sum_up(spread, count, self.stiffness)
        launch(find_way_kernel, 1, [least, slowest, dt, self.total, self.stiffness], [way_out], device=device)

    def go_along(self, way: wp.array, cloth_count: int, x: wp.array, anchor: wp.array) -> None:
        """Move the cloth in x (A,) m, and its anchors, along the `way` (1,) m."""
        launch(go_along_kernel, cloth_count, [way], [x, anchor], device=x.device)
