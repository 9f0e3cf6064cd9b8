"""Where the correction begins: friction has the normal forces of that place, whatever was tried before."""

import numpy as np
from small_scenes import STILL, fabric, icosphere, rigid_body, sheet

from tryon_solver.scene import WORN, Scene
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build
from tryon_solver.stepping import correct

DT = 1 / 30


def test_who_goes_back_to_the_feasible_start_has_its_friction(monkeypatch):
    """A sheet that swings on a ball: where its trial left contacts, their friction must not be lost."""
    garment, x = sheet(15, 15, 0.5, 0.5)
    ball, faces = icosphere(0.17, 3)
    scene = Scene(garment, x + np.array([0, 0.174, 0]), rigid_body(ball, faces), fabric(), WORN)
    sim = build(scene, PRESETS["draft"], "cpu", STILL)
    (term,) = sim.stages.contact
    seen, find_direction = [], correct.find_direction

    def watched(sim, budget):
        if sim.pairs.size and np.array_equal(sim.state.x.numpy(), sim.state.x_feasible.numpy()):
            found = term.tangential(sim.pairs)
            term.prepare(sim.pairs, sim.state, sim.state.x, sim.state.x)  # nothing lies before
            np.testing.assert_allclose(found, term.tangential(sim.pairs), rtol=1e-6)
            seen.append(found.sum())
        find_direction(sim, budget)

    monkeypatch.setattr(correct, "find_direction", watched)
    for k in range(1, 41):
        sim.advance(STILL, k * DT)
    assert len(seen) > 5
    assert min(seen) > 0.1
