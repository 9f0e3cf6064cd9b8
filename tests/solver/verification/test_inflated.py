"""Pressure in closed pieces: the membrane's tension is p r/2 in a sphere, p r around a cylinder."""

import numpy as np
import pytest
from effect_terms import contribution
from small_scenes import fabric, flattened, grid_faces, icosphere, sheet

from tryon_solver.geometry.garment import Garment
from tryon_solver.scene import AirDrag, Pins, Pressure, Scene
from tryon_solver.simulation import build

K = 300.0
RUBBER = fabric(k_warp=K, k_weft=K, k_shear=K, k_bend=0.0, strain_limit=3.0)


def at_rest(sim, seconds=2.0):
    for k in range(round(seconds * 60)):
        sim.advance(None, (k + 1) / 60)
    assert np.abs(sim.state.v.numpy()).max() < 1e-3
    return sim.cloth_positions().astype(np.float64)


def balloon(pressure):
    ball, faces = icosphere(0.1, 2)
    projected = ball[faces][:, :, :2]
    garment = Garment(
        faces, flattened(ball, faces), np.zeros(len(faces), np.int32), len(ball), spline_corners=projected
    )
    return ball, build(Scene(garment, ball, None, RUBBER, (AirDrag(20.0), Pressure(pressure))))


@pytest.mark.parametrize("pressure", [400.0, 1000.0])
def test_balloon_grows_until_its_tension_holds_the_pressure(pressure):
    """K |U - I|^2/2 with both stretches s: tension K (s - 1)/s per length of now, and p = 2 T/(s r) by Laplace. A ball
    of triangles has more tension to the pressure by the ratio of volumes to areas: 3 V/(r A) in place of 1."""
    ball, sim = balloon(pressure)
    faces = sim.scene.garment.faces
    a, b, c = (ball[faces[:, k]] for k in range(3))
    volume = (a * np.cross(b, c)).sum() / 6
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    radius = np.linalg.norm(at_rest(sim), axis=1)
    s = radius.mean() / 0.1
    # virtual work of all growing alike: p 3 V s^2 = 2 K A (s - 1)
    assert s > 1.05
    assert pressure * 3 * volume * s**2 == pytest.approx(2 * K * area * (s - 1), rel=0.01)
    assert np.ptp(radius) < 0.03 * radius.mean()


def test_pressure_follows_its_value_and_only_the_panels_named():
    """Two sheets pinned around; the one that is named bulges to the front, and hangs flat again without pressure."""
    garment, x = sheet(7, 7, 0.2, 0.2)
    count = len(x)
    faces = np.vstack([garment.faces, garment.faces + count])
    both = Garment(faces, np.vstack([garment.uv_corners] * 2), np.repeat([0, 1], len(garment.faces)), 2 * count)
    border = np.flatnonzero(np.abs(x[:, [0, 2]]).max(axis=1) > 0.099)
    pins = Pins(np.concatenate([border, border + count]).astype(np.int32))
    scene = Scene(both, np.vstack([x, x + [0, 0.3, 0]]), None, RUBBER, (AirDrag(20.0), pins, Pressure(200.0, (1,))))
    sim = build(scene)
    risen = at_rest(sim, 1.0)[:, 1] - scene.x_start[:, 1]
    assert np.abs(risen[:count]).max() < 1e-6
    assert risen[count:].max() > 5e-3
    contribution(sim, "pressure").values["pressure"].fill_(-200.0)
    for k in range(60, 180):
        sim.advance(None, (k + 1) / 60)
    sunk = sim.cloth_positions()[count:, 1] - scene.x_start[count:, 1]
    np.testing.assert_allclose(sunk, -risen[count:], atol=0.03 * risen.max())


def test_tube_carries_p_r_around():
    """Open ends that nobody pulls: only around, where K (s - 1) = p s r L/L, so s = 1/(1 - p r/K)."""
    columns, rows, radius, pressure = 24, 9, 0.05, 800.0
    turns = 2 * np.pi * np.arange(columns) / columns
    height = np.linspace(0, 0.2, rows)
    x = np.array([[radius * np.sin(t), h, radius * np.cos(t)] for h in height for t in turns])
    faces = grid_faces(columns + 1, rows)
    uv = np.array([[k * 2 * radius * np.sin(np.pi / columns), h] for h in height for k in range(columns + 1)])
    welded = (faces // (columns + 1)) * columns + (faces % (columns + 1)) % columns
    garment = Garment(welded.astype(np.int32), uv[faces], np.zeros(len(faces), np.int32), len(x))
    # pins hold nobody: the pressure's thrust has no total, and the drag takes what is left
    sim = build(Scene(garment, x, None, RUBBER, (AirDrag(20.0), Pressure(pressure))))
    middle = at_rest(sim)[columns * (rows // 2) : columns * (rows // 2 + 1)]
    s = np.linalg.norm(middle[:, [0, 2]], axis=1).mean() / radius
    # of a polygon with n corners the pressure acts on the apothem
    assert s == pytest.approx(1 / (1 - pressure * radius * np.cos(np.pi / columns) / K), rel=0.005)
    assert s > 1.1


def test_pressure_is_checked_by_name():
    garment, x = sheet(3, 3, 0.1, 0.1)
    with pytest.raises(ValueError, match="there is no panel 1; the garment has 1"):
        Scene(garment, x, None, RUBBER, (Pressure(10.0, (1,)),))
    with pytest.raises(ValueError, match="pressure: pressure must be a finite number, not nan"):
        Pressure(float("nan"))
