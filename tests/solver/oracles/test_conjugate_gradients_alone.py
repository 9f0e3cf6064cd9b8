"""The processor's conjugate gradients, one kernel of one thread, against a direct solve of the same matrix.

The matrix has all parts that the correction's has: rows of blocks and of weights that sum to zero, a diagonal, and
contact pairs, some of them of unknowns that have no rows, as a body's vertices.
"""

import numpy as np
import pytest
import warp as wp

from tryon_solver.linalg import pcg, pcg_alone
from tryon_solver.linalg.block_ell import BlockRows
from tryon_solver.linalg.ell import EllMatrix

CLOTH, COUNT, PAIRS, ROOM = 120, 200, 40, 64
TOUCHED = range(CLOTH, CLOTH + 30)  # of those without rows


def array(values, dtype):
    return wp.array(np.asarray(values), dtype=dtype, device="cpu")


class System:
    """The matrix as the kernel takes it and as a dense one (3 COUNT, 3 COUNT), its inverse blocks, a gradient."""

    def __init__(self):
        random = self.random = np.random.default_rng(11)
        dense = np.zeros((COUNT, COUNT, 3, 3))
        faces = np.array([[i, i + 1, i + 2] for i in range(CLOTH - 2)])
        rows = BlockRows.build(faces, CLOTH, "cpu")
        columns = rows.columns.numpy()
        blocks = np.zeros((*columns.shape, 3, 3))
        for i in range(CLOTH):
            for k in range(1, columns.shape[1]):
                j = columns[i, k]
                if j <= i:
                    continue  # made with its transpose below, or padding
                factor = random.normal(size=(3, 3))
                own = 30 * factor @ factor.T
                back = int(np.flatnonzero(columns[j] == i)[0])
                blocks[i, k] = blocks[j, back] = -own
                for a, b, sign in ((i, j, -1), (j, i, -1), (i, i, 1), (j, j, 1)):
                    dense[a, b] += sign * own
        blocks[:, 0] = -blocks[:, 1:].sum(1)
        rows.blocks.assign(blocks.astype(np.float32))
        far = np.zeros((CLOTH, CLOTH))
        for i in range(CLOTH - 7):
            far[i, i + 7] = far[i + 7, i] = -random.uniform(1, 5)
        np.fill_diagonal(far, -far.sum(1))
        dense[:CLOTH, :CLOTH] += np.einsum("ij,ab->ijab", far, np.eye(3))
        diagonal = random.uniform(0.5, 3.0, COUNT)
        dense[range(COUNT), range(COUNT)] += np.einsum("i,ab->iab", diagonal, np.eye(3))
        ids = np.zeros((ROOM, 4), np.int32)
        lam, normal = np.full((ROOM, 4), np.nan), np.full((ROOM, 3), np.nan)
        curvature, beside = np.full(ROOM, np.nan), np.full((ROOM, 3, 3), np.nan)
        for c in range(PAIRS):
            ids[c] = [*random.choice(CLOTH, 2, replace=False), *random.choice(TOUCHED, 2, replace=False)]
            share = random.uniform(size=2)
            lam[c] = [share[0], 1 - share[0], -share[1], share[1] - 1]
            normal[c] = random.normal(size=3)
            normal[c] /= np.linalg.norm(normal[c])
            curvature[c] = 10.0 ** random.uniform(0, 4)
            beside[c] = random.uniform(1, 20) * (np.eye(3) - np.outer(normal[c], normal[c]))
            own = curvature[c] * np.outer(normal[c], normal[c]) + beside[c]
            for a in range(4):
                for b in range(4):
                    dense[ids[c, a], ids[c, b]] += lam[c, a] * lam[c, b] * own
        ell = EllMatrix.from_scipy(far, "cpu")
        matrix = pcg_alone.PairedMatrix()
        matrix.columns, matrix.blocks = rows.columns, rows.blocks
        matrix.far_columns, matrix.weights = ell.columns, ell.weights
        matrix.diagonal = array(diagonal.astype(np.float32), wp.float32)
        matrix.count = array(np.array([PAIRS], np.int32), wp.int32)
        matrix.ids, matrix.lam = array(ids, wp.vec4i), array(lam.astype(np.float32), wp.vec4)
        matrix.normal = array(normal.astype(np.float32), wp.vec3)
        matrix.curvature = array(curvature.astype(np.float32), wp.float32)
        matrix.beside = array(beside.astype(np.float32), wp.mat33)
        self.matrix, self.kept = matrix, (rows, ell)
        self.dense = dense.transpose(0, 2, 1, 3).reshape(3 * COUNT, 3 * COUNT)
        self.inverse = np.linalg.inv(dense[range(COUNT), range(COUNT)])
        self.gradient = random.normal(size=(COUNT, 3))

    def solve(self, at_most, tolerance, gradient=None):
        """The solution, the iterations it took, and the solver's scratch."""
        cg = pcg.ConjugateGradients.allocate(COUNT, "cpu")
        for scratch in (cg.residual, cg.preconditioned, cg.direction, cg.product):
            scratch.fill_(np.nan)
        found = array(np.full((COUNT, 3), np.nan, np.float32), wp.vec3)
        forces = array((self.gradient if gradient is None else gradient).astype(np.float32), wp.vec3)
        inverse = array(self.inverse.astype(np.float32), wp.mat33)
        pcg_alone.solve(cg, self.matrix, inverse, forces, found, at_most, tolerance)
        return found.numpy().astype(np.float64), at_most - int(cg.left.numpy()[0]), cg

    def norm_sq(self, residual):
        """<r, D^-1 r>"""
        return np.einsum("ia,iab,ib->", residual, self.inverse, residual)


@pytest.fixture(scope="module")
def system():
    wp.init()
    return System()


def test_the_dense_matrix_is_what_it_should_be(system):
    """Symmetric, positive definite, and the rows of inner forces blind to a common move."""
    assert np.abs(system.dense - system.dense.T).max() <= 1e-9 * np.abs(system.dense).max()
    assert np.linalg.eigvalsh(system.dense).min() > 0.1


def test_it_solves(system):
    found, taken, cg = system.solve(1000, 1e-6)
    expected = np.linalg.solve(system.dense, -system.gradient.ravel()).reshape(-1, 3)
    assert np.abs(found - expected).max() <= 1e-4 * np.abs(expected).max()
    assert 10 < taken < 400
    residual = -(system.dense @ found.ravel()).reshape(-1, 3) - system.gradient
    assert np.abs(cg.residual.numpy() - residual).max() <= 1e-3 * np.abs(system.gradient).max()
    assert cg.first.numpy()[0] == pytest.approx(system.norm_sq(system.gradient), rel=1e-5)


def test_unknowns_that_nothing_couples_are_solved_for_at_once(system):
    found, taken, _ = system.solve(1, 1e-9)
    assert taken == 1
    alone = np.setdiff1d(np.arange(CLOTH, COUNT), system.matrix.ids.numpy()[:PAIRS])
    assert len(alone) > 40
    exact = -system.gradient[alone] / system.matrix.diagonal.numpy()[alone, None]
    np.testing.assert_allclose(found[alone], exact, rtol=1e-5)


def test_one_iteration_is_one_of_steepest_descent(system):
    found, _, _ = system.solve(1, 1e-9)
    coupled = np.union1d(np.arange(CLOTH), system.matrix.ids.numpy()[:PAIRS])
    z = np.zeros((COUNT, 3))
    z[coupled] = -np.einsum("iab,ib->ia", system.inverse, system.gradient)[coupled]
    length = -(system.gradient * z).sum() / (z.ravel() @ system.dense @ z.ravel())
    assert np.abs(found - length * z)[coupled].max() <= 1e-4 * np.abs(z).max()


def test_a_looser_tolerance_takes_fewer_iterations_and_keeps_its_promise(system):
    found, taken, _ = system.solve(1000, 1e-2)
    _, more, _ = system.solve(1000, 1e-6)
    assert 1 <= taken < more
    residual = -(system.dense @ found.ravel()).reshape(-1, 3) - system.gradient
    assert system.norm_sq(residual) <= 1.01 * 1e-4 * system.norm_sq(system.gradient)


def test_no_force_no_move(system):
    found, taken, _ = system.solve(10, 1e-2, np.zeros((COUNT, 3)))
    assert taken == 0
    assert np.all(found == 0.0)
