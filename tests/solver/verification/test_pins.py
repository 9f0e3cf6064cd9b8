"""Pins: springs hold vertices where they start, or lead them where their places are written."""

from dataclasses import replace

import numpy as np
import pytest
from small_scenes import STILL, fabric, icosphere, rigid_body, sheet

from tryon_solver.body.pose import Pose
from tryon_solver.drawn import draw, drawn_with
from tryon_solver.geometry.carried import carried_by, frames_of
from tryon_solver.rebind import settle_in
from tryon_solver.scene import AirDrag, Gravity, Pins, Scene
from tryon_solver.settings import PRESETS
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


def test_what_is_drawn_goes_as_much_of_its_way_in_a_step_as_that_has_of_the_time():
    garment, x = sheet(5, 5, 0.2, 0.2)
    all_of_it, to = np.arange(25, dtype=np.int32), [0.04, 0.0, 0.0]
    scene = Scene(garment, x, None, fabric(), drawn_with((AirDrag(5.0),), garment, all_of_it))
    sim = build(scene, replace(PRESETS["live"], largest_step=1 / 120))
    values = next(c for c in sim.plan.contributions if c.name == "drawn").values
    sim.advance(None, 1 / 30)
    assert np.abs(sim.cloth_positions() - x).max() < 1e-5, "nothing was wanted of it yet"
    draw(sim, sim.cloth_positions(), x + to, 1 / 30)
    for share in (0.5, 1.0):
        sim.advance(None, (1 + share) / 30)
        np.testing.assert_allclose(values["places"].numpy(), x + share * np.array(to), atol=1e-6)
        assert values["left"].numpy()[0] == pytest.approx((1 - share) / 30, abs=1e-6)
    assert np.abs(sim.cloth_positions() - x - to).max() < 5e-3


def test_pins_that_hold_nothing_are_left_out_of_the_plan():
    garment, x = sheet(3, 3, 0.1, 0.1)
    for pins in (Pins(np.zeros(0, np.int32)), Pins(np.array([1], np.int32), 0.0)):
        plan = build(Scene(garment, x, None, fabric(), (pins,))).plan
        assert "pins" not in [contribution.name for contribution in plan.contributions]
        assert plan.describe().splitlines()[-1].startswith("not in the step: pins, ")


def test_pins_are_checked_by_name():
    garment, x = sheet(3, 3, 0.1, 0.1)
    with pytest.raises(ValueError, match="vertex 4 is listed twice"):
        Pins(np.array([1, 4, 4], np.int32))
    with pytest.raises(ValueError, match="stiffness must be a finite number"):
        Pins(np.array([1], np.int32), -1.0)
    with pytest.raises(ValueError, match="pins: vertices: there is no vertex 9; use 0 to 8"):
        Scene(garment, x, None, fabric(), (Pins(np.array([0, 9], np.int32)),))


def test_pins_that_the_body_leads_keep_their_place_by_it():
    """Over a ball that is turned and carried along, a pinned vertex goes with the triangle by which it was pinned."""
    ball, faces = icosphere(0.1, 2)
    garment, x = sheet(5, 5, 0.05, 0.05)
    x = x + [0.0, 0.13, 0.0]
    held = np.array([0, 12, 24], np.int32)
    effects = (AirDrag(1.0), Pins(held, 1e4, led=True))
    sim = build(Scene(garment, x, rigid_body(ball, faces), fabric(), effects), PRESETS["draft"], "cpu", STILL)
    values = next(c for c in sim.plan.contributions if c.name == "pins").values
    assert not values["onto"].numpy().any()
    sim.advance(STILL, 1 / 60)
    np.testing.assert_allclose(sim.cloth_positions(), x, atol=1e-6)  # as long as nothing leads, nothing holds
    settle_in(sim, {"pins"})
    angle = 0.4
    turn = np.array([0.0, 0.0, np.sin(angle / 2), np.cos(angle / 2)])
    there = Pose(np.array([0.2, 0.0, 0.1]), turn[None])
    for k in range(30):
        share = (k + 1) / 20
        half = 0.5 * angle * min(share, 1.0)
        pose = Pose(there.root * min(share, 1.0), np.array([[0.0, 0.0, np.sin(half), np.cos(half)]]))
        sim.advance(pose, (k + 2) / 60)
    c, s = np.cos(angle), np.sin(angle)
    expected = x[held] @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T + there.root
    np.testing.assert_allclose(sim.cloth_positions()[held], expected, atol=2e-3)
    assert np.linalg.norm(expected - x[held], axis=1).min() > 0.1


def test_held_in_the_room_it_stays_where_it_is_when_the_origin_moves():
    garment, x = sheet(3, 3, 0.1, 0.1)
    sim = build(Scene(garment, x, None, fabric(), (Pins(np.array([4], np.int32)),)))
    sim.move_origin(np.array([3.0, 0.0, -1.0]))
    np.testing.assert_allclose(places_of(sim).numpy()[0], x[4] - [3.0, 0.0, -1.0], atol=1e-6)


def test_points_are_carried_by_the_triangles_next_to_them():
    rng = np.random.default_rng(3)
    ball, faces = icosphere(0.1, 1)
    points = 1.2 * ball[:5] + 0.001 * rng.normal(size=(5, 3))
    onto, offsets = carried_by(points, ball, faces)
    frames = frames_of(ball[onto])
    np.testing.assert_allclose(frames @ frames.transpose(0, 2, 1), np.tile(np.eye(3), (5, 1, 1)), atol=1e-12)
    np.testing.assert_allclose(ball[onto[:, 0]] + np.einsum("kij,ki->kj", frames, offsets), points, atol=1e-12)
    assert (offsets[:, 1] > 0.015).all(), "along the normal, outwards"
