"""The gradient of the incremental potential, and products with its matrix.

    E(x) = 1/(2 dt^2) |x - x_hat|_M^2 + Psi(x) + B(x) + D(x; x_start)          over the cloth,
         + sum_j k e_j^2 (sqrt(1 + |c_j - s_j|^2/e_j^2) - 1)                   over the collision surface c,

c held to the tracked skin s by a spring that yields: stiffness k, force at most the vertex's hold k e_j.

The matrix A used with it is projective dynamics' constant H = M/dt^2 + K (an upper bound of the elastic Hessian) plus
the contact pairs' Gauss-Newton blocks.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import warp as wp

from tryon_solver.contact import pairs as contact_pairs
from tryon_solver.linalg.blocks import BLOCK
from tryon_solver.linalg.lanes import lanes_of, shares_of, sum_of_lanes
from tryon_solver.linalg.launch import launch

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation

wp.set_module_options({"enable_backward": False})


@wp.kernel
def gather_kernel(
    mass_per_dt2: wp.array(dtype=wp.float32),
    x: wp.array(dtype=wp.vec3),
    x_hat: wp.array(dtype=wp.vec3),
    corner_start: wp.array(dtype=wp.int32),
    corners: wp.array(dtype=wp.int32),
    corner_gradient: wp.array(dtype=wp.vec3),
    gradient_out: wp.array(dtype=wp.vec3),
):
    """M/dt^2 (x - x_hat) plus the incident triangle corners, gathered in fixed order."""
    i = wp.tid()
    total = mass_per_dt2[i] * (x[i] - x_hat[i])
    for k in range(corner_start[i], corner_start[i + 1]):
        total += corner_gradient[corners[k]]
    gradient_out[i] = total


@wp.kernel
def rows_product_kernel(
    columns: wp.array2d(dtype=wp.int32),
    weights: wp.array2d(dtype=wp.float32),
    diagonal: wp.array(dtype=wp.float32),
    p: wp.array(dtype=wp.vec3),
    lanes: int,
    product_out: wp.array(dtype=wp.vec3),
):
    """S p + diagonal p, each row shared by `lanes` threads (linalg/lanes.py)."""
    i = wp.tid() // lanes
    lane = wp.tid() % lanes
    total = wp.vec3()
    if i < columns.shape[0]:
        for k in range(lane, columns.shape[1], lanes):
            total += weights[i, k] * p[columns[i, k]]
    total = wp.vec3(sum_of_lanes(total[0]), sum_of_lanes(total[1]), sum_of_lanes(total[2]))
    if lane == 0 and i < columns.shape[0]:
        product_out[i] = total + diagonal[i] * p[i]


def elastic_gradient(sim: Simulation, x: wp.array, gradient_out: wp.array, correcting: bool = False) -> None:
    """gradient = dE/dx without contact at x, projections made afresh: the local step of projective dynamics [N]."""
    cloth_gradient(sim, x, gradient_out, correcting)
    surface_gradient(sim, x, gradient_out)


def cloth_gradient(sim: Simulation, x: wp.array, gradient_out: wp.array, correcting: bool) -> None:
    """The cloth's part of it."""
    state, work = sim.state, sim.work
    work.corner_gradient.zero_()
    for project in sim.stages.project:
        project(x, work.corner_gradient)
    if correcting:
        for project in sim.stages.project_in_correction:
            project(x, work.corner_gradient)
    launch(
        gather_kernel,
        sim.cloth_count,
        [
            sim.mass_per_dt2,
            x,
            state.x_hat,
            sim.rest.starts,
            sim.rest.corners,
            work.corner_gradient.flatten(),
        ],
        [gradient_out],
        device=sim.device,
    )
    for add_gradient in sim.stages.add_gradient:
        add_gradient(x, gradient_out)
    for add_velocity_gradient in sim.stages.add_velocity_gradient:
        add_velocity_gradient(state, x, gradient_out)
    if correcting:
        for add_velocity_gradient in sim.stages.add_velocity_gradient_in_correction:
            add_velocity_gradient(state, x, gradient_out)


def surface_gradient(sim: Simulation, x: wp.array, gradient_out: wp.array) -> None:
    """The collision surface's part of it, and of the diagonal."""
    if sim.body is not None:
        sim.body.add_gradient(sim.settings, sim.state, x, gradient_out, sim.work.diagonal)


def add_contact_gradient(sim: Simulation, x_ref: wp.array, x: wp.array, gradient_out: wp.array) -> None:
    """gradient += dB/dx + dD/dx of the model made at x_ref [N], of as many vertices as `gradient_out` is long."""
    if sim.pairs.size == 0:
        return
    contact_pairs.add_gradient(sim.pairs, x_ref, x, gradient_out, sim.sums)
    for term in sim.stages.contact:
        term.add_gradient(sim.pairs, sim.state, x, gradient_out)
    sim.sums.settle(gradient_out)


def system_product(sim: Simulation, p: wp.array, product_out: wp.array) -> None:
    """product = A p over the cloth, (N,) vec3; p (A,) vec3 moves the collision surface, too."""
    rows, lanes = sim.matrices.rows, lanes_of(sim.device)
    launch(
        rows_product_kernel,
        shares_of(rows.row_count, lanes),
        [rows.columns, rows.weights, sim.work.diagonal, p, lanes],
        [product_out],
        block_dim=BLOCK,
        device=sim.device,
    )
    if sim.pairs.size:
        contact_pairs.add_product(sim.pairs, p, product_out, sim.sums)


def add_contact_blocks(sim: Simulation, blocks: wp.array) -> None:
    """Make the contact pairs' matrices, of all that acts in them, and add their diagonal blocks to `blocks` (A,)."""
    if sim.pairs.size == 0:
        return
    if sim.stages.contact:
        sim.pairs.beside.zero_()
    for term in sim.stages.contact:
        term.add_stiffness(sim.pairs)
    contact_pairs.add_diagonal(sim.pairs, blocks, sim.sums)


@wp.kernel
def start_blocks_kernel(
    stiffness_diagonal: wp.array(dtype=wp.float32),
    diagonal: wp.array(dtype=wp.float32),
    cloth_count: int,
    blocks_out: wp.array(dtype=wp.mat33),
):
    i = wp.tid()
    d = diagonal[i]
    if i < cloth_count:
        d += stiffness_diagonal[i]
    blocks_out[i] = d * wp.identity(n=3, dtype=wp.float32)


@wp.kernel
def invert_blocks_kernel(blocks: wp.array(dtype=wp.mat33)):
    i = wp.tid()
    blocks[i] = wp.inverse(blocks[i])


def invert_diagonal_blocks(sim: Simulation) -> None:
    """Inverse 3x3 diagonal blocks of A, for the smoother and as block-Jacobi preconditioner."""
    work = sim.work
    launch(
        start_blocks_kernel,
        sim.all_count,
        [sim.matrices.diagonal, work.diagonal, sim.cloth_count],
        [work.blocks],
        device=sim.device,
    )
    add_contact_blocks(sim, work.blocks)
    launch(invert_blocks_kernel, sim.all_count, [], [work.blocks], device=sim.device)
