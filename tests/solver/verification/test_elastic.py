"""Elastic: it pulls with its stiffness times its strain, at most; around a cylinder it presses with the tension over r;
gathers take in what it takes in."""

import numpy as np
import pytest
from effect_terms import contribution
from small_scenes import STILL, fabric, grid_faces, rigid_body, sheet

from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.lines import chain, line_between
from tryon_solver.scene import AirDrag, BodyContact, Elastic, ElasticLine, Pins, Scene
from tryon_solver.simulation import build

SOFT = fabric(k_warp=1e-2, k_weft=1e-2, k_shear=1e-3, k_bend=1e-9)


@pytest.mark.parametrize("ratio", [0.6, 1.1])
def test_stretched_line_pulls_with_stiffness_times_strain(ratio):
    """A line in gauze, ends apart by 1.25 times its length: k (l/L - r) at the pins; the gauze has 1e-3 N."""
    garment, x = sheet(11, 3, 0.2, 0.02)
    middle, stiffness, hold = chain(np.arange(11, 22)), 8.0, 500.0
    ends = np.array([11, 21], np.int32)
    elastic = Elastic((ElasticLine(middle, ratio, stiffness),))
    sim = build(Scene(garment, x, None, SOFT, (AirDrag(2.0), Pins(ends, hold), elastic)))
    places = contribution(sim, "pins").values["places"]
    apart = x[ends] * [1.25, 1, 1]
    places.assign(apart.astype(np.float32))
    for k in range(120):
        sim.advance(None, (k + 1) / 60)
    line = sim.cloth_positions()[11:22, 0].astype(np.float64)
    pull = hold * (line[0] - apart[0, 0])
    strain = (line[-1] - line[0]) / 0.2 - ratio
    assert strain > 0.1
    assert pull == pytest.approx(stiffness * strain, abs=3e-3)
    np.testing.assert_allclose(np.diff(line), (line[-1] - line[0]) / 10, rtol=2e-3)


def test_slack_line_does_nothing():
    garment, x = sheet(5, 3, 0.1, 0.05)
    sim = build(Scene(garment, x, None, SOFT, (Elastic((ElasticLine(chain(np.arange(5, 10)), 1.2, 50.0),)),)))
    for k in range(5):
        sim.advance(None, (k + 1) / 60)
    np.testing.assert_allclose(sim.cloth_positions(), x, rtol=0, atol=1e-7)


def tube_of(radius, columns, rows, height):
    """A tube of gauze about the y axis whose pattern has just its length around."""
    turns = 2 * np.pi * np.arange(columns) / columns
    ring = np.column_stack([np.sin(turns), 0 * turns, np.cos(turns)]) * radius
    side = 2 * radius * np.sin(np.pi / columns)
    levels = np.linspace(-height / 2, height / 2, rows)
    x = np.vstack([ring + [0, y, 0] for y in levels])
    faces = grid_faces(columns + 1, rows)
    uv = np.array([[k * side, y] for y in levels for k in range(columns + 1)])
    welded = (faces // (columns + 1)) * columns + (faces % (columns + 1)) % columns
    return Garment(welded.astype(np.int32), uv[faces], np.zeros(len(faces), np.int32), len(x)), x


def test_band_around_a_cylinder_presses_with_its_tension_over_the_radius():
    """Along the band the cylinder presses back with T/R per length, in all 2 pi T, whatever the radius."""
    radius, ratio, stiffness, columns = 0.1, 0.7, 6.0, 40
    garment, x = tube_of(radius + 0.0035, columns, 3, 0.03)
    band = chain(np.arange(columns, 2 * columns), closed=True)
    cylinder, cylinder_faces = closed_cylinder(radius, 0.1)
    effects = (AirDrag(5.0), BodyContact(), Elastic((ElasticLine(band, ratio, stiffness),)))
    sim = build(Scene(garment, x, rigid_body(cylinder, cylinder_faces), SOFT, effects), None, "cpu", STILL)
    for k in range(60):
        sim.advance(STILL, (k + 1) / 60)
    assert np.abs(sim.state.v.numpy()).max() < 5e-3
    hung = sim.cloth_positions().astype(np.float64)
    ring = hung[columns : 2 * columns]
    side = np.linalg.norm(ring - np.roll(ring, -1, axis=0), axis=1).mean()
    tension = stiffness * (side / (2 * (radius + 0.0035) * np.sin(np.pi / columns)) - ratio)
    count = sim.pairs.size
    slope, normal = -sim.pairs.slope.numpy()[:count], sim.pairs.normal.numpy()[:count]
    pressed = np.zeros(3)
    ids, lam = sim.pairs.ids.numpy()[:count], sim.pairs.lam.numpy()[:count]
    outward = 0.0
    for k in range(4):
        cloth = ids[:, k] < len(x)
        at = hung[ids[cloth, k]]
        radial = at[:, [0, 2]] / np.linalg.norm(at[:, [0, 2]], axis=1, keepdims=True)
        force = (slope * lam[:, k])[cloth, None] * normal[cloth]
        outward += (force[:, [0, 2]] * radial).sum()
        pressed += force.sum(0)
    assert tension > 1.0
    # a ring of straight sides: 2 T sin(pi/n) at each of n corners
    assert outward == pytest.approx(2 * tension * columns * np.sin(np.pi / columns), rel=0.02)
    assert np.abs(pressed).max() < 0.02 * outward


def closed_cylinder(radius, height):
    import trimesh

    mesh = trimesh.creation.cylinder(radius=radius, height=height, sections=96)
    mesh = mesh.subdivide_to_size(0.03)
    vertices = np.array(mesh.vertices)[:, [1, 2, 0]]
    return vertices, np.array(mesh.faces, np.int32)


def test_shirring_gathers_to_its_ratio_and_lets_go_by_its_value():
    """Threads take a free sheet in. The cloth pushes back with at most its stiffness times the thread's share of the
    height, k h/3 (1 - s), and less where it buckles: k_t (s - r) is between that and none. At ratio 1 it lies flat."""
    garment, x = sheet(13, 9, 0.24, 0.16)
    x = x + np.column_stack([0 * x[:, 0], 1e-3 * np.cos(60 * x[:, 0]), 0 * x[:, 0]])
    cloth = fabric(k_warp=40.0, k_weft=40.0, k_shear=10.0, k_bend=1e-7)
    lines = tuple(ElasticLine(line_between(garment, 13 * r, 13 * r + 12), 0.7, 60.0) for r in (2, 4, 6))
    sim = build(Scene(garment, x, None, cloth, (AirDrag(3.0), Elastic(lines))))

    def wide():
        row = sim.cloth_positions()[13 * 4 : 13 * 5]
        return np.linalg.norm(np.diff(row, axis=0), axis=1).sum() / 0.24

    for k in range(60):
        sim.advance(None, (k + 1) / 60)
    resisting = 40.0 * 0.16 / 3
    assert 0.7 < wide() < (60 * 0.7 + resisting) / (60 + resisting)
    contribution(sim, "elastic").values["ratio"].fill_(1.0)
    for k in range(60, 150):
        sim.advance(None, (k + 1) / 60)
    assert wide() == pytest.approx(1.0, abs=0.01)


def test_elastic_is_checked_by_name():
    garment, x = sheet(3, 3, 0.1, 0.1)
    with pytest.raises(ValueError, match="elastic: ratio must be a finite number above 0"):
        ElasticLine(chain(np.arange(3)), 0.0, 1.0)
    with pytest.raises(ValueError, match="elastic: edges 0 and 2 are both 0-1; list each edge once"):
        ElasticLine(np.array([[0, 1], [1, 2], [1, 0]], np.int32), 0.5, 1.0)
    line = ElasticLine(np.array([[0, 8]], np.int32), 0.5, 1.0)
    with pytest.raises(ValueError, match="elastic: line 0: no triangle has the edge 0-8"):
        Scene(garment, x, None, SOFT, (Elastic((line,)),))
