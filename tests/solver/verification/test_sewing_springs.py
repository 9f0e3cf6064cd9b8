"""Sewing and Attached are linear springs: a sheet that hangs by them from another, which is held, sinks until they pull
with its weight."""

import numpy as np
import pytest
from small_scenes import fabric, sheet

from tryon_solver.geometry.garment import Garment
from tryon_solver.scene import Attached, FabricDamping, Gravity, Pins, Scene, Sewing
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build

G = 9.81  # m/s^2
DENSITY = 0.3  # kg/m^2
SIDE, N = 0.12, 7
APART = 0.03  # m, at the start
STIFFNESS = 5.0  # N/m
WEIGHT = DENSITY * SIDE**2 * G
UPPER = np.arange(N * N, dtype=np.int32)
HALF, FLAT = sheet(N, N, SIDE, SIDE)


def heights_at_rest(effect, share=None):
    """(N^2,) m of the vertices above, and of those below."""
    faces = np.vstack([HALF.faces, HALF.faces + N * N]).astype(np.int32)
    panels = np.repeat(np.arange(2, dtype=np.int32), len(HALF.faces))
    both = Garment(faces, np.vstack(2 * [HALF.uv_corners]), panels, 2 * N * N)
    effects = (Gravity((0.0, -G, 0.0)), effect, Pins(UPPER, 1e6), FabricDamping(0.05))
    x = np.vstack([FLAT, FLAT - [0, APART, 0]])
    sim = build(Scene(both, x, None, fabric(areal_density=DENSITY), effects), PRESETS["live"])
    if share is not None:
        next(c for c in sim.plan.contributions if c.name == "sewing").values["share"].fill_(share)
    for k in range(300):
        sim.advance(None, (k + 1) / 60)
    assert np.abs(sim.state.v.numpy()).max() < 1e-4
    return np.split(sim.cloth_positions()[:, 1].astype(np.float64), 2)


@pytest.mark.parametrize("share", [1.0, 0.4, 0.0])
def test_stitches_pull_with_what_is_beyond_their_share_of_the_way(share):
    above, below = heights_at_rest(Sewing(np.column_stack([UPPER, UPPER + N * N]), STIFFNESS), share)
    assert STIFFNESS * (above - below - share * APART).sum() == pytest.approx(WEIGHT, rel=1e-3)


def test_what_is_attached_pulls_with_its_way_from_its_place():
    """At the middles of every other triangle above."""
    onto = HALF.faces[::2].astype(np.int32)
    held = UPPER[: len(onto)]
    above, below = heights_at_rest(Attached(held + N * N, onto, np.full(onto.shape, 1 / 3), STIFFNESS))
    assert STIFFNESS * (above[onto].mean(axis=1) - below[held]).sum() == pytest.approx(WEIGHT, rel=1e-3)
