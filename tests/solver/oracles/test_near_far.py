"""A constant matrix split by a mesh's pattern is the same matrix, near and far together."""

import numpy as np
import pytest
import scipy.sparse as sp
import warp as wp
from small_scenes import sheet

from tryon_solver.linalg.block_ell import BlockRows
from tryon_solver.linalg.device_matrix import DeviceMatrix, Summand, add_together, union
from tryon_solver.linalg.near_far import Places
from tryon_solver.linalg.rated import add_rated
from tryon_solver.materials.device import RestShape
from tryon_solver.materials.triangle_hessian import TriangleHessian


@pytest.fixture
def garment():
    wp.init()
    return sheet(6, 5, 0.3, 0.2)[0]


def of_flaps(garment, rng):
    """(N, N) rows that sum to zero, with an entry for every two vertices of every two triangles that share an edge."""
    n = garment.vertex_count
    sides = np.sort(garment.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 3, 2), axis=2)
    total = np.zeros((n, n))
    for t, own in enumerate(sides):
        for other in np.flatnonzero((sides[:, :, None] == own).all(3).any((1, 2))):
            if other != t:
                part = np.union1d(garment.faces[t], garment.faces[other])
                w = rng.normal(size=len(part))
                w -= w.mean()
                total[np.ix_(part, part)] += np.outer(w, w)
    return sp.csr_matrix(total)


def dense(parts, rows):
    """Near and far together as (N, N), by their arrays; off the diagonal, and on it."""
    n = rows.row_count
    off, on = np.zeros((n, n)), np.zeros(n)
    columns, near = rows.columns.numpy(), parts.near.numpy()
    far_columns, far = parts.far.columns.numpy(), parts.far.weights.numpy()
    for i in range(n):
        on[i] = near[i, 0]
        np.add.at(off[i], columns[i, 1:], near[i, 1:])
        np.add.at(off[i], far_columns[i], far[i])
    return off, on


def split(places, pattern, matrix):
    """The matrix, which has entries in the pattern alone, near and far; poisoned first."""
    values = wp.full(pattern.nnz, np.nan, dtype=wp.float64, device="cpu")
    add_together([Summand.over(pattern, DeviceMatrix.of(matrix, "cpu"), 1.0)], values)
    parts = places.zeros()
    parts.near.fill_(np.nan)
    parts.far.weights.fill_(np.nan)
    places.take(values, parts)
    return parts


def test_near_and_far_are_the_matrix(garment):
    rng = np.random.default_rng(5)
    one, other = of_flaps(garment, rng), of_flaps(garment, rng)
    rows = BlockRows.build(*garment.connectivity.pairs, "cpu")
    pattern = union([one, other], garment.vertex_count)
    places = Places.of(pattern, rows)
    parts = [split(places, pattern, matrix) for matrix in (one, other)]
    for matrix, part in zip((one, other), parts):
        off, on = dense(part, rows)
        wanted = matrix.toarray()
        np.testing.assert_allclose(on, np.diag(wanted), rtol=1e-6)
        np.testing.assert_allclose(off, wanted - np.diag(np.diag(wanted)), atol=1e-6)
        assert np.abs(part.near.numpy()[:, 1:]).sum() > 1
        assert np.abs(part.far.weights.numpy()).sum() > 1
    total = places.zeros()
    add_rated(parts[0], wp.array([3.0], dtype=wp.float32, device="cpu"), parts[1], total)
    off, on = dense(total, rows)
    wanted = (one + 3 * other).toarray()
    np.testing.assert_allclose(off + np.diag(on), wanted, atol=1e-5)


def test_no_neighbour_is_far_and_padding_stays_zero(garment):
    rows = BlockRows.build(*garment.connectivity.pairs, "cpu")
    matrix = of_flaps(garment, np.random.default_rng(6))
    parts = split(Places.of(matrix, rows), matrix, matrix)
    columns, far = rows.columns.numpy(), parts.far
    for i in range(garment.vertex_count):
        real = far.columns.numpy()[i] != i
        assert not set(far.columns.numpy()[i][real]) & set(columns[i])
        assert (far.weights.numpy()[i][~real] == 0).all()
        assert not real[np.argmin(real) :].any() or real.all(), "padding comes last: products end with it"
    assert (parts.near.numpy()[:, 1:][columns[:, 1:] == columns[:, :1]] == 0).all()
    rest = RestShape.build(garment, np.ones(len(garment.faces)), "cpu")
    TriangleHessian.build(rest, garment.connectivity, rows.width).sum_up(parts.near, rows)
    np.testing.assert_allclose(rows.blocks.numpy(), parts.near.numpy()[..., None, None] * np.eye(3), atol=0)
