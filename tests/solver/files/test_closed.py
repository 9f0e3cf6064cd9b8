"""Closed surfaces: cloth that was given a thickness is taken as the cloth it was, a person is none."""

import re

import numpy as np
import pytest
from sample_garments import SKIN, WORN, tube

from tryon_solver.body import default_body
from tryon_solver.files.convention import Convention, Told
from tryon_solver.files.garment_file import read_garment
from tryon_solver.files.mesh_garment import make_garment
from tryon_solver.files.obj import parse_obj
from tryon_solver.files.raw_mesh import MeshFileError
from tryon_solver.geometry.surface_repair import open_edges

METRES = Convention("m", "y", "in a test")
TUBE = tube(0.17, 0.24, 1.06, 0.66)


def obj(*parts):
    """Text of parts: name, vertices, polygons."""
    lines, count = [], 0
    for name, x, cells in parts:
        lines += [f"o {name}" if name else "", *("v {} {} {}".format(*p) for p in x)]
        lines += ["f " + " ".join(str(v + 1 + count) for v in cell) for cell in cells]
        count += len(x)
    return "\n".join(lines)


def normals(x, faces):
    across = np.cross(x[faces[:, 1]] - x[faces[:, 0]], x[faces[:, 2]] - x[faces[:, 0]])
    total = np.stack([np.bincount(faces.ravel(), across[:, k].repeat(3), len(x)) for k in range(3)], axis=1)
    return total / np.linalg.norm(total, axis=1, keepdims=True)


def thick(x, faces, thickness, rims=True):
    """As a Solidify modifier leaves it: the same surface again, behind it, turned over and joined at the rims."""
    inner = x - thickness * normals(x, faces)
    cells = [*faces.tolist(), *(faces[:, ::-1] + len(x)).tolist()]
    edges, owner = open_edges(faces)
    for (a, b), face in zip(edges.tolist(), owner.tolist()):
        corners = faces[face].tolist()
        if corners[(corners.index(a) + 1) % 3] != b:
            a, b = b, a
        cells += [[b, a, a + len(x), b + len(x)]] * rims
    return np.vstack([x, inner]), cells


@pytest.mark.parametrize("thickness", [0.002, *(pytest.param(t, marks=pytest.mark.long) for t in (0.001, 0.005, 0.01))])
def test_of_cloth_with_a_thickness_the_outer_surface_is_taken(thickness):
    x, faces = TUBE
    for turned in (1, -1):
        both, cells = thick(x, faces, thickness)
        garment = make_garment(parse_obj(obj(("skirt", both, [cell[::turned] for cell in cells])), "skirt.obj"), METRES)
        assert len(garment.garment.faces) == len(faces)
        assert garment.garment.signed_areas().sum() == pytest.approx(make_garment_of(x, faces).signed_areas().sum())
        (note,) = [note for note in garment.notes if "thickness" in note]
        found = re.match(r"its part 'skirt' has a thickness of about ([\d.]+) mm: only the outer surface", note)
        assert float(found[1]) == pytest.approx(1e3 * thickness, rel=0.05)
        assert "Solidify" in note


def make_garment_of(x, faces):
    return make_garment(parse_obj(obj(("", x, faces)), "a.obj"), METRES).garment


def test_trousers_with_a_thickness_are_trousers_with_three_openings():
    x, faces = WORN["trousers"]
    both, cells = thick(x, faces, 0.002)
    garment = read_garment(obj(("", both, cells)).encode(), "a.obj", SKIN, Told("m", "y"))
    assert len(garment.garment.faces) == len(faces)
    assert garment.x[:, 2].max() == pytest.approx(x[:, 2].max(), abs=1e-3)
    assert not any("goes around" in note for note in garment.notes)


def test_a_pattern_goes_with_the_surface_that_is_taken():
    x, faces = TUBE
    both, cells = thick(x, faces, 0.002)
    text = obj(("", both, cells)) + "".join("\nvt {} {}".format(*p[:2]) for p in both)
    lines = sorted(text.split("\n"), key=lambda line: line.startswith("f "))
    text = "\n".join(re.sub(r"(\d+)", r"\1/\1", line) if line.startswith("f ") else line for line in lines)
    raw = parse_obj(text, "a.obj")
    assert make_garment(raw, METRES).source.uv.shape == (len(faces), 3, 2)


def test_two_layers_that_nothing_joins_stay_two():
    x, faces = TUBE
    garment = make_garment(parse_obj(obj(("", *thick(x, faces, 0.002, rims=False))), "a.obj"), METRES)
    assert len(garment.garment.faces) == 2 * len(faces)
    assert not any("thickness" in note for note in garment.notes)


@pytest.mark.parametrize("what", ["tights", "a hat", "a sock", "an open vest", "a cape", "a gown"])
def test_what_has_an_opening_is_left_as_it_is(what):
    x, faces = WORN[what]
    assert len(make_garment_of(x, faces).faces) == len(faces)


def other_person(cut=None):
    """Somebody of another figure than the default body's, perhaps with a mouth."""
    body = default_body()
    x = SKIN * [1.06, 1.03, 1.04] + [0.0, 0.0, 0.005]
    keep = np.ones(len(body.faces), bool)
    if cut is not None:
        middle = x[body.faces].mean(axis=1)
        at = x[np.argmax(np.where(np.abs(x[:, 1] - 1.6) < 0.02, x[:, 2], -1.0))]
        keep = np.linalg.norm(middle - at, axis=1) > cut
    return x, body.faces[keep]


@pytest.mark.parametrize("mouth", [None, pytest.param(0.025, marks=pytest.mark.long)])
def test_a_person_beside_the_garment_is_refused_by_name_also_where_it_is_not_the_body(mouth):
    person = ("Avatar", *other_person(mouth))
    skirt = ("Skirt", *TUBE)
    for parts in ([skirt, person], [person]):
        with pytest.raises(MeshFileError, match=r"its part 'Avatar' has no opening.* encloses 7\d litres") as caught:
            read_garment(obj(*parts).encode(), "scene.obj", SKIN, Told("m", "y"))
        assert caught.value.place.startswith("scene.obj, lines")
        assert "Export the garment alone" in caught.value.remedy
    assert read_garment(obj(skirt).encode(), "scene.obj", SKIN, Told("m", "y")).piece_names[0].startswith("Skirt")


def test_a_small_closed_thing_beside_the_garment_is_no_person():
    """A button, as a closed lens."""
    corners = np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 0.4], [0, 0, -0.4]])
    cells = [[k, (k + 1) % 4, 4] for k in range(4)] + [[(k + 1) % 4, k, 5] for k in range(4)]
    text = obj(("skirt", *TUBE), ("button", 0.01 * corners + [0.0, 0.9, 0.27], cells))
    assert len(make_garment(parse_obj(text, "a.obj"), METRES).garment.faces) == len(TUBE[1]) + 8
