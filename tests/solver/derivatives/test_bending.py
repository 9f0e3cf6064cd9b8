"""Isometric bending: an exactly quadratic energy whose matrix, gradient and invariances are held to closed forms."""

import numpy as np
import pytest
import reference_energies as reference
import warp as wp
from drape_states import crumpled, rounded
from small_scenes import device_vectors, fabric, sheet, turn

from tryon_solver.scene import Scene
from tryon_solver.simulation import build

K_BEND = 3e-5


@pytest.fixture(scope="module")
def scene():
    garment, x = sheet(6, 5, 0.1, 0.08)
    return Scene(garment, x, None, fabric(k_bend=K_BEND), ())


@pytest.fixture(scope="module")
def bending(scene):
    return next(c for c in build(scene).plan.contributions if c.name == "bending")


@pytest.fixture
def uv(scene):
    return np.column_stack([scene.x_start[:, 0], -scene.x_start[:, 2]])


def solver_gradient(term, x):
    out = wp.zeros(len(x), dtype=wp.vec3, device="cpu")
    term.add_gradient(device_vectors(x), out)
    return out.numpy().astype(np.float64)


def test_matrix_is_built_from_the_edges_laplacians(scene, bending):
    """Q = sum_e c/(A0 + A1) L_e L_e^T with one c for all edges; L_e derived from hat functions, not from cotangents."""
    rows, area = reference.hinge_laplacians(scene.garment)
    expected = K_BEND * np.einsum("h,hi,hj->ij", 1 / area, rows, rows)
    found = bending.stiffness.matrix.matrix().toarray()
    factor = (found * expected).sum() / (expected**2).sum()
    assert factor > 0.1
    np.testing.assert_allclose(found, factor * expected, rtol=0, atol=1e-9 * np.abs(found).max())


def test_gradient_is_the_energys(bending, uv, rng):
    x = rounded(crumpled(uv, rng))
    matrix = bending.stiffness.matrix.matrix().toarray()

    def energy(positions):
        return 0.5 * np.einsum("...ia,ij,...ja->...", positions, matrix, positions)

    assert bending.energy(device_vectors(x)) == pytest.approx(energy(x), rel=1e-9)
    expected = reference.gradient(energy, x, 1e-4)
    largest = np.abs(expected).max()
    assert largest > 1e-4
    np.testing.assert_allclose(solver_gradient(bending, x), expected, rtol=0, atol=1e-5 * largest)


def test_matrix_is_semidefinite_and_is_the_hessian(bending):
    assert bending.stiffness.exact
    matrix = bending.stiffness.matrix.matrix().toarray()
    np.testing.assert_allclose(matrix, matrix.T, rtol=0, atol=1e-12 * np.abs(matrix).max())
    values = np.linalg.eigvalsh(matrix)
    assert values.min() > -1e-10 * values.max()
    assert values.max() > K_BEND


def test_flat_panel_has_no_bending_wherever_it_lies(bending, uv):
    """Flat pieces, stretched in their plane or not, are in the null space: 1, u and v."""
    matrix = bending.stiffness.matrix.matrix().toarray()
    x = np.column_stack([1.3 * uv[:, 0] + 0.2 * uv[:, 1], 0.8 * uv[:, 1], np.zeros(len(uv))]) @ turn((40, 15, -80)).T
    size = 0.5 * np.abs(matrix).max() * (x**2).sum()
    assert abs(0.5 * np.einsum("ia,ij,ja->", x, matrix, x)) < 1e-12 * size
    # on the device positions are rounded to 2^-24 of 4 m
    shifted = rounded(x + np.array([2.0, 1.0, -3.0]))
    assert np.abs(solver_gradient(bending, shifted)).max() < 4 * 2.4e-7 * np.abs(matrix).sum(axis=1).max()


def test_rigid_motion_turns_the_gradient(bending, uv, rng):
    x = rounded(crumpled(uv, rng))
    still = solver_gradient(bending, x)
    r = turn((10, 130, 55))
    found = solver_gradient(bending, rounded(x @ r.T + [0.5, -0.3, 0.4]))
    largest = np.abs(still).max()
    assert largest > 1e-4
    np.testing.assert_allclose(found, still @ r.T, rtol=0, atol=1e-4 * largest)
