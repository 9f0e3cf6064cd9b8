"""Of the stencils in which a vertex or an edge meets a mesh those count, once, that are nearest among all about the
place: by the solver, and by the reference, which was written again."""

import numpy as np
import pytest
from contact_probes import solver_distances, solver_shares
from contact_state import MEETINGS, near_state, sheet_and_ball, triangles, two_sheets
from contact_state import shares as shares_in
from small_scenes import sheet

from tryon_solver.baselines.newton_ipc.distance import closest
from tryon_solver.baselines.newton_ipc.shares import Neighbours, shares

HEIGHT = 2e-3  # m


def reference_shares(faces, kinds, ids, x):
    return shares(Neighbours.of(faces, len(x)), kinds, ids, closest(kinds, x[ids]), x)


BOTH = pytest.mark.parametrize("shares_of", [solver_shares, reference_shares])


def met_by(points, faces, x, shares_of):
    """Of points (K, 3) m and all triangles: (K, F) how much each stencil counts, and its distance [m]."""
    places = np.vstack([x, points]).astype(np.float32).astype(np.float64)
    ids = np.array([[len(x) + k, *face] for k in range(len(points)) for face in faces])
    kinds = np.zeros(len(ids), np.int64)
    share = shares_of(faces, kinds, ids, places)
    return share.reshape(len(points), -1), solver_distances(0, places[ids])[0].reshape(len(points), -1)


@BOTH
def test_a_plane_is_felt_alike_wherever_a_vertex_is_above_it(rng, shares_of):
    """By the triangle below, by both beside an edge; near a corner by what comes to about as much."""
    garment, x = sheet(9, 7, 0.2, 0.15)
    faces = garment.faces[(np.abs(x[garment.faces]) < [0.08, 1, 0.06]).all((1, 2))]
    assert len(faces) > 20
    above, up = x[faces], np.array([0, HEIGHT, 0])
    within = rng.dirichlet(np.full(3, 30.0), len(faces))
    alone, d = met_by(np.einsum("fk,fkd->fd", within, above) + up, garment.faces, x, shares_of)
    np.testing.assert_array_equal(alone, np.where(d <= HEIGHT + 1e-7, 1.0, 0.0))
    beside = np.column_stack([rng.uniform(0, 0.05, len(faces)), rng.uniform(0.3, 0.5, len(faces))])
    beside = np.column_stack([beside, 1 - beside.sum(1)])
    both, apart = met_by(np.einsum("fk,fkd->fd", beside, above) + up, garment.faces, x, shares_of)
    assert ((apart < 1.2 * HEIGHT) & (apart > HEIGHT + 1e-7)).sum() > 20, "which would be felt"
    assert ((both > 0).sum(1) <= 2).all()
    np.testing.assert_allclose(both.sum(1), 1.0, atol=2e-4)
    corner = above[:, 0] + up + 1e-4 * rng.uniform(-1, 1, (len(faces), 3)) * [1, 0, 1]
    about, _ = met_by(corner, garment.faces, x, shares_of)
    assert (about.sum(1) > 0.5).all()
    assert (about.sum(1) < 1.6).all()


def folded(angle):
    """Two triangles on an edge along z, turned down by `angle` rad to both sides of a plane."""
    down = np.array([np.cos(angle), -np.sin(angle), 0.0])
    x = np.array([[0, 0, -0.05], [0, 0, 0.05], 0.1 * down, 0.1 * down * [-1, 1, 1]])
    return x, np.array([[0, 1, 2], [1, 0, 3]])


@BOTH
def test_a_ridge_is_felt_once_and_a_valley_from_both_sides(shares_of):
    """In a valley more and more, with the height in which its sides are apart."""
    points = np.array([[0.0, HEIGHT, 0.0], [0.03, HEIGHT, 0.0], [-0.03, HEIGHT, 0.01]])
    ridge, _ = met_by(points, folded(0.4)[1], folded(0.4)[0], shares_of)
    np.testing.assert_array_equal(ridge, [[0.5, 0.5], [1, 0], [0, 1]])
    low, _ = met_by(points[:1], folded(-0.4)[1], folded(-0.4)[0], shares_of)
    np.testing.assert_allclose(low, [[0.5, 0.5]], atol=0.01)
    high, _ = met_by(15 * points[:1], folded(-0.4)[1], folded(-0.4)[0], shares_of)
    np.testing.assert_array_equal(high, [[1, 1]])


@BOTH
def test_borders_and_tips_are_felt_once(shares_of):
    """Beyond the middle of a border edge, beyond a corner of one triangle, and above the tip of a cone of six."""
    x, faces = folded(0.0)
    points = np.array([[0.06, 0.0, 0.03], [0.11, 0.0, 0.0], [0.0, 0.0, 0.06]])
    share, _ = met_by(points, faces, x, shares_of)
    np.testing.assert_allclose(share, [[1, 0], [1, 0], [0.5, 0.5]])
    around = np.arange(6) * np.pi / 3
    cone = np.vstack([[0, 0, 0], 0.1 * np.column_stack([np.cos(around), np.full(6, -0.7), np.sin(around)])])
    six = np.array([[0, 1 + (k + 1) % 6, 1 + k] for k in range(6)])
    tip, _ = met_by(np.array([[1e-4, HEIGHT, 2e-4]]), six, cone, shares_of)
    np.testing.assert_allclose(tip, np.full((1, 6), 1 / 6))


@BOTH
def test_two_edges_count_where_they_are_nearest_within_both(shares_of):
    x = np.array([[-1, 0, 0], [1, 0, 0], [0, 0, 1], [0, 1, -1], [0, 1, 1], [1, 1, 0], [3, 1, -1], [3, 1, 1]]) * 0.1
    ids = np.array([[0, 1, 3, 4], [0, 1, 6, 7]])
    faces = np.array([[0, 1, 2], [3, 4, 5], [6, 7, 5]])
    np.testing.assert_array_equal(shares_of(faces, np.array([1, 1]), ids, x), [1, 0])
    x[[3, 4], 0] += 0.095  # 2.5 % from an end
    np.testing.assert_allclose(shares_of(faces, np.array([1, 1]), ids, x), [0.5, 0], rtol=1e-4)


@pytest.mark.parametrize("made", [two_sheets, sheet_and_ball])
def test_what_is_nearest_of_all_counts_and_both_agree(rng, made):
    """Wherever two surfaces meet, stencils that are as near as any but for a tenth of a millimetre count."""
    surfaces = made()
    dropped, least = 0, np.inf
    for k in range(24):
        x = near_state(surfaces, rng, surfaces.xi + 1e-3, MEETINGS[k % len(MEETINGS)])
        share = solver_shares(triangles(surfaces), surfaces.kinds, surfaces.stencils, x)
        np.testing.assert_allclose(share, shares_in(surfaces, x), atol=2e-3)
        d = closest(surfaces.kinds, x[surfaces.stencils]).d
        least = min(least, share[d < d.min() + 1e-4].sum())
        dropped += int((share[d < surfaces.xi + 2e-3] == 0).sum())
    assert least > 0.4
    assert dropped > 24
