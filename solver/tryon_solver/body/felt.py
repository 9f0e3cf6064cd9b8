"""The velocity with which the body has carried each vertex, as far as it is felt (stepping/leap.py)."""

from __future__ import annotations

import warp as wp

from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.vectors import slip_of

wp.set_module_options({"enable_backward": False})


@wp.kernel
def feel_kernel(
    hardest: float,
    step: wp.array(dtype=wp.float32),
    x: wp.array(dtype=wp.vec3),
    felt: wp.array(dtype=wp.vec3),
    x_start: wp.array(dtype=wp.vec3),
):
    i = wp.tid()
    dt = step[0]
    carried = (x[i] - x_start[i]) / dt
    slipped = slip_of(carried - felt[i], hardest)
    x_start[i] = x_start[i] + dt * slipped
    felt[i] = carried - slipped


@wp.kernel
def join_kernel(
    dt: wp.array(dtype=wp.float32),
    x: wp.array(dtype=wp.vec3),
    x_start: wp.array(dtype=wp.vec3),
    felt_out: wp.array(dtype=wp.vec3),
):
    i = wp.tid()
    felt_out[i] = (x[i] - x_start[i]) / dt[0]
    x_start[i] = x[i]


@wp.kernel
def go_along_kernel(felt: wp.array(dtype=wp.vec3), v: wp.array(dtype=wp.vec3)):
    i = wp.tid()
    v[i] = v[i] + felt[i]


def feel(hardest: float, dt: wp.array, x: wp.array, felt: wp.array, x_start: wp.array) -> None:
    """Who was carried from `x_start` to x (A,) m in `dt` (1,) s starts where it feels no change of that velocity beyond
    `hardest` m/s; `felt` (A,) m/s is what it has felt."""
    launch(feel_kernel, len(x), [hardest, dt, x], [felt, x_start], device=x.device)


def join(dt: wp.array, x: wp.array, x_start: wp.array, felt_out: wp.array) -> None:
    """Who was carried from `x_start` to x (A,) m in `dt` (1,) s starts there; `felt` (A,) m/s says how fast."""
    launch(join_kernel, len(x), [dt, x], [x_start, felt_out], device=x.device)


def go_along(felt: wp.array, v: wp.array) -> None:
    """Add what is `felt` (A,) to the cloth's velocities `v` (N,) m/s."""
    launch(go_along_kernel, len(v), [felt], [v], device=v.device)
