"""Several pieces of cloth that nothing joins: each keeps the momentum that it has, at the smallest budget."""

import numpy as np
import pytest
from small_scenes import STILL, rigid_body, sheet, slab

from tryon_solver.geometry.garment import Garment
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.scene import BodyContact, Fasteners, Friction, Gravity, Scene, SelfContact
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build

FPS, FRAMES = 30, 12
AROUND = np.array([0.0, 1.0, 0.0])
ALONG = np.array([1.0, 0.0, 0.0])


def several(places):
    """A sheet of 24 cm at each of these places, as one garment, its positions and which vertices are each sheet's."""
    one, x = sheet(13, 13, 0.24, 0.24)
    count, corners = len(x), np.tile(one.uv_corners, (len(places), 1, 1))
    faces = np.concatenate([one.faces + k * count for k in range(len(places))]).astype(np.int32)
    panels = np.repeat(np.arange(len(places), dtype=np.int32), len(one.faces))
    garment = Garment(faces, corners, panels, len(places) * count)
    parts = [slice(k * count, (k + 1) * count) for k in range(len(places))]
    return garment, np.concatenate([x - x.mean(0) + place for place in places]), parts


def played(places, slides, turns, start, effects=()):
    """Sheets on a level floor without friction, each with a velocity along the floor [m/s] and a turn [1/s]: those
    along and around the same after FRAMES frames, (K, 2). Starts differ by less than a ten-thousandth of a gap."""
    garment, x, parts = several(places)
    x = x + np.random.default_rng(start).normal(scale=1e-7, size=x.shape)
    body, faces = slab(2.4, 2.4, 0.02, 0.05)
    given = (Gravity(), BodyContact(), *effects)
    scene = Scene(garment, x, rigid_body(body, faces), FABRICS["cotton_jersey"], given)
    sim = build(scene, PRESETS["draft"], "cpu", STILL)
    v = sim.state.v.numpy()
    for part, slide, turn in zip(parts, slides, turns):
        v[part] = slide * ALONG + np.cross(turn * AROUND, x[part] - x[part].mean(0))
    sim.state.v.assign(v)
    for k in range(FRAMES):
        sim.advance(STILL, (k + 1) / FPS)
    return np.array([along_and_around(sim, part) for part in parts])


def along_and_around(sim, part):
    """Mean velocity along the floor [m/s] and turn [1/s]."""
    r = sim.cloth_positions()[part].astype(np.float64)
    v = sim.state.v.numpy()[part].astype(np.float64)
    r, mean = r - r.mean(0), v.mean(0)
    return mean @ ALONG, np.cross(r, v - mean)[:, 1].sum() / (r[:, [0, 2]] ** 2).sum()


def left_of_turn(turn):
    """What implicit Euler leaves of it."""
    for _ in range(FRAMES):
        turn /= 1 + (turn / FPS) ** 2
    return turn


BESIDE = ([-0.2, 0.0022, 0.0], [0.2, 0.0022, 0.0])
STARTS = range(5)


def test_sheets_that_slide_apart_keep_their_ways():
    """0.8 m/s each; alone a sheet has 0.53 to 0.77 left. Moved all as one, they had 0.07 and 0.19 in the middle of
    twelve starts, in three of which one went backward."""
    found = np.array([played(BESIDE, (-0.8, 0.8), (0.0, 0.0), start) for start in STARTS])[:, :, 0] * [-1, 1]
    assert (np.median(found, axis=0) > 0.55).all(), found
    assert (found > 0.25).all(), found


def test_sheets_that_turn_against_each_other_keep_their_turns():
    """Moved all as one they were not turned, and had a fiftieth left of it."""
    found = np.array([played(BESIDE, (0.0, 0.0), (3.0, -3.0), start) for start in STARTS])[:, :, 1] * [1, -1]
    assert np.median(found, axis=0) == pytest.approx(left_of_turn(3.0), rel=0.12), found


@pytest.mark.parametrize(("slide", "turn"), [(-0.8, 0.0), (0.0, 3.0)])
def test_a_sheet_at_rest_beside_one_that_moves_stays_at_rest(slide, turn):
    """It was taken along at up to 0.5 m/s."""
    for start in STARTS:
        moving, resting = played(BESIDE, (slide, 0.0), (turn, 0.0), start)
        assert max(abs(moving)) > 0.2
        assert abs(resting[0]) < 1e-2, "m/s"
        assert abs(resting[1]) < 1e-1, "1/s"


def test_a_sheet_that_slides_on_another_leaves_it_behind():
    """What lies on each other resists in common, and what is found for all pieces takes that into account: at draft a
    good part of the way the upper one goes, the lower one does not. As one both went alike."""
    above = ([0.0, 0.0022, 0.0], [0.0, 0.0046, 0.0])
    found = np.array([played(above, (0.0, 0.8), (0.0, 0.0), start, (SelfContact(),)) for start in STARTS])[:, :, 0]
    assert np.median(found[:, 1] - found[:, 0]) > 0.2, found


def test_sheets_that_stick_to_each_other_slide_on_together():
    """Friction between them, none on the floor: alone neither may move, and the best of both by itself, shortened for
    both alike, stopped them. Moved all as one, they had 0.1 to 0.6 m/s of 0.8."""
    above = ([0.0, 0.0022, 0.0], [0.0, 0.0046, 0.0])
    table = 0.6 * np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 0.0]])
    effects = (SelfContact(), Friction(static=table))
    found = np.array([played(above, (0.8, 0.8), (0.0, 0.0), start, effects) for start in STARTS])[:, :, 0]
    assert np.median(found, axis=0) == pytest.approx(0.65, abs=0.15), found
    np.testing.assert_allclose(found[:, 0], found[:, 1], atol=0.02)


def test_what_fasteners_join_is_one_piece():
    """Rows of its matrix couple it; by itself neither sheet is free to turn."""
    garment, x, parts = several(BESIDE)
    button = np.array([[parts[0].stop - 1, parts[1].start]], np.int32)
    body, faces = slab(2.4, 2.4, 0.02, 0.05)
    for effects, pieces in (((), 2), ((Fasteners(button, 100.0),), 1)):
        scene = Scene(garment, x, rigid_body(body, faces), FABRICS["denim"], (BodyContact(), *effects))
        sim = build(scene, PRESETS["draft"], "cpu", STILL)
        assert sim.as_one.pieces.count == pieces
