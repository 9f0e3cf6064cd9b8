"""The whole incremental potential without contact: inertia, elasticity, air drag, stitches and the skin's hold.

    E(x) = 1/(2 dt^2) |x - x_hat|_M^2 + Psi(x) + c A/(2 dt) |x - x_start|^2 + k/2 |x_a - x_b - share d|^2
         + sum_j k e^2 (sqrt(1 + |c_j - s_j|^2/e^2) - 1)
"""

import numpy as np
import pytest
import reference_energies as reference
import warp as wp
from drape_states import crumpled, dense, rounded, stretched
from newton_product import newton_product
from small_scenes import STILL, fabric, icosphere, rigid_body, sheet

from tryon_solver.scene import AirDrag, Attached, BodyContact, Scene, Sewing, StrainLimit
from tryon_solver.settings import Settings
from tryon_solver.simulation import build
from tryon_solver.stepping.gradient import elastic_gradient, system_product
from tryon_solver.stepping.move_body import limit_return
from tryon_solver.stepping.newton import linearise

CLOTH = fabric(k_warp=300.0, k_weft=180.0, k_shear=70.0, k_bend=3e-5, strain_limit=1.1)
LIMIT, DRAG, STITCH, ATTACHED = 1200.0, 7.0, 150.0, 5.0
PATCH, ONTO = np.array([6, 18], np.int32), np.array([[10, 11, 15], [3, 8, 9]], np.int32)
SHARES = np.array([[0.2, 0.5, 0.3], [0.6, -0.1, 0.5]])
STITCHES = np.array([[0, 24], [4, 20], [2, 12]], np.int32)
SHARE = 0.6
DT = 1 / 75
STEP = 1e-6


@pytest.fixture(scope="module")
def sim():
    garment, x = sheet(5, 5, 0.1, 0.1)
    vertices, faces = icosphere(0.04, 0)
    effects = (BodyContact(), StrainLimit(LIMIT), AirDrag(DRAG), Sewing(STITCHES, STITCH))
    effects = (*effects, Attached(PATCH, ONTO, SHARES, ATTACHED))
    scene = Scene(garment, x, rigid_body(vertices - np.array([0, 0.1, 0]), faces), CLOTH, effects)
    sim = build(scene, Settings(skin_stiffness=150.0), "cpu", STILL)
    sim.use_time_step(DT)
    sewing = next(c for c in sim.plan.contributions if c.name == "sewing")
    sewing.values["share"].fill_(SHARE)
    return sim


@pytest.fixture
def state(sim, rng):
    """Positions that the potential refers to, each a few millimetres from where the sheet and the surface are."""
    n = sim.cloth_count
    x = sim.scene.x_start
    everyone = np.vstack([x, sim.scene.body.rest_vertices])
    named = {
        "x_hat": rounded(x + 4e-3 * rng.standard_normal((n, 3))),
        "x_start": rounded(everyone + 4e-3 * rng.standard_normal((sim.all_count, 3))),
        "skin": rounded(sim.scene.body.rest_vertices),
    }
    for name, values in named.items():
        getattr(sim.state, name).assign(values.astype(np.float32))
    return named


@pytest.fixture
def uv(sim):
    return np.column_stack([sim.scene.x_start[:, 0], -sim.scene.x_start[:, 2]])


def cloth_energies(sim, state):
    """The potential's parts over the cloth, by name; x (..., N, 3). Projective dynamics leaves the strain limit out."""
    garment = sim.scene.garment
    bending = next(c for c in sim.plan.contributions if c.name == "bending").stiffness.matrix.matrix().toarray()
    a, b = STITCHES.T
    apart = (sim.scene.x_start[a] - sim.scene.x_start[b]).astype(np.float32).astype(np.float64)
    start = state["x_start"][: sim.cloth_count]

    def over(x):
        return x[..., PATCH, :] - (SHARES[:, :, None] * x[..., ONTO, :]).sum(-2)

    return {
        "inertia": lambda x: 0.5 / DT**2 * (sim.mass[:, None] * (x - state["x_hat"]) ** 2).sum((-1, -2)),
        "membrane": reference.membrane(garment, CLOTH),
        "strain limit": reference.strain_limit(garment, LIMIT, CLOTH.strain_limit),
        "bending": lambda x: 0.5 * np.einsum("...ia,ij,...ja->...", x, bending, x),
        "drag": lambda x: 0.5 * DRAG / DT * (sim.area[:, None] * (x - start) ** 2).sum((-1, -2)),
        "attached": lambda x: 0.5 * ATTACHED * (over(x) ** 2).sum((-1, -2)),
        "sewing": lambda x: 0.5 * STITCH * ((x[..., a, :] - x[..., b, :] - SHARE * apart) ** 2).sum((-1, -2)),
    }


def skin_energy(sim, state):
    k, e = sim.settings.skin_stiffness, sim.state.hold.numpy().astype(np.float64) / sim.settings.skin_stiffness
    return lambda c: (k * e**2 * (np.sqrt(1 + ((c - state["skin"]) ** 2).sum(-1) / e**2) - 1)).sum(-1)


def solver_gradient(sim, x, correcting=True):
    sim.state.x.assign(x.astype(np.float32))
    out = wp.full(sim.all_count, wp.vec3(np.nan, np.nan, np.nan), dtype=wp.vec3, device="cpu")
    elastic_gradient(sim, sim.state.x, out, correcting=correcting)
    return out.numpy().astype(np.float64)


@pytest.mark.parametrize("kind", [stretched, crumpled])
def test_gradient_of_the_cloth_is_the_sum_of_its_energies(sim, state, uv, rng, kind):
    n = sim.cloth_count
    x = rounded(np.vstack([kind(uv, rng), state["skin"]]))
    parts = {k: reference.gradient(e, x[:n], STEP) for k, e in cloth_energies(sim, state).items()}
    for name, part in parts.items():
        assert np.abs(part).max() > 1e-5, name
    found = solver_gradient(sim, x)[:n]
    # each part alone is known to 5e-5 of itself (test_membrane_terms.py); what is small must still be seen
    scale = sum(np.abs(part).max() for part in parts.values())
    np.testing.assert_allclose(found, sum(parts.values()), rtol=0, atol=2e-5 * scale)


@pytest.mark.parametrize("left_out", ["inertia", "drag", "sewing", "attached", "bending"])
def test_every_part_is_in_the_gradient(sim, state, uv, left_out):
    """What is left when all others are taken away; a gentle state, so that none drowns in another's rounding."""
    n = sim.cloth_count
    flat = np.column_stack([uv[:, 0], np.zeros(len(uv)), -uv[:, 1]])
    bent = flat + np.column_stack([np.zeros(n), 0.01 * np.cos(30 * uv[:, 0]), np.zeros(n)])
    x = rounded(np.vstack([bent, state["skin"]]))
    parts = {k: reference.gradient(e, x[:n], STEP) for k, e in cloth_energies(sim, state).items()}
    found = solver_gradient(sim, x)[:n] - sum(part for k, part in parts.items() if k != left_out)
    largest = np.abs(parts[left_out]).max()
    noise = 2e-5 * sum(np.abs(part).max() for part in parts.values())
    assert noise < 0.2 * largest
    np.testing.assert_allclose(found, parts[left_out], rtol=0, atol=max(noise, 1e-3 * largest))


@pytest.mark.parametrize("lag", [1e-4, 2e-3, 5e-2])
def test_skin_spring_yields(sim, state, rng, lag):
    """From far below to far beyond e = hold/stiffness, and never more than the hold."""
    n = sim.cloth_count
    hold = rng.uniform(0.2, 0.6, sim.body_count)
    sim.state.hold.assign(hold.astype(np.float32))
    surface = rounded(state["skin"] + lag * rng.standard_normal(state["skin"].shape))
    x = np.vstack([sim.scene.x_start, surface])
    expected = reference.gradient(skin_energy(sim, state), surface, 1e-7)
    largest = np.abs(expected).max()
    assert largest > 1e-3
    found = solver_gradient(sim, x)[n:]
    # surface and skin lie a decimetre from the origin: their difference is known to 1e-8 m
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-5 * largest + 2e-8 * sim.settings.skin_stiffness)
    assert (np.linalg.norm(found, axis=1) <= hold * (1 + 1e-6)).all()
    exact = reference.hessian(skin_energy(sim, state), surface, 1e-6)
    held = sim.work.diagonal.numpy()[n:].astype(np.float64)
    assert np.linalg.eigvalsh(np.diag(np.repeat(held, 3)) - exact).min() > -1e-3 * held.max()


def test_newton_matrix_of_a_stretched_sheet_is_the_potentials_hessian(sim, state, uv, rng):
    n = sim.cloth_count
    x = rounded(np.vstack([stretched(uv, rng), state["skin"]]))
    solver_gradient(sim, x)  # sets the skin's part of the diagonal too
    sim.pairs.size = 0
    linearise(sim)
    matrix = dense(sim.all_count, lambda p, out: newton_product(sim, p, out))
    parts = cloth_energies(sim, state)
    expected = sum(reference.hessian(energy, x[:n], 20 * STEP) for energy in parts.values())
    size = np.abs(expected).max()
    assert size > 100
    np.testing.assert_allclose(matrix[: 3 * n, : 3 * n], expected, rtol=0, atol=2e-4 * size)
    np.testing.assert_allclose(matrix, matrix.T, rtol=0, atol=1e-6 * size)
    assert np.linalg.eigvalsh(matrix).min() > 0
    inverse = sim.work.blocks.numpy().astype(np.float64)
    for i in range(sim.all_count):
        block = matrix[3 * i : 3 * i + 3, 3 * i : 3 * i + 3]
        np.testing.assert_allclose(inverse[i] @ block, np.eye(3), atol=1e-4)


@pytest.mark.parametrize("kind", [stretched, crumpled])
def test_projective_dynamics_has_its_own_gradient_and_a_definite_matrix_above_its_hessian(sim, state, uv, rng, kind):
    n = sim.cloth_count
    x = rounded(np.vstack([kind(uv, rng), state["skin"]]))
    energies = [energy for name, energy in cloth_energies(sim, state).items() if name != "strain limit"]
    found = solver_gradient(sim, x, correcting=False)[:n]
    expected = sum(reference.gradient(energy, x[:n], STEP) for energy in energies)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-4 * np.abs(expected).max())
    sim.pairs.size = 0
    matrix = dense(n, lambda p, out: system_product(sim, p, out))
    size = np.abs(matrix).max()
    np.testing.assert_allclose(matrix, matrix.T, rtol=0, atol=1e-6 * size)
    assert np.linalg.eigvalsh(matrix).min() > 0
    exact = sum(reference.hessian(energy, x[:n], 20 * STEP) for energy in energies)
    assert np.linalg.eigvalsh(matrix - exact).min() > -1e-4 * size


def test_the_surface_is_drawn_back_slowly_and_the_firmer_the_further_it_has_yielded(sim, rng):
    settings = sim.settings
    skin = sim.body.skin_now.numpy().astype(np.float64)
    yielded = np.linspace(0.0, 0.05, sim.body_count)
    away = rng.standard_normal(skin.shape)
    surface = skin + yielded[:, None] * away / np.linalg.norm(away, axis=1, keepdims=True)
    sim.state.x.assign(np.vstack([sim.scene.x_start, surface]).astype(np.float32))
    sim.state.skin.fill_(np.nan)
    sim.state.hold.fill_(np.nan)
    limit_return(sim)
    longest = settings.return_speed * DT
    assert yielded.min() < longest < yielded.max()
    drawn = np.linalg.norm(sim.state.skin.numpy() - surface, axis=1)
    np.testing.assert_allclose(drawn, np.minimum(yielded, longest), atol=1e-6)
    left = np.linalg.norm(sim.state.skin.numpy() - skin, axis=1)
    np.testing.assert_allclose(left, np.maximum(yielded - longest, 0), atol=1e-6)
    firm = settings.skin_hold + settings.skin_firmness * yielded
    np.testing.assert_allclose(sim.state.hold.numpy(), firm, rtol=1e-4)
