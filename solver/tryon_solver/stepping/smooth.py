"""Full-space smoother: Chebyshev-weighted block-Jacobi sweeps, then one exact step along what they found.

The sweeps are the Chebyshev iteration for A e = -g on [b/4, b] of the spectrum of D^-1 A (Saad 2003, algorithm 12.1).
b bounds the largest eigenvalue: 2.2 without contact, as for cloth; with contact block Jacobi of stencil sums is
bounded by the largest stencil, 4. A polynomial made for a smaller b multiplies contact error, so the bound that holds
is used, and the exact line search along the smoother's total step makes sure that a cycle never raises the energy.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.vectors import descend
from tryon_solver.stepping.gradient import system_product

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation

wp.set_module_options({"enable_backward": False})

CONTACT_BOUND = 4.0  # largest stencil: four vertices


@wp.kernel
def first_sweep_kernel(
    blocks: wp.array(dtype=wp.mat33),
    gradient: wp.array(dtype=wp.vec3),
    scale: float,
    residual_out: wp.array(dtype=wp.vec3),
    sweep_out: wp.array(dtype=wp.vec3),
    total_out: wp.array(dtype=wp.vec3),
):
    i = wp.tid()
    r = -gradient[i]
    d = scale * (blocks[i] * r)
    residual_out[i] = r
    sweep_out[i] = d
    total_out[i] = d


@wp.kernel
def next_sweep_kernel(
    blocks: wp.array(dtype=wp.mat33),
    product: wp.array(dtype=wp.vec3),
    momentum: float,
    scale: float,
    residual: wp.array(dtype=wp.vec3),
    sweep: wp.array(dtype=wp.vec3),
    total: wp.array(dtype=wp.vec3),
):
    i = wp.tid()
    r = residual[i] - product[i]
    d = momentum * sweep[i] + scale * (blocks[i] * r)
    residual[i] = r
    sweep[i] = d
    total[i] = total[i] + d


@wp.kernel
def total_product_kernel(
    gradient: wp.array(dtype=wp.vec3),
    residual: wp.array(dtype=wp.vec3),
    product: wp.array(dtype=wp.vec3),
    product_out: wp.array(dtype=wp.vec3),
):
    """A total = -g - r, r after the last sweep."""
    i = wp.tid()
    product_out[i] = -gradient[i] - (residual[i] - product[i])


def smooth_in_full_space(sim: Simulation) -> None:
    """`smoothing_sweeps` sweeps on the cloth; updates x and the gradient of the frozen quadratic model."""
    count = sim.settings.smoothing_sweeps
    if count == 0:
        return
    work, n = sim.work, sim.cloth_count
    gradient, residual, sweep = work.gradient[:n], work.residual[:n], work.direction[:n]
    total, product = work.total[:n], work.product[:n]
    top = CONTACT_BOUND if sim.pairs.size else sim.spectral_bound
    middle, half = 0.5 * (top + top / 4), 0.5 * (top - top / 4)
    sigma = middle / half
    rho = 1 / sigma
    launch(
        first_sweep_kernel, n, [work.blocks, gradient, 1 / middle], [residual, sweep, total], device=sim.device
    )
    for _ in range(count - 1):
        system_product(sim, work.direction, product)
        next_rho = 1 / (2 * sigma - rho)
        launch(
            next_sweep_kernel,
            n,
            [work.blocks, product, next_rho * rho, 2 * next_rho / half],
            [residual, sweep, total],
            device=sim.device,
        )
        rho = next_rho
    system_product(sim, work.direction, product)
    launch(total_product_kernel, n, [gradient, residual, product], [product], device=sim.device)
    descend(total, product, sim.state.x, gradient, work.scalars[:3], work.parts)
