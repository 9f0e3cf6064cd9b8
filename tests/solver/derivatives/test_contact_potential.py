"""The barrier potential over pairs in every closest-feature case, and friction on them."""

import numpy as np
import pytest
import warp as wp
from contact_state import (
    MEETINGS,
    MU_BODY,
    MU_SELF,
    contact_gradient,
    distances,
    find_pairs,
    near_state,
    pair_table,
    shares,
    sheet_and_ball,
    two_sheets,
    which_stencils,
)
from drape_states import dense
from reference_distances import stencil_distances
from small_scenes import device_vectors

from tryon_solver.contact import pairs
from tryon_solver.scene import Friction

STATES_EACH = 6
SHARE_OF_REACH = (0.1, 0.9)  # where in the barrier's reach the closest stencil lies


@pytest.fixture(scope="module", params=[two_sheets, sheet_and_ball])
def surfaces(request):
    return request.param()


@pytest.fixture(scope="module")
def states(surfaces):
    """Positions in which the surfaces meet at faces, edges and corners."""
    rng = np.random.default_rng(5)
    d_hat = surfaces.sim.settings.d_hat
    gaps = surfaces.xi + rng.uniform(*SHARE_OF_REACH, size=len(MEETINGS) * STATES_EACH) * d_hat
    return [near_state(surfaces, rng, gap, MEETINGS[k % len(MEETINGS)]) for k, gap in enumerate(gaps)]


def barrier(g, g_hat):
    inside = (g > 0) & (g < g_hat)
    safe = np.where(inside, g, 0.5 * g_hat)
    return np.where(inside, -((safe - g_hat) ** 2) * np.log(safe / g_hat), 0.0)


def test_states_cover_every_closest_feature(surfaces, states):
    """Non-zero guard of this file: points near vertices, edges and faces, edges near ends and insides of edges."""
    seen = set()
    for x in states:
        d, weights = distances(surfaces, x)
        near = d < surfaces.xi + surfaces.sim.settings.d_hat
        for kind, w in zip(surfaces.kinds[near], weights[near]):
            seen.add((int(kind), int((np.abs(w) > 1e-9).sum())))
    assert seen == {(0, 2), (0, 3), (0, 4), (1, 2), (1, 3), (1, 4)}


def test_pairs_are_all_stencils_within_reach_that_count(surfaces, states):
    reach = surfaces.xi + surfaces.sim.settings.d_hat
    total = 0
    for x in states:
        find_pairs(surfaces.sim, x)
        found = which_stencils(surfaces, pair_table(surfaces.sim)["ids"])
        assert len(np.unique(found)) == len(found)
        d, _ = distances(surfaces, x)
        d = np.where(shares(surfaces, x) > 0, d, np.inf)
        assert set(np.flatnonzero(d < reach - 1e-7)) <= set(found.tolist()) <= set(np.flatnonzero(d < reach + 1e-7))
        total += len(found)
    assert total > 2 * len(states)


def test_pair_energy_is_mollified_stiffness_times_barrier(surfaces, states):
    """kappa is pressure stiffness x a third of the mean area of the stencil's cloth; e fades parallel edges, and what
    is nearest on an edge or a corner counts once."""
    sim = surfaces.sim
    area = np.append(sim.area, np.full(sim.body_count, np.nan))
    faded, shared = 0, set()
    for x in states:
        find_pairs(surfaces.sim, x)
        table = pair_table(sim)
        which = which_stencils(surfaces, table["ids"])
        kinds, ids = surfaces.kinds[which], surfaces.stencils[which]
        d = distances(surfaces, x)[0][which]
        kappa = sim.contact.model.pressure_stiffness * np.nanmean(area[ids], axis=1) / 3.0
        cross = np.cross(x[ids[:, 1]] - x[ids[:, 0]], x[ids[:, 3]] - x[ids[:, 2]])
        eps = sim.contact.model.eps_body if sim.body_count else sim.contact.model.eps_self
        ratio = np.minimum((cross**2).sum(1) / eps, 1.0)
        e = np.where(kinds == 1, (2 - ratio) * ratio, 1.0)
        faded += int((e < 0.99).sum())
        share = shares(surfaces, x)[which]
        shared |= set(np.round(1 / share).astype(int).tolist())
        expected = share * e * kappa * barrier(d - surfaces.xi, sim.settings.d_hat)
        # the gap, at least a tenth of d_hat, carries 1e-8 m of rounding
        smallest = 1e-5 * kappa.max() * sim.settings.d_hat**2
        np.testing.assert_allclose(table["energy"], expected, rtol=1e-4, atol=smallest)
    assert faded > 0
    assert shared > {1}, "on edges or corners"


def lagged_weights(surfaces, x):
    """e kappa of every stencil at x, from the solver's energies; where the energy is tiny, from its curvature."""
    table = pair_table(surfaces.sim)
    which = which_stencils(surfaces, table["ids"])
    d, _ = distances(surfaces, x)
    weight = np.zeros(len(d))
    g, g_hat = d[which] - surfaces.xi, surfaces.sim.settings.d_hat
    ratio = (g - g_hat) / g
    curvature = -2 * np.log(g / g_hat) - 4 * ratio + ratio**2
    weight[which] = table["curvature"] / curvature
    return weight


def test_gradient_is_the_potentials(surfaces, states):
    """Stiffness and mollifier are lagged: constants of the potential that is differentiated."""
    sim, step = surfaces.sim, 1e-8
    for x in states:
        find_pairs(surfaces.sim, x)
        weight = lagged_weights(surfaces, x)
        active = np.flatnonzero(weight)

        def energy(positions, weight=weight, active=active):
            kinds, ids = surfaces.kinds[active], surfaces.stencils[active]
            d, _ = stencil_distances(kinds, positions[..., ids, :])
            return (weight[active] * barrier(d - surfaces.xi, sim.settings.d_hat)).sum(-1)

        moving = np.unique(surfaces.stencils[active])
        expected = np.zeros_like(x)
        for vertex in moving:
            shifts = np.zeros((3, *x.shape))
            shifts[range(3), vertex, range(3)] = step
            expected[vertex] = (energy(x + shifts) - energy(x - shifts)) / (2 * step)
        largest = np.abs(expected).max()
        assert largest > 1e-5
        found = contact_gradient(sim, friction=False)
        # the gap, at least a tenth of d_hat = 2 mm, is rounded to some 2e-9 m; the barrier's slope magnifies that
        np.testing.assert_allclose(found, expected, rtol=0, atol=3e-4 * largest)
        np.testing.assert_allclose(found.sum(0), 0, atol=1e-5 * np.abs(found).sum())


def test_matrix_is_semidefinite_and_its_blocks_are_its_diagonal(surfaces, states):
    sim = surfaces.sim
    count = sim.all_count
    for x in states[:6]:
        find_pairs(surfaces.sim, x)
        sim.pairs.beside.zero_()

        def product(p, out):
            out.zero_()
            pairs.add_product(sim.pairs, p, out, sim.sums)

        matrix = dense(count, product)
        size = np.abs(matrix).max()
        assert size > 1e-2
        np.testing.assert_allclose(matrix, matrix.T, rtol=0, atol=1e-6 * size)
        assert np.linalg.eigvalsh(matrix).min() > -1e-5 * size
        blocks = wp.zeros(count, dtype=wp.mat33, device="cpu")
        pairs.add_diagonal(sim.pairs, blocks, sim.sums)
        diagonal = np.stack([matrix[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] for i in range(count)])
        np.testing.assert_allclose(blocks.numpy(), diagonal, rtol=0, atol=1e-5 * size)


def test_curvature_is_the_second_derivative_along_the_normal(surfaces, states):
    """Moving one side of a pair along the normal changes d by exactly that: all of the derivative is e kappa b''."""
    step = 1e-6
    checked = 0
    for x in states:
        find_pairs(surfaces.sim, x)
        table = pair_table(surfaces.sim)
        which = which_stencils(surfaces, table["ids"])
        kinds = surfaces.kinds[which]
        np.testing.assert_allclose(table["lam"].sum(axis=1), 0, atol=1e-6)
        np.testing.assert_allclose(np.linalg.norm(table["normal"], axis=1), 1, atol=1e-6)
        side = np.where(kinds[:, None] == 0, [1.0, 0, 0, 0], [1.0, 1, 0, 0])
        shift = side[..., None] * table["normal"][:, None]
        d = np.stack([stencil_distances(kinds, x[table["ids"]] + t * shift)[0] for t in (-step, 0.0, step)])
        b = lagged_weights(surfaces, x)[which] * barrier(d - surfaces.xi, surfaces.sim.settings.d_hat)
        inner = surfaces.xi + surfaces.sim.settings.d_hat - d[1] > 20 * step
        slope, curvature = (b[2] - b[0]) / (2 * step), (b[2] - 2 * b[1] + b[0]) / step**2
        np.testing.assert_allclose(table["slope"][inner], slope[inner], rtol=5e-3)
        np.testing.assert_allclose(table["curvature"][inner], curvature[inner], rtol=2e-2)
        checked += int(inner.sum())
    assert checked > 2 * len(states)


def test_model_never_pulls(surfaces, states):
    """Beyond where the linear model's force ends, it is silent: contact is one-sided."""
    sim = surfaces.sim
    x = states[0]
    find_pairs(surfaces.sim, x)
    away = x.copy()
    direction = contact_gradient(sim, friction=False)[~surfaces.first].sum(0)
    away[~surfaces.first] -= 0.01 * direction / np.linalg.norm(direction)
    out = wp.zeros(sim.all_count, dtype=wp.vec3, device="cpu")
    pairs.add_gradient(sim.pairs, device_vectors(x), device_vectors(away), out, sim.sums)
    sim.sums.settle(out)
    table = pair_table(sim)
    change = np.einsum("pk,pd,pkd->p", table["lam"], table["normal"], (away - x)[table["ids"]])
    force = np.minimum(table["slope"] + table["curvature"] * change, 0.0)
    expected = np.zeros_like(x)
    np.add.at(expected, table["ids"], (table["lam"] * force[:, None])[..., None] * table["normal"][:, None])
    np.testing.assert_allclose(out.numpy(), expected, rtol=0, atol=1e-4 * np.abs(table["slope"]).max())
    assert (force == 0).any()


@pytest.mark.parametrize("sliding", [0.3, 0.9, 1.5, 20.0])
def test_friction_is_the_gradient_of_its_lagged_potential(surfaces, states, rng, sliding):
    """D = sum mu N f0(|u|) with N and the tangent plane frozen; `sliding` in units of `presliding`."""
    sim = surfaces.sim
    mu = MU_BODY if sim.body_count else MU_SELF
    static = Friction().presliding

    def f0(y):
        return np.where(y < static, y**2 / static * (1 - y / (3 * static)) + static / 3, y)

    for x in states[:8]:
        direction = rng.standard_normal(3)
        slip = sliding * static * direction / np.linalg.norm(direction)
        x_start = x.copy()
        x_start[~surfaces.first] -= slip
        sim.state.x_start.assign(x_start.astype(np.float32))
        find_pairs(surfaces.sim, x)
        table = pair_table(sim)
        barrier_only = contact_gradient(sim, friction=False)
        found = contact_gradient(sim, friction=True) - barrier_only

        def potential(positions, table=table, x_start=x_start):
            moved = np.einsum("pk,...pkd->...pd", table["lam"], (positions - x_start)[..., table["ids"], :])
            n = table["normal"]
            u = moved - (moved * n).sum(-1, keepdims=True) * n
            return (-mu * table["slope"] * f0(np.linalg.norm(u, axis=-1))).sum(-1)

        step = 1e-3 * static
        shifts = step * np.eye(x.size).reshape(-1, *x.shape)
        expected = ((potential(x + shifts) - potential(x - shifts)) / (2 * step)).reshape(x.shape)
        largest = np.abs(expected).max()
        assert largest > 1e-7
        np.testing.assert_allclose(found, expected, rtol=0, atol=4e-3 * max(largest, 0.05 * np.abs(barrier_only).max()))
        # Coulomb: what friction passes on never exceeds mu times the normal force
        passed_on = np.linalg.norm(found[surfaces.first].sum(0))
        assert passed_on <= 1.001 * mu * np.abs(table["slope"]).sum()


def test_friction_matrix_is_semidefinite_and_tangential(surfaces, states):
    sim = surfaces.sim
    (term,) = sim.stages.contact
    x = states[1]
    sim.state.x_start.assign((x - 1e-6).astype(np.float32))
    find_pairs(surfaces.sim, x)
    term.prepare(sim.pairs, sim.state, sim.state.x, None)
    sim.pairs.curvature.zero_()
    sim.pairs.beside.zero_()
    term.add_stiffness(sim.pairs)

    def product(p, out):
        out.zero_()
        pairs.add_product(sim.pairs, p, out, sim.sums)

    matrix = dense(sim.all_count, product)
    size = np.abs(matrix).max()
    assert size > 1e-3
    np.testing.assert_allclose(matrix, matrix.T, rtol=0, atol=1e-5 * size)
    assert np.linalg.eigvalsh(matrix).min() > -1e-5 * size
    # a rigid translation of everything slips nowhere
    together = np.tile(np.eye(3), (sim.all_count, 1))
    np.testing.assert_allclose(matrix @ together, 0, atol=1e-4 * size)
    blocks = wp.zeros(sim.all_count, dtype=wp.mat33, device="cpu")
    pairs.add_diagonal(sim.pairs, blocks, sim.sums)
    diagonal = np.stack([matrix[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] for i in range(sim.all_count)])
    np.testing.assert_allclose(blocks.numpy(), diagonal, rtol=0, atol=1e-4 * size)


def test_pairs_at_or_under_their_offset_are_counted_and_stay_finite(surfaces, states):
    sim = surfaces.sim
    x = states[0].copy()
    d, _ = distances(surfaces, x)
    push = contact_direction(surfaces, x)
    x[~surfaces.first] += (d.min() - 0.3 * surfaces.xi) * push
    find_pairs(surfaces.sim, x)
    assert sim.pairs.overlapping > 0
    table = pair_table(sim)
    for name in ("slope", "curvature", "energy"):
        assert np.isfinite(table[name]).all()
    assert (table["slope"] <= 0).all()


def contact_direction(surfaces, x):
    """Unit vector along which the second surface comes closer to the first at their closest stencil."""
    d, weights = distances(surfaces, x)
    k = int(np.argmin(d))
    difference = weights[k] @ x[surfaces.stencils[k]]
    towards_first = difference / np.linalg.norm(difference)
    return towards_first if surfaces.first[surfaces.stencils[k][0]] else -towards_first
