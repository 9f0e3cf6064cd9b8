"""Fabric damping: gradient and Hessian of the step's potential."""

import numpy as np
import pytest
import reference_energies as reference
import warp as wp
from drape_states import compressed, crumpled, dense, rounded, stretched
from newton_product import newton_product
from scipy.spatial.transform import Rotation
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


def added(pair, x_start, x, v=None):
    """What damping adds in a step from x_start, where it goes at v m/s or is at rest, at x: the correction's gradient
    (N, 3) N and matrix (3N, 3N) N/m."""
    gradients, matrices = [], []
    for sim in pair:
        sim.use_time_step(DT)
        sim.state.x_start.assign(x_start.astype(np.float32))
        sim.state.v.assign((np.zeros_like(x) if v is None else v).astype(np.float32))
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
def test_gradient_and_matrix_are_those_of_a_convex_potential(pair, uv, rng, kind):
    """Against central differences; the cloth moves by millimetres, up to turning triangles over."""
    x_start = rounded(kind(uv, rng))
    x = rounded(x_start + 4e-3 * rng.standard_normal(x_start.shape))
    energy = reference.fabric_damping(pair[0].scene.garment, CLOTH, BETA / DT, x_start)
    gradient, matrix = added(pair, x_start, x)
    expected, hessian = reference.gradient(energy, x, STEP), reference.hessian(energy, x, 100 * STEP)
    assert np.abs(expected).max() > 1e-2
    np.testing.assert_allclose(gradient, expected, rtol=0, atol=1e-3 * np.abs(expected).max())
    np.testing.assert_allclose(matrix, hessian, rtol=0, atol=1e-3 * np.abs(hessian).max())
    assert np.linalg.eigvalsh(hessian).min() > -1e-6 * np.abs(hessian).max()


@pytest.mark.parametrize("kind", [stretched, compressed, crumpled])
def test_cloth_that_turns_is_damped_from_where_it_turns_to(pair, uv, rng, kind):
    """At 9 rad/s about a skew axis: gradient and matrix of the same potential, with each triangle turned along."""
    x_start = rounded(kind(uv, rng))
    omega = 9.0 * np.array([0.6, -0.48, 0.64])
    turns = Rotation.from_rotvec(DT * omega).as_matrix()
    x = rounded(x_start @ turns.T + 1e-3 * rng.standard_normal(x_start.shape))
    garment = pair[0].scene.garment
    energy = reference.fabric_damping(garment, CLOTH, BETA / DT, x_start, np.tile(turns, (len(garment.faces), 1, 1)))
    gradient, matrix = added(pair, x_start, x, np.cross(omega, x_start))
    expected, hessian = reference.gradient(energy, x, STEP), reference.hessian(energy, x, 100 * STEP)
    np.testing.assert_allclose(gradient, expected, rtol=0, atol=1e-3 * np.abs(expected).max())
    np.testing.assert_allclose(matrix, hessian, rtol=0, atol=1e-3 * np.abs(hessian).max())


@pytest.mark.parametrize("kind", [stretched, compressed, crumpled])
@pytest.mark.parametrize("speed", [0.5, 6.0, 60.0])
def test_turning_on_as_before_costs_nothing(pair, uv, rng, kind, speed):
    """However far it goes in a step. Bending's share is that of the mean curvature, which turns along: taken off."""
    x_start = rounded(kind(uv, rng))
    omega = speed * np.array([0.6, -0.48, 0.64])
    x = rounded(x_start @ Rotation.from_rotvec(DT * omega).as_matrix().T)
    gradient, _ = added(pair, x_start, x, np.cross(omega, x_start))
    rows, area = reference.hinge_laplacians(pair[0].scene.garment)
    bent = BETA / DT * CLOTH.k_bend * rows.T @ (rows / area[:, None] @ (x - x_start))
    stretching, _ = added(pair, x_start, rounded(1.01 * x_start))
    assert np.abs(stretching).max() > 1e-3
    assert np.abs(gradient - bent).max() < 5e-3 * np.abs(stretching).max()


def test_matrix_stands_still_while_the_cloth_buckles(pair, uv, rng):
    """Where the step ends has no say: taken there, the matrix follows what it is to hold, and there is no potential."""
    x_start = rounded(stretched(uv, rng))
    matrices = [added(pair, x_start, rounded(kind(uv, rng)))[1] for kind in (stretched, crumpled)]
    np.testing.assert_allclose(matrices[0], matrices[1], rtol=0, atol=2e-4 * np.abs(matrices[0]).max())


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


def test_turning_stretched_cloth_costs_nothing(pair, uv, rng):
    """Tension resists turning, the damping of the fabric does not: K omega x = 0. Bending's share is that of the mean
    curvature, which turns along: it is taken off."""
    x = rounded(stretched(uv, rng))
    omega = rng.standard_normal(3)
    turning = np.cross(omega / np.linalg.norm(omega), x - x.mean(0))
    _, matrix = added(pair, x, x)
    rows, area = reference.hinge_laplacians(pair[0].scene.garment)
    bending = BETA / DT * CLOTH.k_bend * np.kron(rows.T @ (rows / area[:, None]), np.eye(3))
    strained = np.abs(matrix @ (x - x.mean(0)).ravel()).max()
    assert np.abs((matrix - bending) @ turning.ravel()).max() < 1e-3 * strained
