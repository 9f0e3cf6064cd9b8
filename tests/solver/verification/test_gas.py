"""Gas that cloth shuts in: Boyle's law, and the tension of a balloon, which holds what the gas has over its ambient."""

from dataclasses import replace

import ipctk
import numpy as np
import pytest
import warp as wp
from effect_terms import contribution, effect_gradient
from scipy.optimize import brentq
from small_scenes import STILL, device_vectors, fabric, flattened, grid_faces, icosphere, rigid_body, sheet, slab

from tryon_solver.geometry.enclosed import closed_by_caps, enclosed_volume
from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.outfit import put_together
from tryon_solver.linalg.dyad import Dyad
from tryon_solver.scene import AirDrag, BodyContact, Elastic, ElasticLine, Gas, Gravity, Scene, SelfContact
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build
from tryon_solver.stepping.correct import look_around
from tryon_solver.stepping.newton import solve_newton_system
from tryon_solver.stepping.search import search_around
from tryon_solver.stepping.take import prove_free, take_within_region

K, AMBIENT = 300.0, 101325.0
RUBBER = fabric(k_warp=K, k_weft=K, k_shear=K, k_bend=0.0, strain_limit=3.0)


def ball_of_cloth():
    """Of 10 cm."""
    ball, faces = icosphere(0.1, 2)
    spline_corners = ball[faces][:, :, :2]
    panel = np.zeros(len(faces), np.int32)
    return ball, Garment(faces, flattened(ball, faces), panel, len(ball), spline_corners=spline_corners)


def balloon(*effects):
    ball, garment = ball_of_cloth()
    return ball, build(Scene(garment, ball, None, RUBBER, (AirDrag(20.0), *effects)))


def settled(sim, seconds=2.0):
    start = sim.state.time
    for k in range(round(seconds * 60)):
        sim.advance(None, start + (k + 1) / 60)
    assert np.abs(sim.state.v.numpy()).max() < 2e-3
    return sim.cloth_positions().astype(np.float64)


def volume_of(sim):
    return enclosed_volume(sim.cloth_positions().astype(np.float64), sim.scene.garment.faces)


@pytest.fixture(scope="module")
def inflated():
    """A balloon of 10 cm with 1.3 times the gas that it has room for."""
    ball, faces = icosphere(0.1, 2)
    return (*balloon(Gas(1.3 * enclosed_volume(ball, faces))), 1.3)


def test_balloon_is_as_large_as_its_gas_and_its_tension_say(inflated):
    """Virtual work of all growing alike by s: (n R T/(V s^3) - p_a) 3 V s^2 = 2 K A (s - 1), by Boyle's law within."""
    ball, sim, more = inflated
    faces = sim.scene.garment.faces
    a, b, c = (ball[faces[:, k]] for k in range(3))
    volume, area = enclosed_volume(ball, faces), np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    gas = contribution(sim, "gas").values
    for ambient in (AMBIENT, 0.9 * AMBIENT):
        gas["ambient"].fill_(ambient)
        radius = np.linalg.norm(settled(sim), axis=1)

        def unbalanced(s, ambient=ambient):
            over = more * AMBIENT / s**3 - ambient
            return over * 3 * volume * s**2 - 2 * K * area * (s - 1)

        s = brentq(unbalanced, 1.0, 2.0)
        assert s > 1.07
        assert radius.mean() / 0.1 - 1 == pytest.approx(s - 1, rel=0.01)
        assert np.ptp(radius) < 0.03 * radius.mean()


def test_squeezed_gas_keeps_pressure_times_volume():
    """Elastic along all edges draws the balloon together. Virtual work of all growing alike, of gas, elastic and skin,
    tells the pressure; Boyle tells it of the volume."""
    ball, faces = icosphere(0.1, 2)
    edges = np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    stiffness, ratio = 15.0, 0.5
    _, sim = balloon(Gas(), Elastic((ElasticLine(edges, ratio, stiffness),)))
    start = volume_of(sim)
    x = settled(sim)
    rest = np.linalg.norm(ball[edges[:, 0]] - ball[edges[:, 1]], axis=1)
    length = np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1)
    drawn = (stiffness / rest * (length - ratio * rest) * length).sum()
    flat = flattened(ball, faces)
    sides = np.stack([flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]], axis=2)
    now = np.stack([x[faces[:, 1]] - x[faces[:, 0]], x[faces[:, 2]] - x[faces[:, 0]]], axis=2)
    s = np.linalg.svd(now @ np.linalg.inv(sides), compute_uv=False)
    skin = (K * 0.5 * np.linalg.det(sides)[:, None] * (s - 1) * s).sum()
    volume = volume_of(sim)
    over = (drawn + skin) / (3 * volume)
    assert volume / start < 0.99
    assert over == pytest.approx(AMBIENT * (start / volume - 1), rel=0.02)


def test_gradient_is_that_of_the_energy_and_the_dyad_its_derivative(rng):
    """By central differences of p_a V - n R T ln V in float64, of a tube with open ends; w is dV/dx, and the dyad is
    d^2E/dV^2 w w^T."""
    columns, rows = 7, 4
    turns = 2 * np.pi * np.arange(columns) / columns
    x = np.array([[0.05 * np.sin(t), h, 0.05 * np.cos(t)] for h in np.linspace(0, 0.1, rows) for t in turns])
    grid = grid_faces(columns + 1, rows)
    faces = ((grid // (columns + 1)) * columns + (grid % (columns + 1)) % columns).astype(np.int32)
    garment = Garment(faces, flattened(x, faces), np.zeros(len(faces), np.int32), len(x), spline_corners=None)
    x = (x + 4e-3 * rng.standard_normal(x.shape)).astype(np.float32).astype(np.float64)
    sim = build(Scene(garment, x, None, RUBBER, (Gas(1.5e-3),)))
    term, closed = contribution(sim, "gas"), closed_by_caps(faces)
    amount = 1.5e-3 * AMBIENT

    def energy(y):
        volume = enclosed_volume(y, closed)
        return AMBIENT * volume - amount * np.log(volume)

    def differences(f, step=1e-6):
        found = np.zeros_like(x)
        for i in np.ndindex(x.shape):
            y = x.copy()
            y[i] += step
            above = f(y)
            y[i] -= 2 * step
            found[i] = (above - f(y)) / (2 * step)
        return found

    expected = differences(energy)
    assert np.abs(expected).max() > 10.0
    assert not effect_gradient(sim, "gas", x).any()  # before a step nothing is known of its pressure
    for _ in range(2):  # all of it in the correction, and in a step that begins with it none
        gradient = wp.zeros(len(x), dtype=wp.vec3, device="cpu")
        term.add_velocity_gradient_in_correction(sim.state, device_vectors(x), gradient)
        found = gradient.numpy() + effect_gradient(sim, "gas", x)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-4 * np.abs(expected).max())
        term.start_step(sim.state)
    assert not gradient.numpy().any()
    assert term.energy(device_vectors(x)) == pytest.approx(energy(x), rel=1e-6)
    slope = differences(lambda y: enclosed_volume(y, closed))
    np.testing.assert_allclose(term.dyad.vector.numpy(), slope, rtol=0, atol=1e-4 * np.abs(slope).max())
    volume = enclosed_volume(x, closed)
    assert term.dyad.stiffness.numpy()[0] == pytest.approx(amount / volume**2, rel=1e-4)


def test_newtons_direction_has_the_dyad(inflated):
    """(A + c w w^T) d = -g, with A's product seen along w, where the dyad is nearly all."""
    _, sim, _ = inflated
    term = contribution(sim, "gas")
    squeezed = 0.99 * sim.cloth_positions()
    sim.state.x.assign(squeezed)
    look_around(sim, near=False)
    solve_newton_system(sim, 200)
    w = term.dyad.vector.numpy().astype(np.float64)
    d = sim.work.direction.numpy().astype(np.float64)
    gauge = AMBIENT * 1.3 * enclosed_volume(icosphere(0.1, 2)[0], sim.scene.garment.faces)
    over = gauge / enclosed_volume(squeezed.astype(np.float64), sim.scene.garment.faces) - 0.9 * AMBIENT
    # the gas gives way until what it had too much is gone: c (w.d) = the pressure that nothing else holds
    given = term.dyad.stiffness.numpy()[0] * (w * d).sum()
    tension = over - given
    assert given > 1000.0
    assert 0 < tension < 0.6 * over
    # a step that begins where another was cut short begins with that: with all of `over` it would be thrown
    term.start_step(sim.state)
    begun = -effect_gradient(sim, "gas", squeezed)
    np.testing.assert_allclose(begun, tension * w[: len(begun)], rtol=0, atol=0.01 * tension * np.abs(w).max())


def test_a_move_of_cloth_that_shuts_in_gas_is_shortened_as_one():
    """A balloon that lies on a floor: what is left of a direction vertex by vertex would squeeze the gas as no force
    asks for."""
    ball, garment = ball_of_cloth()
    floor, triangles = slab(0.6, 0.6, 0.1, 0.05)
    x = ball + [0.0, 0.005 - ball[:, 1].min(), 0.0]
    effects = (Gravity(), AirDrag(), Gas(), BodyContact())
    sim = build(Scene(garment, x, rigid_body(floor, triangles), RUBBER, effects), PRESETS["live"], "cpu", STILL)
    for k in range(12):
        sim.advance(STILL, (k + 1) / 60)
    assert sim.pairs.size > 5
    look_around(sim, near=False)
    solve_newton_system(sim, 60)
    down = sim.work.direction.numpy()
    down[: len(ball)] += [0.0, -1e-2, 0.0]
    sim.work.direction.assign(down)
    sim.region.budget.fill_(1.0)  # else it is the region that shortens them, each by itself
    sim.work.alpha.fill_(1.0)
    prove_free(sim, sim.work.direction)
    share = sim.work.alpha.numpy()[: len(ball)]
    np.testing.assert_allclose(share, share[0], rtol=1e-6)
    assert 0.01 < share[0] < 0.95


@pytest.mark.parametrize("way", [0.02, 0.03, 0.05])
def test_what_follows_cloth_that_shuts_in_gas_stops_where_this_is_stopped(way):
    """A sheet over a balloon over a floor, both on their way down: once the floor has stopped the balloon as one, the
    share of the sheet's way that was free behind it leads into it."""
    ball, shut_in = ball_of_cloth()
    over, lying = sheet(9, 9, 0.16, 0.16)
    floor, triangles = slab(0.6, 0.6, 0.1, 0.05)
    low = ball + [0.0, 0.006 - ball[:, 1].min(), 0.0]
    x = np.vstack([low, lying - lying.mean(axis=0) + [0.0, low[:, 1].max() + 0.006, 0.0]])
    garment = put_together(("balloon", "sheet"), (shut_in, over))
    effects = (Gas(panels=(0,)), BodyContact(), SelfContact())
    nothing_turned = replace(PRESETS["live"], deflection_passes=0)
    sim = build(Scene(garment, x, rigid_body(floor, triangles), RUBBER, effects), nothing_turned, "cpu", STILL)
    down = np.zeros((sim.all_count, 3))
    down[: len(ball), 1] = -0.02
    down[len(ball) : len(x), 1] = -way
    direction = device_vectors(down)
    look_around(sim, near=False)
    solve_newton_system(sim, 60)
    sim.searches = 0
    search_around(sim, sim.state.x, direction)
    began = sim.cloth_positions().astype(np.float64)
    take_within_region(sim, direction)
    ended = sim.cloth_positions().astype(np.float64)
    moved = began[:, 1] - ended[:, 1]
    assert moved[: len(ball)].max() > 1e-3
    assert moved[len(ball) :].max() > 1e-3
    faces = garment.faces
    mesh = ipctk.CollisionMesh(began, ipctk.edges(faces), faces)
    assert ipctk.is_step_collision_free(mesh, *(np.asfortranarray(way) for way in (began, ended)))
    assert not ipctk.has_intersections(mesh, np.asfortranarray(ended))


def test_what_is_turned_aside_gets_back_its_part_of_a_dyad(rng):
    """Along what the dyad's vector is met with, which must be known."""
    w, z, d, aside = (rng.normal(size=(50, 3)) for _ in range(4))
    z *= -np.sign((w * z).sum())
    dyad = Dyad(50, "cpu")
    dyad.vector.assign(w.astype(np.float32))
    direction = device_vectors(d)
    dyad.note(direction)
    direction.assign(aside.astype(np.float32))
    dyad.restore(direction)
    np.testing.assert_array_equal(direction.numpy(), aside.astype(np.float32))  # nothing is known yet

    def solve(_gradient, out):
        out.assign(z.astype(np.float32))

    dyad.respond(solve, device_vectors(np.zeros((50, 3))))
    dyad.restore(direction)
    found = direction.numpy().astype(np.float64)
    assert (w * found).sum() == pytest.approx((w * d).sum(), abs=1e-4)
    assert abs((w * aside).sum() - (w * d).sum()) > 0.1
    along = (found - aside).ravel()
    assert np.linalg.norm(along - (along @ z.ravel()) / (z.ravel() @ z.ravel()) * z.ravel()) < 1e-4


def test_gas_is_checked_by_name():
    garment, x = sheet(3, 3, 0.1, 0.1)
    with pytest.raises(ValueError, match="the piece encloses 0 m"):
        Scene(garment, x, None, RUBBER, (Gas(),))
    turned = x @ np.linalg.qr(np.arange(9.0).reshape(3, 3) ** 2)[0]  # flat, but for rounding
    for normal_up in (turned, turned * [1, 1, -1]):
        with pytest.raises(ValueError, match="give a piece with room in it"):
            Scene(garment, normal_up, None, RUBBER, (Gas(),))
    ball, sim = balloon(Gas())
    inside_out = Garment(
        sim.scene.garment.faces[:, ::-1].copy(),
        sim.scene.garment.uv_corners[:, ::-1] * [-1, 1],
        sim.scene.garment.panel_of_face,
        len(ball),
    )
    with pytest.raises(ValueError, match="counter-clockwise as seen from outside"):
        Scene(inside_out, ball, None, RUBBER, (Gas(),))
    with pytest.raises(ValueError, match="ambient must be a finite number above 0"):
        Gas(ambient=0.0)
    with pytest.raises(ValueError, match="gas: there is no panel 2; the garment has 1"):
        Scene(sim.scene.garment, ball, None, RUBBER, (Gas(panels=(2,)),))
