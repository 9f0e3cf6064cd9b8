"""Pins: springs hold vertices where they start, or lead them where their places are written."""

import numpy as np
import pytest
from small_scenes import fabric, sheet

from tryon_solver.scene import AirDrag, Gravity, Pins, Scene
from tryon_solver.simulation import build

G, DENSITY, STIFFNESS = 9.81, 0.3, 50.0


def places_of(sim):
    return next(c for c in sim.plan.contributions if c.name == "pins").values["places"]


def test_pinned_cloth_sinks_by_its_weight_over_the_springs():
    """Every vertex on a spring of its own: it sinks by m g/k, the fabric's own forces aside."""
    garment, x = sheet(5, 5, 0.2, 0.2)
    cloth = fabric(areal_density=DENSITY, k_warp=1e-3, k_weft=1e-3, k_shear=1e-3, k_bend=0.0)
    pins = Pins(np.arange(25, dtype=np.int32), STIFFNESS)
    sim = build(Scene(garment, x, None, cloth, (Gravity(), AirDrag(20.0), pins)))
    for k in range(60):
        sim.advance(None, (k + 1) / 60)
    sunk = x[:, 1] - sim.cloth_positions()[:, 1]
    np.testing.assert_allclose(sunk, sim.mass * G / STIFFNESS, rtol=2e-3)


def test_led_vertices_take_the_cloth_along():
    """Two corners of a free sheet are led 10 cm along at a constant speed; all of it follows and nothing else moves."""
    garment, x = sheet(5, 5, 0.2, 0.2)
    led = np.array([0, 20], np.int32)
    sim = build(Scene(garment, x, None, fabric(), (AirDrag(5.0), Pins(led))))
    places, start = places_of(sim), x[led]
    np.testing.assert_array_equal(places.numpy(), start.astype(np.float32))
    for k in range(60):
        places.assign((start + [-0.1 * (k + 1) / 60, 0, 0]).astype(np.float32))
        sim.advance(None, (k + 1) / 60)
    moved = sim.cloth_positions() - x
    np.testing.assert_allclose(moved[led], [[-0.1, 0, 0]] * 2, atol=1e-3)
    assert moved[:, 0].mean() == pytest.approx(-0.1, abs=0.02)
    assert np.abs(moved[:, 1]).max() < 1e-6


def test_pins_that_hold_nothing_are_left_out_of_the_plan():
    garment, x = sheet(3, 3, 0.1, 0.1)
    for pins in (Pins(np.zeros(0, np.int32)), Pins(np.array([1], np.int32), 0.0)):
        assert "pins" not in build(Scene(garment, x, None, fabric(), (pins,))).plan.describe()


def test_pins_are_checked_by_name():
    garment, x = sheet(3, 3, 0.1, 0.1)
    with pytest.raises(ValueError, match="vertex 4 is listed twice"):
        Pins(np.array([1, 4, 4], np.int32))
    with pytest.raises(ValueError, match="stiffness must be a finite number"):
        Pins(np.array([1], np.int32), -1.0)
    with pytest.raises(ValueError, match="there is no vertex 9; the garment has 9"):
        Scene(garment, x, None, fabric(), (Pins(np.array([0, 9], np.int32)),))
