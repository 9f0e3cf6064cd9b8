"""The dearest kernels of a frame against what the device can do at most (Williams, Waterman and Patterson 2009).

A garment is worn and walks for a second and a few frames; the kernels then run again and again on the arrays as they
are, which they only read or add to. Small scenes fit into a GPU's cache, so that more bytes a second can go through
than a streaming copy moves.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import warp as wp
from ceilings import ceilings, seconds
from costs import Cost, advance, contact_blocks, coupled_unknowns, pair_search, product, random_vectors, taking_apart
from worn import LEAD, Case, put_on

from tryon_solver.contact import pooled
from tryon_solver.contact.broad_phase import NOTHING_KNOWN, take_apart
from tryon_solver.contact.found import CLOSE, PAIRS, STENCILS, Found
from tryon_solver.contact.pairs import add_diagonal
from tryon_solver.contact.triangle_pairs import walk as walk_tree
from tryon_solver.linalg import pcg, pcg_together
from tryon_solver.linalg.blocks import BLOCK, whole_blocks
from tryon_solver.linalg.lanes import lanes_of, shares_of
from tryon_solver.simulation import Simulation
from tryon_solver.stepping.newton import newton_matrix
from tryon_solver.stepping.search import scope

FRAMES = 10  # after the lead into the motion
ITERATIONS = 20  # of conjugate gradients in one launch on a processor


@dataclass(frozen=True)
class Kernel:
    """A name, what launches it once, and what such a launch costs."""

    name: str
    launch: Callable[[], object]
    cost: Cost


def measured(case: Case) -> dict[str, Any]:
    """Each kernel of the case's scene: its time, what it reaches, and its share of the lower roof."""
    sim, pose = put_on(case)
    start = sim.state.time
    for k in range(1, round(LEAD * case.fps) + FRAMES + 1):
        sim.advance(pose(k / case.fps), start + k / case.fps)
    copied, added = ceilings(case.device)
    kernels = [conjugate_gradients(sim), hessian_blocks(sim), *searches(sim), *stencils(sim)]
    return {
        **case.plain(),
        "machine": str(wp.get_device(case.device).name),
        "cloth_vertices": sim.cloth_count,
        "bytes_per_s": copied,
        "operations_per_s": added,
        "kernels": [told(kernel, seconds(kernel.launch, case.device), copied, added) for kernel in kernels],
    }


def told(kernel: Kernel, took: float, copied: float, added: float) -> dict[str, Any]:
    """Figures of a kernel that took so long [s]; `copied` and `added` are the roofs."""
    cost = kernel.cost
    by_bytes, by_operations = cost.bytes / copied, cost.operations / added
    return {
        "kernel": kernel.name,
        "us": 1e6 * took,
        "bytes": cost.bytes,
        "operations": cost.operations,
        "roof": "bytes" if by_bytes >= by_operations else "operations",
        "share": max(by_bytes, by_operations) / took,
    }


def conjugate_gradients(sim: Simulation) -> Kernel:
    """On a GPU the product of an iteration; on a processor, whose solver is one kernel, whole iterations."""
    return iterations_alone(sim) if wp.get_device(sim.device).is_cpu else product_together(sim)


def iterations_alone(sim: Simulation) -> Kernel:
    """Of the solver that is one kernel."""
    matrix, gradient = newton_matrix(sim), random_vectors(sim.all_count, sim.device)
    out = wp.zeros_like(gradient)
    sim.aggregates.take(matrix, pooled.add_pairs if sim.pairs.size else None)

    def solve() -> None:
        pcg.solve(sim.cg, matrix, sim.work.blocks, gradient, out, ITERATIONS, 0.0, sim.aggregates)

    solve()
    unknowns = coupled_unknowns(matrix)
    iteration = product(matrix, unknowns, 1) + advance(unknowns)
    name = f"{sim.cg.taken()} iterations of conjugate gradients (linalg/pcg_alone.py)"
    return Kernel(name, solve, iteration.times(sim.cg.taken()))


def product_together(sim: Simulation) -> Kernel:
    """Of the solver of all threads, over and over in its first iteration."""
    matrix, device = newton_matrix(sim), sim.device
    lanes, rows = lanes_of(device), len(matrix.columns)
    shares = shares_of(rows, lanes)
    threads = whole_blocks(shares + sim.all_count - rows + len(matrix.ids))
    cg = sim.cg
    # as an iteration finds it: of number 0, more to do, and what is summed there at first
    both = np.zeros((2 * sim.all_count, 4), np.float32)
    both[::2, :3] = random_vectors(sim.all_count, device).numpy()
    both[::2, 3] = sim.aggregates.count  # nobody's
    cg.both.assign(both)
    pcg_together.spread_out(matrix, cg.spread)
    cg.state.zero_()
    cg.first.fill_(1.0)
    cg.sums.fill_(1)

    def multiply() -> None:
        given = [matrix, lanes, shares, ITERATIONS, 0.0, cg.spread, cg.both, sim.aggregates.common, threads]
        kept = [cg.direction, cg.product, cg.pulled, cg.pulled_whole, cg.sums, cg.first, cg.squares, cg.state]
        wp.launch(pcg_together.multiply_kernel, threads, given, kept, block_dim=BLOCK, device=device)

    name = "product of conjugate gradients (linalg/pcg_together.py)"
    return Kernel(name, multiply, product(matrix, sim.all_count, 2))


def hessian_blocks(sim: Simulation) -> Kernel:
    """The contact pairs' blocks on the diagonal."""
    blocks = wp.clone(sim.work.blocks)
    name = "contact blocks of the Hessian (contact/pairs.py)"
    return Kernel(name, lambda: add_diagonal(sim.pairs, blocks, sim.sums), contact_blocks(sim.pairs))


def searches(sim: Simulation) -> list[Kernel]:
    """Pairs of triangles, of the cloth with each surface, as if nothing were known yet; with clearing the counts."""
    kernels = []
    for surface, found in zip(sim.touching, sim.candidates.found):
        name = "the cloth" if surface is sim.cloth else "the body"
        kernels.append(search(sim, surface, found, f"pairs of triangles with {name} (contact/triangle_pairs.py)"))
    return kernels


def search(sim: Simulation, surface: Any, found: Any, name: str) -> Kernel:
    """Of the cloth with one surface, into room of its own."""
    own, other = anew(sim.cloth), anew(surface)
    triangles, counts = wp.zeros_like(found.triangles), wp.zeros_like(found.counts)

    def walk() -> None:
        counts.zero_()
        walk_tree(sim.cloth, surface, own, other, True, triangles, counts)

    walk()
    answers = int(counts.numpy()[int(PAIRS)])
    return Kernel(name, walk, pair_search(sim.cloth.face_count, surface.face_count, answers))


def stencils(sim: Simulation) -> list[Kernel]:
    """What a search anew would list of these pairs; with setting the counts back."""
    kernels, around = [], scope(sim, sim.state.x)
    for surface in around.surfaces:
        surface.budget.fill_(NOTHING_KNOWN)
    around.enclose()  # by which it is not known any more what the list has
    for k, surface in enumerate(sim.touching):
        found = Found.allocate(sim.candidates.found[k].rooms, sim.device)
        around.search(found, k, anew=True)
        counts = found.counts.numpy()
        close = found.close.numpy()[: counts[int(CLOSE)]]
        listed = min(int(counts[int(STENCILS)]), len(found.ids))
        counts[int(STENCILS)] = 0
        name = "the cloth" if surface is sim.cloth else "the body"
        name = f"stencils of pairs of triangles with {name} (contact/broad_phase.py)"
        cost = taking_apart(sim.cloth.faces.numpy(), surface.faces.numpy(), close, listed)
        begun: wp.array = wp.array(counts, dtype=wp.int32, device=sim.device)
        kernels.append(Kernel(name, partial(take_again, sim, surface, found, begun), cost))
    return kernels


def take_again(sim: Simulation, surface: Any, found: Found, begun: wp.array) -> None:
    """Take pairs of triangles apart, as if none had been, by the counts `begun` with."""
    wp.copy(found.counts, begun)
    take_apart(found, sim.cloth, surface, sim.region, sim.group, sim.state.x)


def anew(surface: Any) -> Any:
    """Its triangles for kernels, of which nothing is known."""
    known = wp.full(surface.face_count, NOTHING_KNOWN, dtype=wp.float32, device=surface.known.device)
    return replace(surface, known=known).side
