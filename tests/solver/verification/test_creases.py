"""Creases: what is not loaded rests at the angle that was pressed into it."""

import numpy as np
import pytest
from effect_terms import contribution
from small_scenes import fabric, sheet

from tryon_solver.geometry.lines import line_between
from tryon_solver.scene import SHARPEST_CREASE, AirDrag, Creases, Pins, Scene
from tryon_solver.simulation import build

WOOL = fabric(k_bend=4e-5)


def strip(*columns):
    """A strip of 13 x 4 vertices along x, and the edges of the named columns."""
    garment, x = sheet(13, 4, 0.24, 0.06)
    return garment, x, [line_between(garment, c, c + 13 * 3) for c in columns]


def normals(sim):
    x = sim.cloth_positions().astype(np.float64)
    a, b, c = (x[sim.scene.garment.faces[:, k]] for k in range(3))
    n = np.cross(b - a, c - a)
    return n / np.linalg.norm(n, axis=1, keepdims=True), (a + b + c) / 3


def at_rest(sim, begun, seconds):
    for k in range(round(60 * seconds)):
        sim.advance(None, begun + (k + 1) / 60)
    assert np.abs(sim.state.v.numpy()).max() < 1e-3


def fold(sim, edge):
    """The angle between the normals left and right of a column [rad], above 0 where the middle is a ridge."""
    n, _ = normals(sim)
    flat = sim.scene.garment.uv_corners.mean(axis=1)[:, 0]
    left, right = n[(flat < edge) & (flat > edge - 0.04)].mean(0), n[(flat > edge) & (flat < edge + 0.04)].mean(0)
    axis = np.array([0.0, 0.0, 1.0])
    return np.arctan2(np.cross(right, left) @ axis, left @ right)


@pytest.mark.parametrize("angle", [1.0, -1.0, 2.0])
def test_strip_rests_at_the_angle(angle):
    """Both halves flat, the fold the angle: there membrane, bending and crease have no energy. The middle is held in
    the plane, so that a strip that is free does not turn."""
    garment, x, (middle,) = strip(6)
    held = Pins(np.unique(middle).astype(np.int32))
    effects = (AirDrag(0.5), held, Creases(middle, np.full(len(middle), angle)))
    sim = build(Scene(garment, x, None, WOOL, effects))
    at_rest(sim, 0.0, 5)
    assert fold(sim, 0.0) == pytest.approx(angle, rel=5e-3)
    together = sum(c.energy(sim.state.x) for c in sim.plan.contributions if c.name in ("bending", "creases"))
    stored = contribution(sim, "bending").energy(sim.state.x)
    assert stored > 1e-6
    assert abs(together) < 1e-3 * stored


def test_pleats_go_up_and_down_and_open_when_the_value_says_so():
    garment, x, columns = strip(3, 6, 9)
    angles = np.repeat([1.2, -1.2, 1.2], [len(c) for c in columns])
    held = Pins(np.unique(columns[1]).astype(np.int32))
    sim = build(Scene(garment, x, None, WOOL, (AirDrag(0.5), held, Creases(np.vstack(columns), angles))))
    at_rest(sim, 0.0, 4)
    found = [fold(sim, edge) for edge in (-0.06, 0.0, 0.06)]
    np.testing.assert_allclose(found, [1.2, -1.2, 1.2], rtol=0.02)
    contribution(sim, "creases").values["angles"].zero_()
    at_rest(sim, 4.0, 4)
    assert np.abs([fold(sim, edge) for edge in (-0.06, 0.0, 0.06)]).max() < 0.02


def test_creases_are_checked_by_name():
    garment, x, (middle,) = strip(6)
    with pytest.raises(ValueError, match="no fold is sharper than"):
        Creases(middle, np.full(len(middle), SHARPEST_CREASE + 0.1))
    with pytest.raises(ValueError, match="3 edges, but angles of shape"):
        Creases(middle, np.zeros(2))
    for again in (middle, middle[:, ::-1]):
        with pytest.raises(ValueError, match="creases: edges 0 and 3 are both 6-19; list each edge once"):
            Creases(np.vstack([middle, again]), np.full(2 * len(middle), 1.0))
    border = Creases(np.array([[0, 1]], np.int32), np.ones(1))
    with pytest.raises(ValueError, match="creases: no two triangles share the edge 0-1"):
        Scene(garment, x, None, WOOL, (border,))
