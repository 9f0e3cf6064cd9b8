"""Garments of the demo with elastic in their waist are put on where they hang by themselves."""

from dataclasses import replace

import numpy as np
import pytest
from worn_garment import DEMO

from tryon_solver.body.model import default_body
from tryon_solver.dressing.dress import dress
from tryon_solver.dressing.hang import LONGEST, hang
from tryon_solver.dressing.holding import NOTHING, holding
from tryon_solver.effect_words.table import live
from tryon_solver.geometry.boundary_loops import boundary_loops
from tryon_solver.geometry.named_lines import Cut
from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import load_pattern
from tryon_solver.geometry.weld import weld
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.settings import PRESETS
from tryon_solver.worn_effects import effects_of

DRAWN = 1.07  # m, both waists over the floor


def put_on(name):
    """The garment of jersey, with what its edges carry, in a coarse mesh."""
    pattern = load_pattern(DEMO / "patterns" / f"{name}.json")
    panels = mesh_pattern(pattern, 0.05)
    welded, counts = weld(panels), tuple(len(panel.edges) for panel in pattern.panels)
    effects = effects_of({**live(), **pattern.effects}, Cut.of_pattern(welded.garment(), panels, welded, counts))
    return dress(panels, default_body(), FABRICS["cotton_jersey"], PRESETS["draft"], effects=effects)


def waist_height(dressed):
    """m, mean over the highest opening."""
    sim = dressed.simulation
    height = sim.cloth_positions()[:, 1].astype(np.float64)
    return max(float(height[loop].mean()) for loop in boundary_loops(sim.scene.garment.faces))


def rubs_not(sim):
    """Take all friction away."""
    next(c for c in sim.plan.contributions if c.name == "friction").values["coefficients"].zero_()
    sim.wake()


@pytest.mark.parametrize("name", ["trousers", "skirt"])
def test_what_hangs_by_its_waist_is_where_it_needs_no_friction_to_stay(name):
    """Sewn on, both waists are 2 to 4 cm too high: there friction held them, until their wearer walked."""
    dressed = put_on(name)
    sim, height = dressed.simulation, waist_height(dressed)
    assert height == pytest.approx(DRAWN, abs=0.015)
    rubs_not(sim)
    for _ in range(round(1.0 / sim.settings.largest_step)):
        sim.advance(dressed.pose, sim.state.time + sim.settings.largest_step)
    assert waist_height(dressed) == pytest.approx(height, abs=0.002)


def test_what_does_not_hold_at_its_waist_is_left_where_it_is():
    """One without elastic, one that shoulders hold, one too wide for the body, and one that ends below the hips."""
    dressed = put_on("skirt")
    sim, opening = dressed.simulation, dressed.upper_opening()
    friction = next(c for c in sim.plan.contributions if c.name == "friction").values["coefficients"]
    before = friction.numpy().copy()
    time, held = sim.state.time, holding(sim.scene.effects, sim.scene.garment, sim.scene.fabric)
    hang(sim, dressed.pose, opening, NOTHING)
    for other in (None, replace(opening, girth=opening.body_girth + 0.02), replace(opening, height=0.7)):
        hang(sim, dressed.pose, other, held)
    assert sim.state.time == time
    hang(sim, dressed.pose, opening, held)
    assert time < sim.state.time <= time + LONGEST
    assert np.array_equal(friction.numpy(), before)
