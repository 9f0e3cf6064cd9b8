"""A step that an error ends leaves the garment where it began, and what follows is as free as ever."""

import ipctk
import numpy as np
import pytest
from small_scenes import STILL, fabric, folded_sheet, icosphere, rigid_body, sheet

from tryon_solver.contact import found
from tryon_solver.scene import BodyContact, Gravity, Pins, Scene, SelfContact
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build
from tryon_solver.stepping import correct, search


def folded():
    """A sheet folded over itself, 7.2 mm apart, its lower layer pinned, that has been at rest for three steps."""
    garment, x, layer = folded_sheet(7.2e-3)
    pins = Pins(np.flatnonzero(layer == 0).astype(np.int32), 1e3)
    sim = build(Scene(garment, x, None, fabric(), (pins, SelfContact())), PRESETS["live"], "cpu")
    for k in range(3):
        sim.advance(None, (k + 1) / 60)
    return sim, layer == 2


@pytest.mark.parametrize(("most", "list_age"), [(1000, 0), (-1, search.LONGEST_SERVED)])
def test_a_list_whose_search_was_cut_off_is_not_gone_by(monkeypatch, most, list_age):
    """There is no room for what the search of one step finds, by `extend` and by `find`; in the next steps there is."""
    sim, upper = folded()
    thrown = np.zeros((len(upper), 3), np.float32)
    thrown[upper, 1] = -1.5
    sim.state.v.assign(thrown)
    sim.list_age = max(sim.list_age, list_age)
    faces = sim.scene.garment.faces
    began = sim.cloth_positions().astype(np.float64)
    mesh = ipctk.CollisionMesh(began, ipctk.edges(faces), faces)
    with monkeypatch.context() as crowded:
        crowded.setattr(found, "MOST", most)
        with pytest.raises(found.CrowdedError):
            sim.advance(None, 4 / 60)
    np.testing.assert_array_equal(sim.cloth_positions(), began)
    for k in range(4, 8):
        sim.advance(None, k / 60)
        ended = sim.cloth_positions().astype(np.float64)
        assert ipctk.is_step_collision_free(mesh, *(np.asfortranarray(one) for one in (began, ended)))
        began = ended
    assert np.abs(ended - sim.scene.x_start).max() > 4e-3


def test_a_trial_that_nothing_has_proven_is_not_where_the_next_step_begins(monkeypatch):
    """An error after the trial of a sheet that falls fast on a ball."""
    garment, x = sheet(9, 9, 0.2, 0.2)
    x[:, 1] += 0.105
    ball, faces = icosphere(0.1, 2)
    scene = Scene(garment, x, rigid_body(ball, faces), fabric(), (Gravity(), BodyContact()))
    sim = build(scene, PRESETS["live"], "cpu", STILL)
    sim.state.v.fill_((0.0, -4.0, 0.0))

    def fail(_sim):
        raise MemoryError("no room")

    with monkeypatch.context() as broken:
        broken.setattr(correct, "way_to_trial", fail)
        with pytest.raises(MemoryError):
            sim.advance(STILL, 1 / 60)
    np.testing.assert_array_equal(sim.cloth_positions(), x.astype(np.float32))
    both = np.vstack([garment.faces, faces + len(x)])
    began = np.vstack([x, sim.body_positions()]).astype(np.float64)
    mesh = ipctk.CollisionMesh(began, ipctk.edges(both), both)
    for k in range(6):
        sim.advance(STILL, (k + 1) / 60)
        ended = np.vstack([sim.cloth_positions(), sim.body_positions()]).astype(np.float64)
        assert not ipctk.has_intersections(mesh, np.asfortranarray(ended))
    assert ended[: len(x), 1].min() < 0.095
