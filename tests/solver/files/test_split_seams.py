"""A seam whose two sides have different vertices is sewn, or told."""

import numpy as np
import pytest

from tryon_solver.files.convention import Convention
from tryon_solver.files.mesh_garment import make_garment
from tryon_solver.files.obj import parse_obj
from tryon_solver.geometry.boundary_loops import boundary_loops
from tryon_solver.geometry.surface_repair import open_edges

METRES = Convention("m", "y", "in a test")
TALL, WIDE = 0.48, 0.2


def sheet(rows, x0, x1, bend=0.0):
    """A sheet from x0 to x1 with `rows` rows of two cells, its sides bent out of its plane."""
    y = np.linspace(0, TALL, rows + 1)
    vertices = [(x, v, bend * np.sin(np.pi * v / TALL)) for v in y for x in np.linspace(x0, x1, 3)]
    cells = [[3 * r + c, 3 * r + c + 1, 3 * r + c + 4, 3 * r + c + 3] for r in range(rows) for c in range(2)]
    return np.array(vertices), cells


def two(rows, others, gap=5e-5, bend=0.0):
    """Two sheets side by side as a file's mesh, its pattern as texture coordinates."""
    (x, cells), (y, more) = sheet(rows, 0, WIDE, bend), sheet(others, WIDE + gap, 2 * WIDE, bend)
    both = np.vstack([x, y])
    text = [f"v {a} {b} {c}\nvt {a} {b}" for a, b, c in both.tolist()]
    faces = [*cells, *(np.array(more) + len(x)).tolist()]
    return parse_obj("\n".join(text + ["f " + " ".join(f"{v + 1}/{v + 1}" for v in f) for f in faces]), "cloth.obj")


@pytest.mark.parametrize(("rows", "others", "on_edges"), [(16, 32, 16), (16, 17, 31), (3, 16, 17), (1, 7, 6)])
@pytest.mark.parametrize("bend", [0.0, 2e-3])
def test_a_seam_of_different_vertices_on_its_sides_is_sewn(rows, others, on_edges, bend):
    bend = bend if rows > 3 else 0.0
    raw = two(rows, others, bend=bend)
    garment = make_garment(raw, METRES)
    faces = garment.garment.faces
    (loop,) = boundary_loops(faces)
    assert len(loop) == len(open_edges(faces)[0]) == rows + others + 8
    inner = np.abs(garment.x[open_edges(faces)[0]].mean(axis=1)[:, 0] - WIDE) < 1e-3
    assert not inner.any()
    (note,) = [note for note in garment.notes if "sides of its seams" in note]
    assert f"{on_edges} that lie on edges of the other side are sewn to them" in note
    assert "cloth.obj, lines" in note or rows == 1
    assert not any("left open" in note for note in garment.notes)


def test_its_fabric_stays_as_large_and_its_pattern_where_it_was():
    raw = two(16, 17)
    garment = make_garment(raw, METRES, "pattern").garment
    a, b = (garment.uv_corners[:, k] - garment.uv_corners[:, 0] for k in (1, 2))
    areas = 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    assert areas.min() > 1e-6
    np.testing.assert_allclose(areas.sum(), 2 * WIDE * TALL - 5e-5 * TALL, rtol=1e-6)


def test_sides_further_apart_are_told_with_their_number():
    garment = make_garment(two(16, 32, 2e-3), METRES)
    assert len(garment.x) == 17 * 3 + 33 * 3
    (note,) = [note for note in garment.notes if "left open" in note]
    assert note.startswith("33 vertices of open edges lie up to 2 mm from others along them")
    assert not any("left open" in note for note in make_garment(two(16, 32, 2e-2), METRES).notes)


def test_what_only_touches_an_edge_is_not_sewn_to_it():
    """A corner on another sheet's edge shares no piece of it."""
    x, cells = sheet(2, 0, WIDE)
    corner = np.array([[WIDE, 0.1, 0.0], [WIDE + 0.1, 0.05, 0.0], [WIDE + 0.1, 0.15, 0.0]])
    text = ["v {} {} {}".format(*v) for v in np.vstack([x, corner])]
    faces = [*cells, [9, 10, 11]]
    text += ["f " + " ".join(str(v + 1) for v in face) for face in faces]
    garment = make_garment(parse_obj("\n".join(text), "cloth.obj"), METRES)
    assert len(garment.garment.faces) == 9
    assert not any("seam" in note for note in garment.notes)
