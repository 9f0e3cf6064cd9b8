"""The worked example of docs/effects.md: an effect from outside the package does what it says, and is printed there."""

from pathlib import Path

import numpy as np
import pytest
from hem_weights import HemWeights
from small_scenes import fabric, sheet

from tryon_solver.scene import AirDrag, Gravity, Pins, Scene
from tryon_solver.simulation import build

G, DT = 9.81, 1 / 60
ROOT = Path(__file__).parents[2]


def hung(*effects):
    """A strip that hangs by its upper end, and the vertices of its lower."""
    garment, flat = sheet(5, 13, 0.08, 0.24)
    x = np.column_stack([flat[:, 0], -flat[:, 2], 0 * flat[:, 0]])
    cloth = fabric(areal_density=0.2, k_warp=600.0, k_weft=200.0, k_shear=60.0, strain_limit=3.0)
    top = np.flatnonzero(x[:, 1] > 0.119).astype(np.int32)
    low = np.flatnonzero(x[:, 1] < -0.119).astype(np.int32)
    return x, low, lambda *more: build(Scene(garment, x, None, cloth, (Gravity(), *effects, Pins(top, 1e5), *more)))


def test_weights_in_a_hem_stretch_what_they_hang_from():
    """On top of what the cloth's own weight does, m g L/(k w)."""
    x, low, made = hung(AirDrag(3.0))
    sunk = []
    for mass in (0.0, 0.03):
        sim = made(HemWeights(low, np.full(len(low), mass / len(low))))
        for k in range(120):
            sim.advance(None, (k + 1) * DT)
        sunk.append((x - sim.cloth_positions())[low, 1].mean())
    assert sunk[1] - sunk[0] == pytest.approx(0.03 * G * 0.24 / (200.0 * 0.08), rel=0.02)


def test_weights_fall_with_the_cloth_that_they_are_on():
    """Free fall is implicit Euler's, the weights do not strain the cloth."""
    garment, x = sheet(5, 5, 0.2, 0.2)
    sim = build(Scene(garment, x, None, fabric(), (Gravity(), HemWeights(np.array([0, 12]), np.array([0.01, 0.02])))))
    for k in range(20):
        sim.advance(None, (k + 1) * DT)
    np.testing.assert_allclose(sim.state.v.numpy(), np.tile([0, -G * 20 * DT, 0], (25, 1)), atol=2e-3)


def test_the_effect_is_in_the_plan_where_it_says_and_nowhere_without_weight():
    _, low, made = hung()
    plan = made(HemWeights(low, np.full(len(low), 0.01))).plan.describe()
    stages = dict(line.split(": ") for line in plan.splitlines())
    assert "hem_weights" in stages["add_velocity_gradient"]
    assert "hem_weights" in stages["diagonal"]
    without = made(HemWeights(low, np.zeros(len(low)))).plan
    assert "hem_weights" not in [contribution.name for contribution in without.contributions]
    for vertex in (99, -1):
        with pytest.raises(ValueError, match=f"there is no vertex {vertex}"):
            made(HemWeights(np.array([vertex]), np.ones(1)))
    for mass, said in ((-1.0, "mass 0 is -1.0 kg"), (np.nan, r"masses is nan at \[0\]"), (np.inf, "masses is inf")):
        with pytest.raises(ValueError, match=said):
            made(HemWeights(low[:1], np.array([mass])))
    with pytest.raises(ValueError, match="masses is an array of float64 of shape"):
        HemWeights(low, np.ones(1))


@pytest.mark.parametrize("name", ["hem_weights.py", "hem_weights_word.py"])
def test_the_page_prints_these_files(name):
    assert (ROOT / "tests/examples" / name).read_text() in (ROOT / "docs/effects.md").read_text()
