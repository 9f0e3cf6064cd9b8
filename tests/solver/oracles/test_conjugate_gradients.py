"""Conjugate gradients, by one thread and by many, against a direct solve of the same matrix.

The matrix has all parts that the correction's has: rows of blocks and of weights that sum to zero, a diagonal, and
what holds single unknowns, and contact pairs, some of them of unknowns that have no rows, as a body's vertices.
"""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
import warp as wp

from tryon_solver.contact.pooled import add_pairs
from tryon_solver.geometry.connectivity import Connectivity
from tryon_solver.linalg import blocks, pcg, pcg_together
from tryon_solver.linalg.aggregates import Aggregates, most_of_each_row
from tryon_solver.linalg.as_one import move_as_one
from tryon_solver.linalg.block_ell import BlockRows
from tryon_solver.linalg.ell import EllMatrix
from tryon_solver.linalg.order_free import STIFF_QUANTA
from tryon_solver.linalg.paired_matrix import PairedMatrix
from tryon_solver.linalg.turning import AsOne
from tryon_solver.linalg.vectors import PARTS, dot, find_largest

CLOTH, COUNT, PAIRS, ROOM = 120, 200, 40, 64
POOLED = 3  # vertices to an aggregate
TOUCHED = range(CLOTH, CLOTH + 30)  # of those without rows


class System:
    """The matrix as the kernel takes it and as a dense one (3 COUNT, 3 COUNT), its inverse blocks, a gradient. Pairs
    resist moves across them in so many `directions`; the share `holding` of the unknowns is held."""

    def __init__(self, device, solve, repeatable=False, directions=2, holding=0.0):
        self.device, self.solver, self.repeatable = device, solve, repeatable
        random = self.random = np.random.default_rng(11)
        dense = np.zeros((COUNT, COUNT, 3, 3))
        faces = np.array([[i, i + 1, i + 2] for i in range(CLOTH - 2)])
        rows = BlockRows.build(*Connectivity(faces, CLOTH).pairs, device)
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
        apart = np.random.default_rng(12)
        held = 10.0 * apart.normal(size=(COUNT, 3)) * (apart.uniform(size=(COUNT, 1)) < holding)
        dense[range(COUNT), range(COUNT)] += held[:, :, None] * held[:, None, :]
        ids = np.zeros((ROOM, 4), np.int32)
        lam, normal = np.full((ROOM, 4), np.nan), np.full((ROOM, 3), np.nan)
        curvature, beside = np.full(ROOM, np.nan), np.full((ROOM, 3, 3), np.nan)
        for c in range(PAIRS):
            ids[c] = [*random.choice(CLOTH, 2, replace=False), *random.choice(TOUCHED, 2, replace=False)]
            share = random.uniform(size=2)
            lam[c] = [share[0], 1 - share[0], -share[1], share[1] - 1]
            normal[c] = random.normal(size=3) * (np.arange(3) < directions)
            normal[c] /= np.linalg.norm(normal[c])
            curvature[c] = 10.0 ** random.uniform(0, 4)
            beside[c] = random.uniform(1, 20) * (np.eye(3) - np.outer(normal[c], normal[c]))
            own = curvature[c] * np.outer(normal[c], normal[c]) + beside[c]
            for a in range(4):
                for b in range(4):
                    dense[ids[c, a], ids[c, b]] += lam[c, a] * lam[c, b] * own
        ell = EllMatrix.from_scipy(far - np.diag(np.diag(far)), device)
        matrix = PairedMatrix()
        matrix.columns, matrix.blocks = rows.columns, rows.blocks
        matrix.far_columns, matrix.weights = ell.columns, ell.weights
        matrix.diagonal = self.array(diagonal.astype(np.float32), wp.float32)
        matrix.held = self.array(held.astype(np.float32), wp.vec3)
        matrix.count = self.array(np.array([PAIRS], np.int32), wp.int32)
        matrix.ids, matrix.lam = self.array(ids, wp.vec4i), self.array(lam.astype(np.float32), wp.vec4)
        matrix.normal = self.array(normal.astype(np.float32), wp.vec3)
        matrix.curvature = self.array(curvature.astype(np.float32), wp.float32)
        matrix.beside = self.array(beside.astype(np.float32), wp.mat33)
        self.matrix, self.kept = matrix, (rows, ell)
        self.dense = dense.transpose(0, 2, 1, 3).reshape(3 * COUNT, 3 * COUNT)
        self.inverse = np.linalg.inv(dense[range(COUNT), range(COUNT)])
        self.gradient = random.normal(size=(COUNT, 3))
        self.x = 0.1 * random.normal(size=(COUNT, 3))
        self.of = random.permutation(CLOTH // POOLED)[np.arange(CLOTH) // POOLED]
        cells = sp.csr_matrix((np.ones(CLOTH), (np.arange(CLOTH), self.of)))
        self.alone, self.aggregates = (self.explicit(Aggregates.build(cells, device)) for _ in range(2))
        self.aggregates.sums.fill_(77)
        self.aggregates.take(matrix, add_pairs)
        if solve is not pcg.solve:
            self.aggregates.inverse.assign(np.linalg.inv(self.pooled()[1]).astype(np.float32))

    def explicit(self, aggregates):
        """With room for an inverse on a processor, too, where many threads are to take it."""
        if self.solver is pcg.solve:
            return aggregates
        size = 3 * aggregates.count
        inverse = wp.zeros((size, size), dtype=wp.float32, device=self.device)
        return replace(aggregates, inverting=replace(aggregates.inverting, inverse=inverse))

    def pooled(self):
        """(3 COUNT, 3 M): one for each vertex and its aggregate; and the sum of the matrix over them, (3 M, 3 M)."""
        cells = np.zeros((COUNT, CLOTH // POOLED))
        cells[np.arange(CLOTH), self.of] = 1.0
        up = np.kron(cells, np.eye(3))
        return up, up.T @ self.dense @ up

    def array(self, values, dtype):
        return wp.array(np.asarray(values), dtype=dtype, device=self.device)

    def solve(self, at_most, tolerance, gradient=None, aggregates=None):
        """The solution, the iterations it took, and the solver's scratch; by blocks alone unless aggregates are given:
        those that have taken no matrix add nothing."""
        aggregates = aggregates or self.alone
        aggregates.pooled.fill_(np.nan)
        aggregates.moves.fill_(np.nan)
        aggregates.common[: aggregates.count].fill_(np.nan)
        cg = pcg.ConjugateGradients.allocate(COUNT, CLOTH, self.matrix.blocks.shape[1], self.device, self.repeatable)
        for scratch in (
            cg.residual,
            cg.preconditioned,
            cg.direction,
            cg.both,
            cg.spread,
            cg.product,
            cg.pulled,
            cg.parts,
            cg.squares,
            cg.first,
        ):
            scratch.fill_(np.nan)
        cg.pulled_whole.fill_(77)
        cg.sums.fill_(77)
        found = self.array(np.full((COUNT, 3), np.nan, np.float32), wp.vec3)
        forces = self.array((self.gradient if gradient is None else gradient).astype(np.float32), wp.vec3)
        inverse = self.array(self.inverse.astype(np.float32), wp.mat33)
        cg.state.fill_(77)
        self.solver(cg, self.matrix, inverse, forces, found, at_most, tolerance, aggregates)
        return found.numpy().astype(np.float64), cg.taken(), cg

    def norm_sq(self, residual):
        """<r, D^-1 r>"""
        return np.einsum("ia,iab,ib->", residual, self.inverse, residual)


def solve_together(cg, matrix, inverse, gradient, out, at_most, tolerance, aggregates):
    """By many threads wherever it is."""
    vectors = cg.residual, cg.direction, cg.both, cg.spread, cg.product, cg.pulled, cg.pulled_whole
    kept = cg.coupled, cg.sums, cg.parts, cg.first, cg.squares, cg.state
    pcg_together.solve(matrix, inverse, aggregates, gradient, out, *vectors, *kept, at_most, tolerance)


ON_GPU = pytest.mark.gpu


@pytest.fixture(
    scope="module",
    params=[
        "alone",
        "together",
        "together, repeatable",
        pytest.param("cuda:0", marks=ON_GPU),
        pytest.param("cuda:0, repeatable", marks=ON_GPU),
    ],
)
def system(request):
    """By one thread and by many on the processor, where these are one after the other; by many on the GPU."""
    wp.init()
    where, repeatable = request.param.partition(",")[0], request.param.endswith("repeatable")
    if where != "cuda:0":
        return System("cpu", pcg.solve if where == "alone" else solve_together, repeatable)
    if not wp.is_cuda_available():
        pytest.skip("no CUDA device on this machine")
    return System("cuda:0", pcg.solve, repeatable)


@pytest.mark.parametrize("iterations", [0, 1, 5])
def test_no_move_or_turn_of_all_makes_it_better_after_the_best_ones(system, iterations):
    """Stiff pairs across leave nothing of the total along them: the slope along and around each axis is gone."""
    found, _, cg = system.solve(iterations, 0.0)
    if iterations == 0:
        cg.residual.assign(-system.gradient.astype(np.float32))
    moving, out = slice(0, 3 * CLOTH), system.array(found.astype(np.float32), wp.vec3)
    scratch = AsOne.allocate(system.device)
    for each in (scratch.of_cloth, scratch.of_pairs, scratch.found):
        each.fill_(np.nan)
    x = system.array(system.x.astype(np.float32), wp.vec3)
    move_as_one(cg, system.matrix, x, CLOTH, True, scratch, out)
    moved = out.numpy().astype(np.float64)
    arms = system.x[:CLOTH] - system.x[0]

    def slopes(p):
        residual = (-system.gradient.ravel() - system.dense @ p.ravel())[moving].reshape(-1, 3)
        return residual.sum(0), np.cross(arms, residual).sum(0)

    for before, after in zip(slopes(found), slopes(moved)):
        assert np.linalg.norm(before) > 0.1
        assert np.linalg.norm(after) < 1e-3 * np.linalg.norm(before)
    by = moved[:CLOTH] - found[:CLOTH]
    turns = np.cross(np.eye(3)[None], arms[:, None]).transpose(0, 2, 1).reshape(-1, 3)
    turn = np.linalg.lstsq(turns, (by - by[0]).ravel())[0]
    assert np.linalg.norm(turn) > 1e-3, "some of it is a turn"
    np.testing.assert_allclose(by, by[0] + np.cross(turn, arms), atol=1e-5)
    np.testing.assert_array_equal(moved[CLOTH:], found[CLOTH:])


def test_cloth_that_contact_holds_in_every_direction_is_not_turned(system):
    """The best move is made all the same."""
    held = System(system.device, system.solver, system.repeatable, directions=3)
    found, _, cg = held.solve(1, 0.0)
    out, x = (held.array(values.astype(np.float32), wp.vec3) for values in (found, held.x))
    move_as_one(cg, held.matrix, x, CLOTH, True, AsOne.allocate(held.device), out)
    by = (out.numpy() - found)[:CLOTH]
    assert np.abs(by[0]).max() > 1e-4
    np.testing.assert_allclose(by, np.tile(by[0], (CLOTH, 1)), atol=1e-6)
    left = (-held.gradient.ravel() - held.dense @ out.numpy().astype(np.float64).ravel()).reshape(-1, 3)[:CLOTH].sum(0)
    before = (-held.gradient.ravel() - held.dense @ found.ravel()).reshape(-1, 3)[:CLOTH].sum(0)
    assert np.linalg.norm(left) < 1e-3 * np.linalg.norm(before)


def test_cloth_in_a_line_is_not_turned_about_it(system):
    """What resists nothing at all is left as it is, and so is what a turn about another axis would do."""
    found, _, cg = system.solve(3, 0.0)
    line = np.outer(np.arange(COUNT), [0.3, 0.1, -0.2]).astype(np.float32)
    out = system.array(found.astype(np.float32), wp.vec3)
    scratch = AsOne.allocate(system.device)
    move_as_one(cg, system.matrix, system.array(line, wp.vec3), CLOTH, True, scratch, out)
    by = out.numpy()[:CLOTH] - found[:CLOTH]
    assert np.isfinite(by).all()
    np.testing.assert_allclose(by, np.tile(by[0], (CLOTH, 1)), atol=1e-5)


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


def test_it_solves_where_single_unknowns_are_held(system):
    """Each in one direction: of those with rows, of those in pairs, and of those that nothing couples."""
    held = System(system.device, system.solver, system.repeatable, holding=0.3)
    assert np.abs(held.dense - system.dense).max() > 100.0
    found, _, _ = held.solve(1000, 1e-6)
    expected = np.linalg.solve(held.dense, -held.gradient.ravel()).reshape(-1, 3)
    assert np.abs(found - expected).max() <= 1e-4 * np.abs(expected).max()
    free, _, _ = system.solve(1000, 1e-6)
    assert np.abs(found - free).max() > 0.1 * np.abs(expected).max()


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


def test_a_vertex_goes_to_what_it_has_most_of_and_of_equals_to_the_first():
    matrix = sp.random(500, 9, 0.3, random_state=3, format="csr")
    matrix.data = np.ceil(4 * matrix.data)  # many are equal, and some rows are empty
    most = matrix.toarray().argmax(axis=1)
    assert np.bincount(np.diff(matrix.indptr))[0] > 0
    shuffled = sp.csr_matrix((matrix.data.copy(), matrix.indices.copy(), matrix.indptr))
    for begin, end in zip(shuffled.indptr[:-1], shuffled.indptr[1:]):
        shuffled.data[begin:end] = shuffled.data[begin:end][::-1].copy()
        shuffled.indices[begin:end] = shuffled.indices[begin:end][::-1].copy()
    for one in (matrix, shuffled):
        assert np.array_equal(most_of_each_row(one), most)


def test_the_coarse_level_is_of_the_matrix_summed_over_aggregates(system):
    _, total = system.pooled()
    size = len(total)
    assert size == 3 * system.aggregates.count == 120
    seen = system.aggregates.sums.numpy()[:size, :size] / STIFF_QUANTA
    upper = np.arange(size)[:, None] // 3 <= np.arange(size)[None] // 3
    assert np.abs(seen - total)[upper].max() <= 1e-6 * np.abs(total).max()
    assert np.all(seen[~upper] == 0.0)


def test_the_coarse_level_is_inverted(system):
    """On a GPU; on a processor it is factored, as what it finds shows."""
    _, total = system.pooled()
    size, expected = len(total), np.linalg.inv(total)
    if system.device == "cpu":
        upper = np.triu(system.aggregates.factor.numpy())
        pivots = 1.0 / np.diagonal(upper).copy()
        np.fill_diagonal(upper, pivots)
        assert np.abs(upper.T @ upper - total).max() <= 1e-6 * np.abs(total).max()
        return
    inverse = system.aggregates.inverse.numpy()
    assert np.abs(inverse[:size, :size] - expected).max() <= 1e-6 * np.abs(expected).max()
    np.testing.assert_array_equal(inverse, inverse.T)
    assert np.all(inverse[size:] == 0.0)
    assert np.all(inverse[:, size:] == 0.0)


def test_with_a_coarse_level_one_iteration_goes_along_both(system):
    found, _, _ = system.solve(1, 1e-9, aggregates=system.aggregates)
    up, total = system.pooled()
    coupled = np.union1d(np.arange(CLOTH), system.matrix.ids.numpy()[:PAIRS])
    z = np.zeros((COUNT, 3))
    z[coupled] = -np.einsum("iab,ib->ia", system.inverse, system.gradient)[coupled]
    z -= (up @ np.linalg.inv(total) @ up.T @ system.gradient.ravel()).reshape(-1, 3)
    length = -(system.gradient * z)[coupled].sum() / (z.ravel() @ system.dense @ z.ravel())
    assert np.abs(found - length * z)[coupled].max() <= 1e-4 * np.abs(z).max()


def test_with_a_coarse_level_it_solves_and_what_is_common_to_a_region_sooner(system):
    """A force that gives each aggregate a move of its own, and nothing else."""
    found, _, _ = system.solve(1000, 1e-6, aggregates=system.aggregates)
    expected = np.linalg.solve(system.dense, -system.gradient.ravel()).reshape(-1, 3)
    assert np.abs(found - expected).max() <= 1e-4 * np.abs(expected).max()
    up, total = system.pooled()
    moves = np.sin(np.arange(len(total)) / 9.0)
    force = -(system.dense @ (up @ moves)).reshape(-1, 3)
    left = []
    for aggregates in (system.alone, system.aggregates):
        off = system.solve(6, 1e-9, force, aggregates)[0].ravel() - up @ moves
        left.append(off @ system.dense @ off)
    assert 0.0 < left[1] < 0.5 * left[0]


def test_unknowns_that_nothing_answers_are_left_alone(system):
    """An aggregate without a matrix of its own, as of cloth without mass, takes no part."""
    empty = System(system.device, system.solver, system.repeatable)
    empty.matrix.blocks.zero_()
    empty.matrix.weights.zero_()
    empty.matrix.held.zero_()
    empty.matrix.diagonal.zero_()
    empty.matrix.count.zero_()
    empty.aggregates.take(empty.matrix, add_pairs)
    if system.device == "cpu":
        assert np.all(np.triu(empty.aggregates.factor.numpy()) == 0.0)
    else:
        assert np.all(empty.aggregates.inverse.numpy() == 0.0)


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


def test_it_stops_when_the_budget_is_spent(system):
    for at_most in (1, 2, 3, 7):
        assert system.solve(at_most, 1e-9)[1] == at_most


def test_more_unknowns_than_threads(system, monkeypatch):
    """Each thread takes several; what is found is the same but for the order of sums."""
    found, taken, _ = system.solve(60, 1e-4)
    monkeypatch.setattr(blocks, "MOST_THREADS", 128)
    again, as_many, _ = system.solve(60, 1e-4)
    assert abs(taken - as_many) <= 1
    assert np.abs(found - again).max() <= 1e-3 * np.abs(found).max()


def test_dot_and_largest(system):
    random = np.random.default_rng(6)
    for count in (1, 31, 1024, 5003):
        a, b = random.normal(size=(2, count, 3)).astype(np.float32)
        out = system.array([np.nan], wp.float32)
        parts = system.array(np.full(PARTS, np.nan), wp.float32)
        dot(system.array(a, wp.vec3), system.array(b, wp.vec3), out, parts)
        exact = (a.astype(np.float64) * b).sum()
        assert abs(out.numpy()[0] - exact) <= 1e-5 * np.abs(a.astype(np.float64) * b).sum()
        out.fill_(np.nan)
        find_largest(system.array(a, wp.vec3), out)
        assert out.numpy()[0] == pytest.approx(np.linalg.norm(a, axis=1).max(), rel=1e-6)
