"""Motion without contact against closed forms of implicit Euler and conservation laws."""

from dataclasses import replace

import numpy as np
import pytest
from contact_scenes import tube
from small_scenes import STILL, fabric, flattened, icosphere, layers, rigid_body, sheet, turn

from tryon_solver.geometry.garment import Garment
from tryon_solver.scene import Adhesion, AirDrag, BodyContact, Gravity, Pins, Scene, SelfContact, StrainLimit
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build
from tryon_solver.stepping.coast import coast, keep_momentum
from tryon_solver.stepping.predict import predict_positions

G = 9.81
ULP = 2.0**-24  # of a metre, half the spacing of float32 between 0.5 and 1 m


def scene(effects, size=0.4):
    garment, x = sheet(9, 9, size, size)
    return Scene(garment, x @ turn((25, 40, 10)).T, None, fabric(), effects)


@pytest.mark.parametrize("preset", PRESETS)
def test_free_fall_is_implicit_eulers(preset):
    """x_n = x_0 + v_0 n dt + g dt^2 n (n + 1)/2, exactly: a rigid fall strains nothing."""
    settings = PRESETS[preset]
    sim = build(scene((Gravity(),)), settings)
    dt, steps, v0 = settings.largest_step, 20, np.array([0.4, 1.0, -0.3])
    sim.state.v.fill_(v0)
    start = sim.cloth_positions().astype(np.float64)
    for k in range(steps):
        report = sim.advance(None, (k + 1) * dt)
    assert report.steps == 1
    expected = start + v0 * steps * dt + np.array([0, -G, 0]) * dt**2 * steps * (steps + 1) / 2
    # v = (x - x_start)/dt carries each step's rounding on: n (n + 1)/2 roundings of coordinates below 2 m
    tolerance = steps * (steps + 1) / 2 * 4 * ULP
    assert tolerance < 1e-4
    np.testing.assert_allclose(sim.cloth_positions(), expected, rtol=0, atol=tolerance)


@pytest.mark.parametrize("beside", [False, True], ids=["alone", "beside a body"])
@pytest.mark.parametrize("preset", ["draft", "live"])
def test_cloth_that_may_touch_itself_falls_as_fast_and_looks_no_further(preset, beside):
    """A closed surface: v_n = v_{n-1} + g dt, and what is near each other stays what it was, however fast it falls;
    also where a body that it may touch goes by and would carry it along."""
    ball, faces = icosphere(0.12, 2)
    garment = Garment(faces, flattened(ball, faces), np.zeros(len(faces), np.int32), len(ball))
    body = rigid_body(ball + np.array([0.3, 0.0, 0.0]), faces) if beside else None
    pose = STILL if beside else None
    effects = (Gravity(), SelfContact(), *((BodyContact(),) if beside else ()))
    sim = build(Scene(garment, ball, body, fabric(), effects), PRESETS[preset], "cpu", pose)
    dt, steps = PRESETS[preset].largest_step, 15
    known = []
    for k in range(steps):
        if beside:
            pose = replace(STILL, root=np.array([0.0, 0.0, 1.0 * (k + 1) * dt]))
        sim.advance(pose, (k + 1) * dt)
        known.append(sim.candidates.size)
    limit = steps * 4 * ULP / dt  # each step's rounding of coordinates below 2 m is carried on
    np.testing.assert_allclose(sim.state.v.numpy()[:, 1], -G * dt * steps, rtol=0, atol=limit)
    assert max(known) <= known[0]


def test_drag_slows_a_fall_to_its_terminal_speed():
    """Implicit Euler of m v' = m g - c A v: v_{n+1} = (v_n + dt g)/(1 + dt c/rho); mass and area are proportional."""
    coefficient, dt = 3.0, 1 / 60
    drape = scene((Gravity(), AirDrag(coefficient)))
    sim = build(drape)
    speed = 0.0
    for k in range(40):
        sim.advance(None, (k + 1) * dt)
        speed = (speed + dt * G) / (1 + dt * coefficient / drape.fabric.areal_density)
        found = -sim.state.v.numpy()[:, 1]
        np.testing.assert_allclose(found, speed, rtol=0, atol=40 * 4 * ULP / dt)
    assert speed == pytest.approx(G * drape.fabric.areal_density / coefficient, rel=1e-3)


def sewn_tube():
    """A garment with a seam, that may touch itself."""
    garment, x = tube(20, 13, 0.08, 0.3)
    return Scene(garment, x @ turn((25, 40, 10)).T, None, fabric(), (StrainLimit(), SelfContact()))


def loose_sheet():
    """A square."""
    return scene((StrainLimit(),))


def strained(scene_of, preset="live"):
    """Cloth stretched unevenly, spinning and drifting: inner forces only."""
    drape = scene_of()
    sim = build(drape, PRESETS[preset])
    x = drape.x_start
    centre = x.mean(0)
    pulled = centre + (x - centre) * (1.05 + 0.3 * (x[:, :1] - centre[0]))
    velocity = np.cross([1.0, 3.0, -2.0], pulled - centre) + np.array([0.3, -0.2, 0.5])
    sim.state.x.assign(pulled.astype(np.float32))
    sim.state.v.assign(velocity.astype(np.float32))
    return sim


@pytest.mark.parametrize("preset", [pytest.param(p, marks=pytest.mark.long) if p == "fit" else p for p in PRESETS])
@pytest.mark.parametrize("scene_of", [loose_sheet, sewn_tube])
def test_inner_forces_conserve_momentum(scene_of, preset):
    """Every inner force has its counterforce: sum m v stays, whatever the solve's budget leaves undone."""
    sim = strained(scene_of, preset)
    mass = sim.mass[:, None]
    first = (mass * sim.state.v.numpy()).sum(0)
    scale = (mass * np.abs(sim.state.v.numpy())).sum()
    moved = sim.state.v.numpy().copy()
    for k in range(20):
        sim.advance(None, (k + 1) / 30)
    momentum = (mass * sim.state.v.numpy()).sum(0)
    assert np.abs(sim.state.v.numpy() - moved).max() > 0.5  # they did exchange momentum
    print(f"momentum lost over twenty steps: {np.abs(momentum - first).max() / scale:.1e} of sum m |v|")
    np.testing.assert_allclose(momentum, first, rtol=0, atol=3e-4 * scale)


@pytest.mark.parametrize("preset", ["draft", "live"])
def test_cloths_that_meet_and_stick_conserve_momentum(preset):
    """Contact stops vertices one by one, and what a budget then leaves undone is no force from outside."""
    garment, x = layers(2, 9, 9, 0.3, 2.5e-3)
    sim = build(Scene(garment, x, None, fabric(), (SelfContact(), Adhesion(100.0, 0.05))), PRESETS[preset])
    velocity = 0.3 * np.sin(20 * x[:, [2, 0, 1]] + 1) + np.where(x[:, 1:2] > 1e-3, [0.2, -1.5, 0], [0.2, 1, 0])
    sim.state.v.assign(velocity.astype(np.float32))
    mass = sim.mass[:, None]
    first, scale = (mass * velocity).sum(0), (mass * np.abs(velocity)).sum()
    for k in range(2):
        sim.advance(None, (k + 1) / 30)
    moved = sim.state.v.numpy()
    assert np.abs(moved - velocity).max() > 1.0  # they did meet
    print(f"momentum lost: {np.abs((mass * moved).sum(0) - first).max() / scale:.1e} of sum m |v|")
    np.testing.assert_allclose((mass * moved).sum(0), first, rtol=0, atol=3e-4 * scale)


@pytest.mark.parametrize("outside", ["nothing", "pins", "drag"])
def test_cloth_goes_as_one_as_far_as_what_is_outside_lets_it(outside):
    """The least of m/2 |c/dt - v|^2 + k/2 |c|^2 is at c = dt v/(1 + dt^2 k/m): k 0, of all pins, or drag's c A/dt; and
    from a way off it, whatever contact had done, the cloth comes back there."""
    stiffness, coefficient, velocity = 50.0, 3.0, np.array([1.0, 2.0, -0.5])
    effects = {"nothing": (), "pins": (Pins(np.array([0, 1, 9]), stiffness),), "drag": (AirDrag(coefficient),)}
    sim = build(scene((SelfContact(), *effects[outside])), PRESETS["draft"])
    dt = PRESETS["draft"].largest_step
    held = {"nothing": 0.0, "pins": 3 * stiffness, "drag": coefficient * sim.area.sum() / dt}[outside]
    way = dt * velocity / (1 + dt**2 * held / sim.mass.sum())
    sim.state.v.fill_(velocity)
    start = sim.cloth_positions()
    predict_positions(sim)
    coast(sim)
    feasible = sim.state.x_feasible.numpy()[: sim.cloth_count]
    tolerance = 8 * ULP  # of the places before and after, and of sums of 81 over which c is a share
    np.testing.assert_allclose(feasible - start, np.broadcast_to(way, start.shape), rtol=0, atol=tolerance)
    sim.state.x.assign((start + [0.01, -0.02, 0.03]).astype(np.float32))
    sim.listed = False  # what is near is not known: contact may have done anything
    keep_momentum(sim)
    np.testing.assert_allclose(sim.cloth_positions() - start, np.broadcast_to(way, start.shape), rtol=0, atol=tolerance)


@pytest.mark.parametrize("scene_of", [loose_sheet, sewn_tube])
def test_angular_momentum_decays_as_implicit_euler_says(scene_of):
    """L_{n+1} = L_n + dt sum m v_{n+1} x v_n for any inner force without torque about x_{n+1}."""
    sim = strained(scene_of)
    mass = sim.mass[:, None]

    def angular():
        return (mass * np.cross(sim.state.x.numpy().astype(np.float64), sim.state.v.numpy())).sum(0)

    for k in range(8):
        before, v_before = angular(), sim.state.v.numpy().astype(np.float64)
        sim.advance(None, (k + 1) / 60)
        v_after = sim.state.v.numpy().astype(np.float64)
        predicted = before + (mass * np.cross(v_after, v_before)).sum(0) / 60
        scale = np.linalg.norm(before)
        assert scale > 1e-4
        print(f"step {k}: off by {np.abs(angular() - predicted).max() / scale:.1e}")
        np.testing.assert_allclose(angular(), predicted, rtol=0, atol=2e-3 * scale)
