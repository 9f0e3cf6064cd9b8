"""Membrane and strain limit: energy, gradient and Hessian against float64 differences of their formulas."""

import numpy as np
import pytest
import reference_energies as reference
from drape_states import STATES, compressed, crumpled, rounded, sheared, stretched, term_hessian, vertex_gradient
from small_scenes import device_vectors, fabric, sheet, turn

from tryon_solver.scene import Scene, StrainLimit
from tryon_solver.simulation import build

STIFFNESS, LIMIT = 1500.0, 1.08
STEP = 1e-6  # m, of the differences: a 10^5-th of a triangle's side
TERMS = ("membrane", "strain_limit")
COLLAPSES = {"to a line": (1.5, 0.0), "to a point": (0.0, 0.0), "inside out": (1.0, -1.0), "blown up": (1e4, 1e4)}


@pytest.fixture(scope="module")
def scene():
    """A sheet of 4 x 4 vertices, 6 x 9 cm, whose three stiffnesses differ."""
    garment, x = sheet(4, 4, 0.06, 0.09)
    cloth = fabric(k_warp=300.0, k_weft=180.0, k_shear=70.0, strain_limit=LIMIT)
    return Scene(garment, x, None, cloth, (StrainLimit(STIFFNESS),))


@pytest.fixture(scope="module")
def garment(scene):
    return scene.garment


@pytest.fixture(scope="module")
def terms(scene):
    """The scene's contributions by name."""
    return {c.name: c for c in build(scene).plan.contributions}


@pytest.fixture(scope="module")
def formulas(scene):
    """The same terms' energies in float64."""
    return {
        "membrane": reference.membrane(scene.garment, scene.fabric),
        "strain_limit": reference.strain_limit(scene.garment, STIFFNESS, LIMIT),
    }


@pytest.fixture
def uv(scene):
    """(N, 2) m; the sheet is made so that vertex i lies at (x, -z)."""
    return np.column_stack([scene.x_start[:, 0], -scene.x_start[:, 2]])


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("name", TERMS)
def test_energy_is_the_formula(terms, formulas, uv, rng, name, state):
    x = rounded(STATES[state](uv, rng))
    expected = formulas[name](x)
    assert expected > 1e-5
    assert terms[name].energy(device_vectors(x)) == pytest.approx(expected, rel=2e-5)


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("name", TERMS)
def test_gradient_is_the_energys(terms, formulas, garment, uv, rng, name, state):
    x = rounded(STATES[state](uv, rng))
    expected = reference.gradient(formulas[name], x, STEP)
    largest = np.abs(expected).max()
    assert largest > 1e-2
    found = vertex_gradient(garment, terms[name], x)
    # F carries 2^-24 |x| |g| = 6e-8 of rounding; the polar factor of a nearly singular F magnifies it
    np.testing.assert_allclose(found, expected, rtol=0, atol=5e-5 * largest)


@pytest.mark.parametrize("name", TERMS)
def test_hessian_of_a_stretched_sheet_is_the_energys(terms, formulas, garment, uv, rng, name):
    x = rounded(stretched(uv, rng))
    expected = reference.hessian(formulas[name], x, 20 * STEP)
    assert np.linalg.eigvalsh(expected).max() > 100
    np.testing.assert_allclose(
        term_hessian(garment, terms[name], x), expected, rtol=0, atol=2e-4 * np.abs(expected).max()
    )


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("name", TERMS)
def test_hessian_is_semidefinite_and_only_adds_to_the_energys(terms, formulas, garment, uv, rng, name, state):
    """Leaving negative parts out can only raise a quadratic form; the exact Hessian is somewhere indefinite."""
    x = rounded(STATES[state](uv, rng))
    found = term_hessian(garment, terms[name], x)
    size = np.abs(found).max()
    assert size > 10
    np.testing.assert_allclose(found, found.T, rtol=0, atol=1e-6 * size)
    assert np.linalg.eigvalsh(found).min() > -1e-5 * size
    exact = reference.hessian(formulas[name], x, 20 * STEP)
    assert np.linalg.eigvalsh(found - exact).min() > -1e-3 * size
    if state in (compressed.__name__, crumpled.__name__) and name == "membrane":
        assert np.linalg.eigvalsh(exact).min() < -1e-2 * size


@pytest.mark.parametrize("state", STATES)
def test_constant_matrix_bounds_the_membranes_hessian(terms, formulas, uv, rng, state):
    """What projective dynamics descends with majorises the energy: a cycle can't overshoot."""
    x = rounded(STATES[state](uv, rng))
    bound = np.kron(terms["membrane"].stiffness.matrix.matrix().toarray(), np.eye(3))
    exact = reference.hessian(formulas["membrane"], x, 20 * STEP)
    assert np.linalg.eigvalsh(bound - exact).min() > -1e-4 * np.abs(bound).max()


@pytest.mark.parametrize("name", TERMS)
def test_rigid_motion_turns_the_gradient_and_keeps_the_energy(terms, garment, uv, rng, name):
    x = rounded(sheared(uv, rng)) if name == "membrane" else rounded(stretched(uv, rng))
    term = terms[name]
    still = vertex_gradient(garment, term, x)
    r = turn((100, -40, 75))
    moved = rounded(x @ r.T + [2.0, 1.0, -3.0])
    largest = np.abs(still).max()
    assert largest > 1e-2
    # 4 m from the origin positions are rounded to 2.4e-7 m: an error of stiffness x rounding
    tolerance = 2.4e-7 * np.abs(term_hessian(garment, term, x)).max() * 4
    np.testing.assert_allclose(vertex_gradient(garment, term, moved), still @ r.T, rtol=0, atol=tolerance)
    assert tolerance < 0.05 * largest
    assert term.energy(device_vectors(moved)) == pytest.approx(term.energy(device_vectors(x)), rel=1e-3)


@pytest.mark.parametrize("name", TERMS)
def test_no_force_at_rest(terms, garment, scene, uv, name):
    x = np.column_stack([uv, np.zeros(len(uv))]) @ turn((30, 60, 10)).T
    found = vertex_gradient(garment, terms[name], rounded(x))
    assert np.abs(found).max() < 1e-5 * scene.fabric.k_warp * 0.09


def test_strain_limit_is_silent_within_the_limit(terms, garment, uv):
    x = rounded(np.column_stack([1.07 * uv[:, 0], 0.7 * uv[:, 1], np.zeros(len(uv))]))
    term = terms["strain_limit"]
    assert term.energy(device_vectors(x)) == 0.0
    assert not vertex_gradient(garment, term, x).any()
    assert not term_hessian(garment, term, x).any()


@pytest.mark.parametrize("name", TERMS)
@pytest.mark.parametrize("collapse", COLLAPSES)
def test_degenerate_triangles_give_finite_values(terms, garment, uv, name, collapse):
    a, b = COLLAPSES[collapse]
    x = np.column_stack([a * uv[:, 0], b * uv[:, 1], np.zeros(len(uv))])
    term = terms[name]
    assert np.isfinite(term.energy(device_vectors(x)))
    assert np.isfinite(vertex_gradient(garment, term, x)).all()
    hessian = term_hessian(garment, terms[name], x)
    assert np.isfinite(hessian).all()
    assert np.linalg.eigvalsh(0.5 * (hessian + hessian.T)).min() > -1e-5 * max(np.abs(hessian).max(), 1.0)
