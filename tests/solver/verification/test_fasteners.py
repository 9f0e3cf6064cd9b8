"""Buttons: they hold what hangs from them, let go of it when they are opened, and the matrices know of both."""

import numpy as np
import pytest
from drape_states import dense
from effect_terms import contribution
from newton_product import newton_product
from small_scenes import fabric, layers

from tryon_solver.scene import AirDrag, FabricDamping, Fasteners, Gravity, Pins, Scene
from tryon_solver.simulation import build
from tryon_solver.stepping.gradient import system_product
from tryon_solver.stepping.newton import linearise
from tryon_solver.stepping.predict import predict_positions

G, DT, STIFFNESS = 9.81, 1 / 60, 400.0


def two_pieces(*effects):
    """One piece above the other, a centimetre apart; all of the upper is pinned, the lower is buttoned to it at its
    four corners, by hands that go that way within a step."""
    garment, x = layers(2, 4, 4, 0.09, -0.01)
    corners = np.array([0, 3, 12, 15])
    pairs = np.column_stack([corners, corners + 16]).astype(np.int32)
    stiff = fabric(areal_density=0.3, k_warp=2e3, k_weft=2e3, k_shear=500.0, k_bend=1e-2)
    pins = Pins(np.arange(16, dtype=np.int32), 1e5)
    return x, build(Scene(garment, x, None, stiff, (*effects, pins, Fasteners(pairs, STIFFNESS, 1.0))))


def closed(sim):
    return contribution(sim, "fasteners").values["closed"]


def test_buttons_hold_by_their_stiffness_and_let_go_when_opened():
    """m g/(4 k) apart at each corner; opened, all falls as nothing would hold it: implicit Euler's free fall."""
    x, sim = two_pieces(Gravity(), AirDrag(10.0))
    for k in range(90):
        sim.advance(None, (k + 1) * DT)
    hung = sim.cloth_positions().astype(np.float64)
    apart = np.linalg.norm(hung[[0, 3, 12, 15]] - hung[[16, 19, 28, 31]], axis=1)
    np.testing.assert_allclose(apart, 0.3 * 0.09**2 * G / 4 / STIFFNESS, rtol=0.02)
    closed(sim).zero_()
    speed, fallen = 0.0, 0.0
    for k in range(90, 105):
        sim.advance(None, (k + 1) * DT)
        speed = (speed + DT * G) / (1 + DT * 10.0 / 0.3)
        fallen += DT * speed
    way = (hung - sim.cloth_positions())[16:, 1].mean()
    assert way == pytest.approx(fallen, rel=2e-3)
    assert np.abs(sim.cloth_positions()[:16] - x[:16]).max() < 1e-3
    closed(sim).fill_(1.0)
    for k in range(105, 225):
        sim.advance(None, (k + 1) * DT)
    again = sim.cloth_positions().astype(np.float64)
    found = np.linalg.norm(again[[0, 3, 12, 15]] - again[[16, 19, 28, 31]], axis=1)
    np.testing.assert_allclose(found, apart, rtol=0.02)


def test_what_is_far_apart_comes_together_at_the_speed_that_is_told():
    """Two pieces half a metre apart that nothing holds: their buttons come nearer by it in each step, and stay."""
    garment, x = layers(2, 4, 4, 0.09, 0.5)
    pairs = np.column_stack([np.arange(16), np.arange(16) + 16]).astype(np.int32)
    sim = build(Scene(garment, x, None, fabric(), (Fasteners(pairs, 2e4, 0.6),)))
    apart = [0.5]
    for k in range(60):
        sim.advance(None, (k + 1) * DT)
        y = sim.cloth_positions().astype(np.float64)
        apart.append(np.linalg.norm(y[:16] - y[16:], axis=1).max())
    came = -np.diff(apart)
    np.testing.assert_allclose(came[1:48], 0.6 * DT, rtol=0.02)
    assert max(apart[52:]) < 1e-3


def test_matrices_are_those_of_a_garment_built_with_the_buttons_as_they_are():
    """After buttons were opened and half closed: the same products as if there had never been another value."""
    shares = np.array([1.0, 0.0, 0.5, 0.0], np.float32)
    products = []
    for written in (False, True):
        _, sim = two_pieces(FabricDamping())
        if written:
            closed(sim).zero_()
            predict_positions(sim)
        closed(sim).assign(shares)
        if not written:
            for term in sim.plan.contributions:
                if term.start_step is not None:
                    term.start_step(sim.state)
            sim.matrices.fill()
            sim.set_diagonals(sim.dt)
        predict_positions(sim)
        linearise(sim)
        n = sim.cloth_count
        constant = dense(n, lambda p, out, sim=sim: system_product(sim, p, out))
        products.append((constant, dense(n, lambda p, out, sim=sim: newton_product(sim, p, out))))
    # open, a button has no entry between its vertices; half closed, half of one
    for constant, newton in products:
        for matrix in (constant, newton):
            between = [-matrix[3 * a, 3 * (a + 16)] for a in (0, 3, 12, 15)]
            np.testing.assert_allclose(between, shares * STIFFNESS, rtol=1e-5, atol=1e-3)
    for one, other in zip(*products):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-6 * np.abs(one).max())


def test_fasteners_are_checked_by_name():
    with pytest.raises(ValueError, match="pair 1 is vertex 4 twice"):
        Fasteners(np.array([[0, 1], [4, 4]], np.int32))
    garment, x = layers(1, 3, 3, 0.1, 0.0)
    with pytest.raises(ValueError, match="fasteners: pairs: there is no vertex 9"):
        Scene(garment, x, None, fabric(), (Fasteners(np.array([[0, 9]], np.int32)),))
