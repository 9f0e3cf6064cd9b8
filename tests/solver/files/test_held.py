"""Each piece of a garment that goes around nothing is told of."""

import numpy as np
import pytest
from sample_garments import FULL_SKIRT, SKIN, WORN, tube

from tryon_solver.files.convention import Told
from tryon_solver.files.garment_file import read_garment
from tryon_solver.files.held import GOES_AROUND_NOTHING


def written(*parts):
    """An OBJ of the named parts (name, vertices, faces)."""
    lines, before = [], 0
    for name, vertices, faces in parts:
        lines += [f"o {name}", *("v {} {} {}".format(*v) for v in vertices.tolist())]
        lines += ["f " + " ".join(str(k + 1 + before) for k in face) for face in faces.tolist()]
        before += len(vertices)
    return "\n".join(lines).encode()


def notes(*parts):
    return read_garment(written(*parts), "skirt.obj", SKIN, Told("m", "y")).notes


def button(y):
    """A closed octahedron in front of the belly."""
    x = 0.01 * np.concatenate([np.eye(3), -np.eye(3)]) + [0, y, 0.35]
    around = [0, 1, 3, 4]
    sides = [(around[k], around[(k + 1) % 4]) for k in range(4)]
    return x, np.array([(a, b, 2) for a, b in sides] + [(b, a, 5) for a, b in sides])


def test_loose_buttons_of_a_skirt_are_named_and_counted():
    skirt = ("skirt", *tube(*FULL_SKIRT))
    (note,) = [n for n in notes(skirt, ("upper", *button(0.95)), ("lower", *button(0.85))) if "around nothing" in n]
    assert note.startswith("2 of the 3 pieces it consists of are joined to no other and go around nothing ('upper', ")
    assert "'lower', skirt.obj, lines" in note
    assert not any("nothing" in n for n in notes(skirt))


def test_two_halves_that_nothing_joins_go_around_nothing():
    x, faces = tube(*FULL_SKIRT)
    front = x[faces][:, :, 2].mean(axis=1) > np.median(x[:, 2])
    parts = []
    for name, mine, shift in (("front", front, 0.02), ("back", ~front, 0.0)):
        ids, own = np.unique(faces[mine], return_inverse=True)
        parts.append((name, x[ids] + [0, 0, shift], own.reshape(-1, 3)))
    note = notes(*parts)[-1]
    assert note.startswith(GOES_AROUND_NOTHING)
    assert "it is 2 pieces that nothing joins ('front'" in note


@pytest.mark.parametrize("what", WORN)
def test_what_is_worn_is_held_but_for_a_sheet_on_the_back(what):
    told = GOES_AROUND_NOTHING in notes((what.replace(" ", "_"), *WORN[what]))
    assert told == (what == "a cape")


def test_a_layer_that_is_there_twice_is_taken_once_and_told():
    x, faces = tube(*FULL_SKIRT)
    garment = read_garment(written(("a", x, faces), ("b", x, faces)), "skirt.obj", SKIN, Told("m", "y"))
    assert len(garment.x) == len(x)
    assert len(garment.garment.faces) == len(faces)
    (note,) = [note for note in garment.notes if "twice" in note]
    assert note.startswith(f"{len(faces)} triangles lie exactly on others: what is there twice is taken once (skirt.")
    assert not any("around nothing" in note or "goes around" in note for note in garment.notes)
