"""Fabric damping: gradient and Hessian of the step's potential, of strains' changes since its start."""

import numpy as np
import pytest
import reference_energies as reference
import warp as wp
from drape_states import compressed, crumpled, dense, rounded, stretched
from newton_product import newton_product
from small_scenes import fabric, sheet, turn

from tryon_solver.scene import FabricDamping, Scene, StrainLimit
from tryon_solver.simulation import build
from tryon_solver.stepping.gradient import elastic_gradient
from tryon_solver.stepping.newton import linearise

CLOTH = fabric(k_warp=300.0, k_weft=180.0, k_shear=70.0, k_bend=3e-5, strain_limit=1.1)
BETA, DT, STEP, LIMIT = 4e-3, 1 / 75, 1e-6, 1200.0


@pytest.fixture(scope="module")
def pair():
    """The same sheet without and with damping."""
    garment, x = sheet(5, 5, 0.1, 0.1)
    return [
        build(Scene(garment, x, None, CLOTH, (StrainLimit(LIMIT), *more))) for more in ((), (FabricDamping(BETA),))
    ]


@pytest.fixture
def uv(pair):
    x = pair[0].scene.x_start
    return np.column_stack([x[:, 0], -x[:, 2]])


def added(pair, x_start, x):
    """What damping adds in a step from x_start, at x: the correction's gradient (N, 3) N and matrix (3N, 3N) N/m."""
    gradients, matrices = [], []
    for sim in pair:
        sim.use_time_step(DT)
        sim.state.x_start.assign(x_start.astype(np.float32))
        sim.state.x_hat.assign(x.astype(np.float32))
        for start_step in sim.stages.start_step:
            start_step(sim.state)
        sim.state.x.assign(x.astype(np.float32))
        gradient = wp.full(sim.all_count, wp.vec3(np.nan, np.nan, np.nan), dtype=wp.vec3, device="cpu")
        elastic_gradient(sim, sim.state.x, gradient, correcting=True)
        linearise(sim)
        gradients.append(gradient.numpy().astype(np.float64))
        matrices.append(dense(sim.all_count, lambda p, out, sim=sim: newton_product(sim, p, out)))
    return gradients[1] - gradients[0], matrices[1] - matrices[0]


@pytest.mark.parametrize("kind", [stretched, compressed, crumpled])
@pytest.mark.parametrize("far", [4e-3, 4e-4])
def test_gradient_is_that_of_the_potential(pair, uv, rng, kind, far):
    """Against central differences; the cloth moves by millimetres, up to turning triangles over."""
    x_start = rounded(kind(uv, rng))
    x = rounded(x_start + far * rng.standard_normal(x_start.shape))
    energy = reference.fabric_damping(pair[0].scene.garment, CLOTH, BETA / DT, x_start)
    gradient, matrix = added(pair, x_start, x)
    expected = reference.gradient(energy, x, STEP)
    assert np.abs(expected).max() > 1e-2
    np.testing.assert_allclose(gradient, expected, rtol=0, atol=1e-3 * np.abs(expected).max())
    assert np.linalg.eigvalsh(matrix).min() > -1e-5 * np.abs(matrix).max()


@pytest.mark.parametrize("kind", [stretched, compressed, crumpled])
@pytest.mark.parametrize(("far", "off"), [(0.0, 1e-3), (2e-5, 1e-2)])
def test_matrix_is_the_potentials_hessian_where_little_has_changed(pair, uv, rng, kind, far, off):
    """And semidefinite by itself: at the step's start the potential is convex."""
    x_start = rounded(kind(uv, rng))
    x = rounded(x_start + far * rng.standard_normal(x_start.shape))
    energy = reference.fabric_damping(pair[0].scene.garment, CLOTH, BETA / DT, x_start)
    matrix, hessian = added(pair, x_start, x)[1], reference.hessian(energy, x, 20 * STEP)
    np.testing.assert_allclose(matrix, hessian, rtol=0, atol=off * np.abs(hessian).max())
    assert np.linalg.eigvalsh(matrix).min() > -1e-5 * np.abs(matrix).max()


def test_matrix_holds_stretching_cloth_against_turning_as_its_tension_does(pair, uv):
    """Flat cloth that becomes longer both ways: the Hessian as a whole, out of the plane, too."""
    x_start = rounded(np.column_stack([uv, 0 * uv[:, 0]]))
    x = rounded(1.04 * x_start)
    energy = reference.fabric_damping(pair[0].scene.garment, CLOTH, BETA / DT, x_start)
    matrix, hessian = added(pair, x_start, x)[1], reference.hessian(energy, x, 20 * STEP)
    out = np.arange(2, len(matrix), 3)
    bending = BETA / DT * bending_matrix(pair)[np.ix_(out, out)]
    tension = hessian[np.ix_(out, out)] - bending
    assert np.abs(tension).max() > 0.01 * np.abs(hessian).max()
    np.testing.assert_allclose(matrix[np.ix_(out, out)] - bending, tension, rtol=0, atol=0.02 * np.abs(tension).max())


def bending_matrix(pair):
    rows, area = reference.hinge_laplacians(pair[0].scene.garment)
    return CLOTH.k_bend * np.kron(rows.T @ (rows / area[:, None]), np.eye(3))


def test_matrix_is_the_fabrics_hessian_where_it_is_unstrained(pair, uv):
    """Flat and turned in space: beta/dt times the Hessian of membrane and bending, which the difference of tension and
    compression has no part in there; nothing of the strain limit."""
    x = rounded(np.column_stack([uv, 0 * uv[:, 0]]) @ turn((25, -40, 70)).T)
    garment = pair[0].scene.garment
    elastic = sum(
        reference.hessian(energy, x, 20 * STEP)
        for energy in (reference.membrane(garment, CLOTH), reference.bending(garment, CLOTH.k_bend))
    )
    _, matrix = added(pair, x, x)
    np.testing.assert_allclose(matrix, BETA / DT * elastic, rtol=0, atol=2e-3 * np.abs(elastic).max())


@pytest.mark.parametrize("angle", [1.0, 20.0, 170.0])
@pytest.mark.parametrize("kind", [stretched, compressed, crumpled])
def test_turning_costs_nothing_however_far(pair, uv, rng, kind, angle):
    """Bending's share is that of the mean curvature, which turns along: it is taken off."""
    x_start = rounded(kind(uv, rng))
    x = rounded((x_start - x_start.mean(0)) @ turn((angle, -0.6 * angle, 0.3 * angle)).T + x_start.mean(0))
    gradient, _ = added(pair, x_start, x)
    bent = BETA / DT * (bending_matrix(pair) @ (x - x_start).ravel()).reshape(x.shape)
    stretching, _ = added(pair, x_start, rounded(1.01 * x_start))
    assert np.abs(stretching).max() > 1e-3
    assert np.abs(gradient - bent).max() < 5e-3 * np.abs(stretching).max()
