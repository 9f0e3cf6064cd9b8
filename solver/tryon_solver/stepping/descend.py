"""Reduced L-BFGS iterations on the frozen quadratic model, each with its exact step length."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tryon_solver.linalg.ell import multiply
from tryon_solver.linalg.vectors import descend
from tryon_solver.stepping.gradient import system_product
from tryon_solver.subspace.search import forget, remember, search_direction

if TYPE_CHECKING:
    from tryon_solver.simulation import Simulation


def forget_search_history(sim: Simulation) -> None:
    """The pairs belong to one frozen model: they live for one step."""
    forget(sim.search)


def descend_in_subspace(sim: Simulation) -> None:
    """`reduced_iterations` L-BFGS iterations; x and the model's gradient follow each."""
    work, n = sim.work, sim.cloth_count
    scalars = work.scalars[:3]
    gradient = work.gradient[:n]
    direction, product = work.direction[:n], work.product[:n]
    for _ in range(sim.settings.reduced_iterations):
        reduced = search_direction(sim.search, gradient)
        multiply(sim.search.prolong, reduced, direction)
        system_product(sim, work.direction, product)
        descend(direction, product, sim.state.x, gradient, scalars, work.parts)
        remember(sim.search, scalars[2], product)
