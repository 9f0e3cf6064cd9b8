"""The spline subspace: partition of unity, affine maps, definite reduced matrices, adjoint transfers, the search."""

import numpy as np
import pytest
import scipy.sparse as sp
import warp as wp
from small_scenes import device_vectors, layers, sheet

from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import parse_pattern
from tryon_solver.geometry.weld import weld
from tryon_solver.linalg.ell import multiply
from tryon_solver.scene import AirDrag, Gravity, Scene
from tryon_solver.simulation import build
from tryon_solver.subspace.basis import (
    explicit_inverse,
    pattern_rows,
    quadratic_spline,
    reduced_matrix,
    spline_basis,
)
from tryon_solver.subspace.search import forget, remember, search_direction

NARROW = [(2, 2, 0.02, 0.02), (2, 20, 0.03, 0.5), (3, 3, 0.05, 0.05), (3, 20, 0.04, 0.4), (4, 4, 0.06, 0.09)]


@pytest.fixture(scope="module")
def sewn():
    """Two panels of 40 x 40 cm sewn along one edge: seam vertices lie in two grids."""
    square = {
        "vertices": [[0, 0], [40, 0], [40, 40], [0, 40]],
        "edges": [{"endpoints": [i, (i + 1) % 4]} for i in range(4)],
        "rotation": [0, 0, 0],
    }
    panels = {"left": {**square, "translation": [0, 0, 0]}, "right": {**square, "translation": [50, 0, 0]}}
    stitches = [[{"panel": "left", "edge": 1}, {"panel": "right", "edge": 3}]]
    pattern = {"pattern": {"panels": panels, "stitches": stitches}, "properties": {"units_in_meter": 100}}
    joined = weld(mesh_pattern(parse_pattern(pattern), 0.03))
    garment = Garment(joined.vertex_of_corner, joined.uv_corners, joined.panel_of_face, joined.vertex_count)
    seam = np.unique(joined.seam_edges)
    return garment, seam


@pytest.fixture(scope="module")
def sim():
    garment, x = sheet(15, 15, 0.45, 0.45)
    return build(Scene(garment, x, None, effects=(Gravity(), AirDrag())))


def test_spline_is_a_partition_of_unity_with_the_stated_pieces():
    x = np.linspace(-1, 1, 2001)
    total = sum(quadratic_spline(x - k) for k in range(-3, 4))
    np.testing.assert_allclose(total, 1, atol=1e-14)
    knots = quadratic_spline(np.array([0, 0.5, 1.0, 1.5, 2.0]))
    np.testing.assert_allclose(knots, [0.75, 0.5, 0.125, 0, 0], atol=1e-15)


def test_rows_sum_to_one_also_on_seams(sewn):
    garment, seam = sewn
    basis = spline_basis(garment, 0.1)
    np.testing.assert_allclose(np.asarray(basis.sum(axis=1)).ravel(), 1, atol=1e-12)
    assert (basis.data > 0).all()
    entries = np.diff(basis.indptr)
    inside = np.setdiff1d(np.arange(garment.vertex_count), seam)
    assert entries[inside].max() == 9
    assert entries[seam].max() > 9


def test_a_vertex_has_a_row_for_each_place_it_has_in_the_pattern(sewn):
    garment, seam = sewn
    corners = zip(garment.faces.ravel(), np.repeat(garment.panel_of_face, 3), garment.uv_corners.reshape(-1, 2))
    wanted = sorted({(vertex, panel, *np.round(uv, 7)) for vertex, panel, uv in corners})
    vertex, panel, uv = pattern_rows(garment)
    assert len(wanted) == garment.vertex_count + len(seam)
    found = [(v, p, *place) for v, p, place in zip(vertex, panel, np.round(uv, 7))]
    assert found == wanted


def test_affine_maps_of_the_pattern_are_in_the_span_within_a_panel():
    """Where no basis was dropped: along the border rows are rescaled, which keeps translations only."""
    garment, x = sheet(31, 31, 0.45, 0.45)
    basis = spline_basis(garment, 0.06)
    whole = np.diff(basis.indptr) == 9
    assert whole.mean() > 0.4
    basis, x = basis[whole].toarray(), x[whole]
    affine = np.column_stack([np.ones(len(x)), x[:, 0], x[:, 2], 3 * x[:, 0] - 2 * x[:, 2] + 0.7])
    found = basis @ np.linalg.lstsq(basis, affine, rcond=None)[0]
    np.testing.assert_allclose(found, affine, atol=1e-10)


def test_panels_share_no_basis_but_at_seams(sewn):
    garment, seam = sewn
    basis = spline_basis(garment, 0.1).tocsc()
    panel = np.full(garment.vertex_count, -1)
    panel[garment.faces.ravel()] = np.repeat(garment.panel_of_face, 3)
    panel[seam] = -1
    for column in range(basis.shape[1]):
        vertices = basis.indices[basis.indptr[column] : basis.indptr[column + 1]]
        assert len(np.unique(panel[vertices][panel[vertices] >= 0])) <= 1


def test_translation_of_the_whole_garment_is_exact(sewn):
    garment, _ = sewn
    basis = spline_basis(garment, 0.1)
    np.testing.assert_allclose(basis @ np.ones(basis.shape[1]), 1, atol=1e-12)


def test_reduced_matrix_is_definite_and_its_inverse_is_one(sim):
    system = sim.stiffness_matrix + sp.diags(sim.mass / sim.dt**2)
    reduced = reduced_matrix(sim.basis, system)
    np.testing.assert_allclose(reduced, reduced.T, rtol=0, atol=1e-12 * np.abs(reduced).max())
    values = np.linalg.eigvalsh(reduced)
    assert values.min() > 0
    assert values.max() / values.min() < 1e7  # beyond that a float32 inverse has no digits
    inverse = explicit_inverse(reduced).astype(np.float64)
    np.testing.assert_allclose(inverse @ reduced, np.eye(len(reduced)), atol=1e-5 * values.max() / values.min())
    # the Galerkin product itself, but for a shift that only matters where bases depend on each other
    dense = sim.basis.toarray()
    expected = dense.T @ system.toarray() @ dense
    np.testing.assert_allclose(reduced, expected, rtol=1e-3, atol=1e-3 * np.abs(expected).max())


@pytest.mark.parametrize(("columns", "rows", "width", "height"), NARROW)
def test_narrow_pieces_have_a_definite_reduced_matrix_too(columns, rows, width, height):
    """Belts, cuffs and collars hold fewer vertices across than the grid has bases."""
    garment, x = sheet(columns, rows, width, height)
    sim = build(Scene(garment, x, None, effects=(Gravity(),)))
    system = sim.stiffness_matrix + sp.diags(sim.mass / sim.dt**2)
    assert np.linalg.eigvalsh(reduced_matrix(sim.basis, system)).min() > 0
    assert np.isfinite(sim.search.inverse.numpy()).all()
    for k in range(3):
        sim.advance(None, (k + 1) / 60)
    assert np.isfinite(sim.cloth_positions()).all()
    # 1 + 2 + 3 steps of g dt^2: it falls, whole
    np.testing.assert_allclose(sim.cloth_positions() - x, [[0, -9.81 * 6 / 3600, 0]] * len(x), atol=1e-6)


def test_bases_that_hold_almost_no_fabric_are_dropped():
    """A sliver of a panel reaching into another grid cell adds no column of tiny numbers."""
    garment, _ = layers(1, 12, 12, 0.301, 0.0)
    basis = spline_basis(garment, 0.1)
    weight = np.asarray(basis.multiply(basis).T @ garment.vertex_areas()).ravel()
    assert weight.min() > 1e-4 * weight.max()


def test_prolongation_and_restriction_are_adjoint(sim, rng):
    """<B y, g> = <y, B^T g> on the device."""
    y, g = rng.standard_normal((sim.search.size, 3)), rng.standard_normal((sim.cloth_count, 3))
    fine = wp.full(sim.cloth_count, wp.vec3(np.nan, np.nan, np.nan), dtype=wp.vec3, device="cpu")
    coarse = wp.full(sim.search.size, wp.vec3(np.nan, np.nan, np.nan), dtype=wp.vec3, device="cpu")
    multiply(sim.search.prolong, device_vectors(y), fine)
    multiply(sim.search.restrict, device_vectors(g), coarse)
    left, right = (fine.numpy() * g).sum(dtype=np.float64), (coarse.numpy() * y).sum(dtype=np.float64)
    assert abs(left) > 1
    assert left == pytest.approx(right, rel=1e-5)
    np.testing.assert_allclose(fine.numpy(), sim.basis @ y, atol=1e-5)
    np.testing.assert_allclose(coarse.numpy(), sim.basis.T @ g, atol=1e-4)


def test_first_direction_solves_the_reduced_system(sim, rng):
    """Without pairs the search direction is minus the reduced gradient through the prefactorised inverse."""
    forget(sim.search)
    g = rng.standard_normal((sim.cloth_count, 3))
    found = search_direction(sim.search, device_vectors(g)).numpy()
    expected = -np.linalg.solve(reduced_system(sim), sim.basis.T @ g)
    np.testing.assert_allclose(found, expected, atol=1e-4 * np.abs(expected).max())


def reduced_system(sim):
    diagonal = sim.mass / sim.dt**2
    for part in sim.plan.stage("diagonal"):
        diagonal = diagonal + part(sim.dt, sim.area)
    return reduced_matrix(sim.basis, sim.stiffness_matrix + sp.diags(diagonal))


def test_search_with_pairs_is_the_textbooks_recursion(sim, rng):
    """Two-loop L-BFGS in float64 on the same pairs, from a matrix that differs from the one the inverse was made of."""
    size = sim.search.size
    first = np.linalg.inv(reduced_system(sim))
    other = np.diag(rng.uniform(1, 30, size)) * np.diag(reduced_system(sim)).mean() + reduced_system(sim)
    forget(sim.search)
    one = wp.array([1.0], dtype=wp.float32, device="cpu")
    pairs = []
    for _ in range(sim.search.memory + 3):  # the oldest pairs are overwritten
        gradient = rng.standard_normal((sim.cloth_count, 3))
        direction = search_direction(sim.search, device_vectors(gradient)).numpy().astype(np.float64)
        reduced = sim.basis.T @ gradient
        q, alphas = reduced.copy(), []
        for s, y in reversed(pairs):
            alphas.append((s * q).sum() / (s * y).sum())
            q = q - alphas[-1] * y
        r = first @ q
        for (s, y), alpha in zip(pairs, reversed(alphas)):
            r = r + s * (alpha - (y * r).sum() / (s * y).sum())
        np.testing.assert_allclose(direction, -r, atol=2e-3 * np.abs(r).max())
        # a product whose restriction is `other` times the direction
        product = np.linalg.lstsq(sim.basis.T.toarray(), other @ direction, rcond=None)[0]
        remember(sim.search, one, device_vectors(product))
        pairs = [*pairs, (direction, other @ direction)][-sim.search.memory :]


@pytest.mark.parametrize("size", [1e-17, 1e-21])
def test_a_pair_too_small_for_float32_is_without_effect(sim, rng, size):
    """Where the search has converged far below rounding, 1/<s, y> would overflow and spoil every later direction."""
    gradient = device_vectors(rng.standard_normal((sim.cloth_count, 3)))
    forget(sim.search)
    expected = search_direction(sim.search, gradient).numpy().copy()  # on the CPU a view
    tiny = rng.standard_normal((sim.cloth_count, 3)) * size
    search_direction(sim.search, device_vectors(tiny))
    remember(sim.search, wp.array([1.0], dtype=wp.float32, device="cpu"), device_vectors(-tiny))
    np.testing.assert_array_equal(search_direction(sim.search, gradient).numpy(), expected)
