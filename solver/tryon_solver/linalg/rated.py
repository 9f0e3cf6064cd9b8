"""Matrices of forces proportional to velocity, over the time step, beside those of the stiffness."""

from __future__ import annotations

import warp as wp

from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.near_far import NearFar

wp.set_module_options({"enable_backward": False})


@wp.kernel
def add_rated_kernel(
    stiffness: wp.array2d(dtype=wp.float32),
    per_dt: wp.array(dtype=wp.float32),
    rate: wp.array2d(dtype=wp.float32),
    out: wp.array2d(dtype=wp.float32),
):
    i, k = wp.tid()
    out[i, k] = stiffness[i, k] + per_dt[0] * rate[i, k]


def add_rated(stiffness: NearFar, per_dt: wp.array, rate: NearFar, out: NearFar) -> None:
    """out = stiffness [N/m] + rate [N s/m] `per_dt` (1,) 1/s, all three with the same places."""
    device = per_dt.device
    parts = (
        (stiffness.near, rate.near, out.near),
        (stiffness.far.weights, rate.far.weights, out.far.weights),
    )
    for one, other, whole in parts:
        launch(add_rated_kernel, whole.shape, [one, per_dt, other], [whole], device=device)
