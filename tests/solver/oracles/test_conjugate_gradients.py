"""Conjugate gradients against a direct solve, on every device; the loop's end is decided there."""

import numpy as np
import pytest
import scipy.sparse as sp
import warp as wp

from tryon_solver.linalg import pcg
from tryon_solver.linalg.ell import EllMatrix, multiply
from tryon_solver.linalg.vectors import dot

COUNT = 700


@pytest.fixture(params=["cpu", pytest.param("cuda:0", marks=pytest.mark.gpu)])
def device(request):
    wp.init()
    if request.param != "cpu" and not wp.is_cuda_available():
        pytest.skip("no CUDA device on this machine")
    return request.param


@pytest.fixture
def system(device):
    """A positive definite matrix, as scipy's and as the device's, its inverse diagonal, a right-hand side."""
    random = np.random.default_rng(4)
    factor = sp.random(COUNT, COUNT, density=3 / COUNT, random_state=5)
    matrix = sp.csr_matrix(factor @ factor.T + sp.diags(random.uniform(0.2, 20.0, COUNT)))
    inverse = np.einsum("i,jk->ijk", 1 / matrix.diagonal(), np.eye(3))
    gradient = random.normal(size=(COUNT, 3))
    return (
        matrix,
        EllMatrix.from_scipy(matrix, device),
        wp.array(inverse.astype(np.float32), dtype=wp.mat33, device=device),
        gradient,
    )


def solve(system, device, at_most, tolerance, gradient=None):
    _, rows, blocks, own = system
    gradient = own if gradient is None else gradient
    cg = pcg.ConjugateGradients.allocate(COUNT, device)
    poisoned = wp.array(np.full((COUNT, 3), np.nan, np.float32), dtype=wp.vec3, device=device)
    forces = wp.array(gradient.astype(np.float32), dtype=wp.vec3, device=device)
    pcg.solve(cg, lambda p, out: multiply(rows, p, out), blocks, forces, poisoned, at_most, tolerance)
    return poisoned.numpy(), at_most - int(cg.left.numpy()[0])


def test_it_solves(system, device):
    matrix, _, _, gradient = system
    found, taken = solve(system, device, 500, 1e-6)
    expected = sp.linalg.spsolve(matrix.tocsc(), -gradient)
    assert np.abs(found - expected).max() <= 2e-5 * np.abs(expected).max()
    assert 5 < taken < 200


def test_a_looser_tolerance_takes_fewer_iterations_and_keeps_its_promise(system, device):
    matrix, _, _, gradient = system
    found, taken = solve(system, device, 500, 1e-2)
    _, more = solve(system, device, 500, 1e-6)
    assert 1 <= taken < more

    def norm(residual):
        return np.sqrt((residual**2 / matrix.diagonal()[:, None]).sum())

    assert norm(matrix @ found + gradient) <= 1.01e-2 * norm(gradient)


def test_it_stops_when_the_budget_is_spent(system, device):
    matrix, _, _, gradient = system
    first, taken = solve(system, device, 1, 1e-9)
    assert taken == 1
    # one step of steepest descent from zero, with D^-1
    z = -gradient / matrix.diagonal()[:, None]
    length = -(gradient * z).sum() / (z * (matrix @ z)).sum()
    assert np.abs(first - length * z).max() <= 1e-5 * np.abs(z).max()
    assert solve(system, device, 3, 1e-9)[1] == 3


def test_no_force_no_move(system, device):
    found, taken = solve(system, device, 10, 1e-2, np.zeros((COUNT, 3)))
    assert taken == 0
    assert np.all(found == 0.0)


def test_dot(device):
    random = np.random.default_rng(6)
    for count in (1, 31, 1024, 5003):
        a, b = random.normal(size=(2, count, 3)).astype(np.float32)
        out = wp.array([np.nan], dtype=wp.float32, device=device)
        dot(wp.array(a, dtype=wp.vec3, device=device), wp.array(b, dtype=wp.vec3, device=device), out)
        exact = (a.astype(np.float64) * b).sum()
        assert abs(out.numpy()[0] - exact) <= 1e-5 * np.abs(a.astype(np.float64) * b).sum()
