"""The second scheme: conjugate gradients on the frozen quadratic model, preconditioned by two levels.

The preconditioner is a symmetric V-cycle: two damped block-Jacobi sweeps, the exact contact-aware coarse level
(subspace/contact_coarse.py), two sweeps. It stands behind the same interface as the paper's cycle, a tuple of verbs, so
that the two can be compared.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import warp as wp

from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.vectors import add_scaled, dot
from tryon_solver.stepping.gradient import system_product
from tryon_solver.stepping.smooth import CONTACT_BOUND
from tryon_solver.subspace.contact_coarse import correct_coarsely

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation

wp.set_module_options({"enable_backward": False})

SWEEPS = 2
DAMPING = 1.6  # over the largest eigenvalue of D^-1 A: below 2, where Jacobi stops converging


@wp.kernel
def sweep_kernel(
    blocks: wp.array(dtype=wp.mat33),
    scale: float,
    residual: wp.array(dtype=wp.vec3),
    product: wp.array(dtype=wp.vec3),
    z: wp.array(dtype=wp.vec3),
):
    """z += scale D^-1 (r - A z)"""
    i = wp.tid()
    z[i] = z[i] + scale * (blocks[i] * (residual[i] - product[i]))


@wp.kernel
def difference_kernel(a: wp.array(dtype=wp.vec3), b: wp.array(dtype=wp.vec3), out: wp.array(dtype=wp.vec3)):
    i = wp.tid()
    out[i] = a[i] - b[i]


@wp.kernel
def add_kernel(a: wp.array(dtype=wp.vec3), out: wp.array(dtype=wp.vec3)):
    """out += a"""
    i = wp.tid()
    out[i] = out[i] + a[i]


@wp.kernel
def negate_kernel(a: wp.array(dtype=wp.vec3), out: wp.array(dtype=wp.vec3)):
    """out = -a"""
    i = wp.tid()
    out[i] = -a[i]


@wp.kernel
def step_length_kernel(scalars: wp.array(dtype=wp.float32), length_out: wp.array(dtype=wp.float32)):
    """<r, z>/<p, A p>, zero where the direction has no curvature."""
    length_out[0] = 0.0
    if scalars[2] > 0.0:
        length_out[0] = scalars[0] / scalars[2]


@wp.kernel
def turn_kernel(
    scalars: wp.array(dtype=wp.float32), z: wp.array(dtype=wp.vec3), direction: wp.array(dtype=wp.vec3)
):
    """p = z + <r, z>/<r, z before> p"""
    i = wp.tid()
    b = float(0.0)
    if scalars[1] > 0.0:
        b = scalars[0] / scalars[1]
    direction[i] = z[i] + b * direction[i]


def assemble_coarse_level(sim: Simulation) -> None:
    """Factor the coarse matrix of this step's frozen model: constant matrix, contact pairs, friction."""
    coarse, pairs = sim.coarse, sim.pairs
    assert coarse is not None
    n = pairs.size
    across = np.zeros(n)
    for term in sim.stages.contact:
        across += term.tangential(pairs)
    coarse.factorise(
        pairs.ids.numpy()[:n],
        pairs.lam.numpy()[:n].astype(np.float64),
        pairs.normal.numpy()[:n].astype(np.float64),
        pairs.curvature.numpy()[:n].astype(np.float64),
        across,
    )


def precondition(sim: Simulation, residual: wp.array, z: wp.array) -> None:
    """z = one V-cycle applied to the residual, over the cloth; z is (A,) and zero on the collision surface."""
    work, n, coarse = sim.work, sim.cloth_count, sim.coarse
    assert coarse is not None
    scale = DAMPING / (CONTACT_BOUND if sim.pairs.size else sim.spectral_bound)
    product = work.product[:n]

    def sweep() -> None:
        system_product(sim, z, product)
        launch(sweep_kernel, n, [work.blocks, scale, residual, product], [z], device=sim.device)

    z.zero_()
    for _ in range(SWEEPS):
        sweep()
    system_product(sim, z, product)
    launch(difference_kernel, n, [residual, product], [product], device=sim.device)
    correct_coarsely(coarse, product, product)
    launch(add_kernel, n, [product], [z], device=sim.device)
    for _ in range(SWEEPS):
        sweep()


def solve_on_two_levels(sim: Simulation) -> None:
    """`coarse_iterations` of preconditioned conjugate gradients; x and the model's gradient follow each."""
    work, n, device = sim.work, sim.cloth_count, sim.device
    gradient, direction, z = work.gradient[:n], work.direction, work.preconditioned
    residual, product = work.residual[:n], work.product[:n]
    scalars, length = work.products, work.scalars[0]
    current, previous, curvature = scalars[0:1], scalars[1:2], scalars[2:3]
    direction.zero_()
    scalars.zero_()
    for _ in range(sim.settings.coarse_iterations):
        launch(negate_kernel, n, [gradient], [residual], device=device)
        precondition(sim, residual, z)
        wp.copy(previous, current)
        dot(residual, z[:n], current, work.parts)
        launch(turn_kernel, n, [scalars, z], [direction], device=device)
        system_product(sim, direction, product)
        dot(direction[:n], product, curvature, work.parts)
        launch(step_length_kernel, 1, [scalars], [length], device=device)
        add_scaled(length, direction[:n], sim.state.x)
        add_scaled(length, product, gradient)
