"""What Newton is told of a pair's friction, by where its slip comes from; and that its iterations end on it."""

import numpy as np
import pytest
import warp as wp

from tryon_solver.effects.friction import prepare_kernel
from tryon_solver.effects.presliding import Presliding
from tryon_solver.effects.slip import f1

E = 1.7e-6  # m, presliding
COULOMB = 0.4  # N: mu 0.5, 0.8 N of normal force


@wp.kernel
def share_kernel(y: wp.array(dtype=wp.float32), out: wp.array(dtype=wp.float32)):
    i = wp.tid()
    out[i] = f1(y[i], E)


def prepared(slip, before, given=0.0, kinetic=0.5):
    """(force over slip, stiffness along the slip) [N/m] of a vertex that slid by so much on one that is fixed, after
    it had given so much [m]; `kinetic` coefficient of what slides."""
    wp.init()

    def vectors(first):
        return wp.array([first, [0.0, -1e-3, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]], dtype=wp.vec3, device="cpu")

    weight = wp.full(1, np.nan, dtype=wp.float32, device="cpu")
    along = wp.full(1, wp.vec4(np.nan), dtype=wp.vec4, device="cpu")
    found = wp.full(1, wp.vec3(np.nan), dtype=wp.vec3, device="cpu")
    ids = wp.array([[0, 1, 2, 3]], dtype=wp.vec4i, device="cpu")
    known = Presliding.allocate(1, "cpu")
    if given:
        one = wp.array([1], dtype=wp.int32, device="cpu")
        known.replace_by(one, ids, wp.array([[given, 0.0, 0.0]], dtype=wp.vec3, device="cpu"))
    inputs = [
        wp.array([1, 0], dtype=wp.int32, device="cpu"),
        ids,
        wp.array([[1.0, -1.0, 0.0, 0.0]], dtype=wp.vec4, device="cpu"),
        wp.array([[0.0, 1.0, 0.0]], dtype=wp.vec3, device="cpu"),
        wp.array([-0.8], dtype=wp.float32, device="cpu"),
        wp.array([[1e-3, 2e-3, 5e-5]], dtype=wp.vec3, device="cpu"),
        wp.array([1, 0, 0, 0], dtype=wp.int32, device="cpu"),
        wp.array([[[np.nan] * 2, [0.5, kinetic]], [[0.5, kinetic], [np.nan] * 2]], dtype=wp.vec2, device="cpu"),
        E,
        1,
        vectors([slip, 0.0, 0.0]),
        vectors([before, 0.0, 0.0]),
        vectors([0.0, 0.0, 0.0]),
        known.table,
        known.ids,
        known.given,
    ]
    wp.launch(prepare_kernel, 1, inputs, [found, weight, along], device="cpu")
    assert found.numpy()[0] == pytest.approx([given, 0.0, 0.0], rel=1e-6)
    return float(weight.numpy()[0]), float(weight.numpy()[0] + along.numpy()[0][3])


def share(y):
    out = wp.full(1, np.nan, dtype=wp.float32, device="cpu")
    wp.launch(share_kernel, 1, [wp.array([y], dtype=wp.float32, device="cpu")], [out], device="cpu")
    return float(out.numpy()[0])


@pytest.mark.parametrize("slip", [0.2 * E, 0.9 * E, 3 * E, 1e-3])
def test_a_growing_slip_has_its_own_slope(slip):
    force, stiffness = prepared(slip, 0.5 * slip)
    assert force * slip == pytest.approx(COULOMB * share(slip), rel=1e-5)
    h = 1e-2 * E
    slope = COULOMB * (share(slip + h) - share(slip - h)) / (2 * h)
    assert stiffness == pytest.approx(slope, rel=1e-3, abs=1e-4 * COULOMB / E)
    assert (stiffness > 0.05 * COULOMB / E) == (slip < E)


@pytest.mark.parametrize(("slip", "left"), [(0.5 * E, 1.0), (E, 1.0), (1.5 * E, 0.8), (2 * E, 0.6), (1e-3, 0.6)])
def test_of_what_slides_the_kinetic_coefficient_is_left(slip, left):
    """mu_k/mu = 0.6: all of it up to s, 0.6 from 2 s on; no slope where it falls."""
    force, stiffness = prepared(slip, 0.5 * slip, kinetic=0.3)
    assert force * slip == pytest.approx(COULOMB * left * share(min(slip, E)), rel=1e-5)
    assert slip < E or stiffness == pytest.approx(0.0, abs=1e-4 * COULOMB / E)


def test_a_slip_that_was_turned_round_has_the_chord():
    _, stiffness = prepared(1e-4, -3e-4)
    assert stiffness == pytest.approx(2 * COULOMB / 4e-4, rel=1e-4)


@pytest.mark.parametrize(("slip", "before"), [(1e-4, 3e-4), (2 * E, 5 * E)])
def test_a_slip_on_its_way_back_has_the_secant(slip, before):
    force, stiffness = prepared(slip, before)
    assert stiffness == pytest.approx(force, rel=1e-6)
    assert force == pytest.approx(COULOMB / slip, rel=1e-5)


@pytest.mark.parametrize("within", [0.5 * E, 0.99 * E])
def test_within_the_static_regime_a_shortened_slip_has_its_own_slope(within):
    _, stiffness = prepared(within, 3 * E)
    assert stiffness == pytest.approx(2 * COULOMB * (1 - within / E) / E, rel=1e-4)


@pytest.mark.parametrize("load", [0.3, -0.7])
def test_newton_ends_on_what_sticks_from_wherever_it_is_thrown(load):
    """A vertex on a spring of 1000 N/m, pulled by `load` of the Coulomb force, from 0.3 mm on the wrong side."""
    spring, pull = 1e3, load * COULOMB
    slip, before = 3e-4, 5e-4
    for _ in range(40):
        force, stiffness = prepared(slip, before)
        rest = pull - spring * slip - force * slip
        slip, before = slip + rest / (spring + stiffness), slip
    assert abs(rest) < 1e-3 * COULOMB
    assert abs(slip) < E


@pytest.mark.parametrize("given", [0.4 * E, -0.3 * E])
def test_what_a_contact_has_given_counts_as_slip(given):
    force, stiffness = prepared(0.5 * E, 0.4 * E, given)
    whole, slope = prepared(0.5 * E + given, 0.4 * E + given)
    assert force == pytest.approx(whole, rel=1e-5)
    assert stiffness == pytest.approx(slope, rel=1e-4)
