"""From a stranger's mesh to a garment: welding, turning, rest shapes, stitches, and what is refused."""

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from tryon_solver.body import default_body
from tryon_solver.dressing.dress_mesh import sewing_seconds
from tryon_solver.files.convention import Convention, Told
from tryon_solver.files.garment_file import is_mesh, read_garment
from tryon_solver.files.gltf import parse_glb
from tryon_solver.files.mesh_garment import make_garment
from tryon_solver.files.obj import parse_obj
from tryon_solver.files.raw_mesh import MeshFileError
from tryon_solver.subspace.basis import spline_basis

METRES = Convention("m", "y", "in a test")


def obj(vertices, faces, uv=None, lines=()):
    text = ["v {} {} {}".format(*v) for v in vertices]
    if uv is not None:
        text += ["vt {} {}".format(*t) for t in uv]
        text += ["f " + " ".join(f"{v + 1}/{v + 1}" for v in face) for face in faces]
    else:
        text += ["f " + " ".join(str(v + 1) for v in face) for face in faces]
    text += [f"l {a + 1} {b + 1}" for a, b in lines]
    return parse_obj("\n".join(text), "cloth.obj")


GRID = np.array([[0.1 * i, 0.1 * j, 0.0] for j in range(3) for i in range(3)])
CELLS = [[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]]


@pytest.fixture(scope="module")
def skirt(strangers, tmp_path_factory):
    path = tmp_path_factory.mktemp("skirt") / "skirt.obj"
    strangers.write_skirt(path)
    return read_garment(path.read_bytes(), path.name, default_body().rest_vertices, Told())


def test_the_skirt_is_welded_on_one_side_and_stitched_on_the_other(strangers, skirt):
    rows = strangers.ROWS + 1
    assert len(skirt.x) == 2 * rows * (strangers.COLUMNS + 1) - rows
    assert len(skirt.stitches) == rows
    gap = np.linalg.norm(skirt.x[skirt.stitches[:, 0]] - skirt.x[skirt.stitches[:, 1]], axis=1)
    np.testing.assert_allclose(gap, 2 * strangers.OPENING, rtol=0.01)
    sewn, merged = skirt.sewn()
    assert sewn.vertex_count == len(skirt.x) - rows
    assert len(np.unique(merged)) == sewn.vertex_count
    assert skirt.piece_names == ("front", "back")


def test_seams_are_drawn_together_in_a_time_that_depends_on_how_far_they_are_open(strangers, skirt):
    assert sewing_seconds(skirt) == pytest.approx(2 * strangers.OPENING / 0.05, rel=0.01)
    for factor, seconds in ((0.1, 0.2), (3.0, 3 * 0.24), (100.0, 1.2)):
        x = skirt.x.copy()
        x[skirt.stitches[:, 1]] += (factor - 1) * (x[skirt.stitches[:, 1]] - x[skirt.stitches[:, 0]])
        assert sewing_seconds(replace(skirt, x=x)) == pytest.approx(seconds, rel=0.01)


def test_the_skirts_rest_shape_is_its_pattern(skirt):
    """A cone unrolls without stretch, but for triangles cutting its corners."""
    assert any("pattern in its texture coordinates, in metres" in note for note in skirt.notes)
    garment = skirt.garment
    in_space = skirt.x[garment.faces]
    lengths = np.linalg.norm(in_space[:, [1, 2, 0]] - in_space, axis=2)
    pattern = np.linalg.norm(garment.uv_corners[:, [1, 2, 0]] - garment.uv_corners, axis=2)
    np.testing.assert_allclose(pattern, lengths, rtol=0.01)
    assert (garment.signed_areas() > 0).all()


def test_notes_say_unit_and_axis(skirt):
    assert skirt.notes[0].startswith("units and axes: cm, Z up")


def test_flat_shaded_triangles_become_one_surface(strangers, tmp_path):
    body = default_body()
    strangers.write_top(tmp_path / "top.glb", body)
    raw = parse_glb((tmp_path / "top.glb").read_bytes())
    garment = make_garment(raw.raw_mesh(), METRES)
    x, faces = strangers.top(body)
    assert len(garment.x) == len(x)
    assert len(garment.garment.faces) == len(faces)
    assert len(garment.garment.hinges()) > len(faces)
    assert any("shape it comes in" in note for note in garment.notes)


def test_a_rest_shape_from_space_keeps_every_length_and_carries_the_subspace(strangers, tmp_path):
    strangers.write_top(tmp_path / "top.glb", default_body())
    garment = make_garment(parse_glb((tmp_path / "top.glb").read_bytes()).raw_mesh(), METRES)
    corners = garment.x[garment.garment.faces]
    lengths = np.linalg.norm(corners[:, [1, 2, 0]] - corners, axis=2)
    flat = garment.garment.uv_corners
    np.testing.assert_allclose(np.linalg.norm(flat[:, [1, 2, 0]] - flat, axis=2), lengths, rtol=1e-9)
    basis = spline_basis(garment.garment, 4 * garment.garment.mean_edge_length())
    np.testing.assert_allclose(np.asarray(basis.sum(axis=1)).ravel(), 1.0, atol=1e-12)
    assert basis.shape[1] < 0.35 * len(garment.x)


def test_texture_coordinates_in_the_files_unit_are_a_pattern_too():
    raw = obj(100 * GRID, CELLS, 100 * GRID[:, :2])
    garment = make_garment(raw, Convention("cm", "y", "in a test"))
    assert any("in cm; 1 pieces" in note for note in garment.notes)
    assert garment.garment.signed_areas().sum() == pytest.approx(0.04)


def test_texture_coordinates_of_another_size_are_none():
    garment = make_garment(obj(GRID, CELLS, 3.0 * GRID[:, :2]), METRES)
    assert any("no pattern" in note for note in garment.notes)
    assert garment.garment.signed_areas().sum() == pytest.approx(0.04)


def test_mirrored_halves_that_lie_on_each_other_are_two_pieces():
    uv = np.column_stack([np.abs(GRID[:, 0] - 0.1), GRID[:, 1]])
    garment = make_garment(obj(GRID, CELLS, uv), METRES)
    assert garment.garment.panel_of_face.max() == 1
    assert (garment.garment.signed_areas() > 0).all()


def test_triangles_are_turned_alike_and_twins_left_out():
    cells = [*CELLS[:3], CELLS[3][::-1], CELLS[0][::-1]]
    garment = make_garment(obj(GRID, cells), METRES)
    faces = garment.garment.faces
    assert len(faces) == 8
    a, b, c = (garment.x[faces[:, k]] for k in range(3))
    assert len(np.unique(np.sign(np.cross(b - a, c - a)[:, 2]))) == 1


def halves(reversed_too):
    """The grid cut in two at x = 0.1, each half with vertices of its own, and each face reversed on the same ones."""
    left, right = [0, 1, 3, 4, 6, 7], [1, 2, 4, 5, 7, 8]
    quads = [[0, 1, 3, 2], [2, 3, 5, 4]]
    cells = quads + (np.array(quads) + 6).tolist()
    return GRID[left + right], cells + [cell[::-1] for cell in cells] * reversed_too


@pytest.mark.parametrize("reversed_too", [False, True])
def test_seams_are_welded_where_each_face_is_there_twice(reversed_too):
    garment = make_garment(obj(*halves(reversed_too)), METRES)
    assert (len(garment.x), len(garment.garment.faces)) == (9, 8)
    assert any(note.startswith("3 vertices that coincide") for note in garment.notes)


def soup(vertices, cells, apart):
    """Every corner of every triangle a vertex of its own, each moved anyhow by about `apart` m along each axis."""
    triangles = np.array([[cell[0], *cell[k : k + 2]] for cell in cells for k in range(1, len(cell) - 1)])
    corners = vertices[triangles].reshape(-1, 3)
    moved = corners + np.random.default_rng(7).normal(0.0, apart, corners.shape)
    return moved, np.arange(len(corners)).reshape(-1, 3)


def test_corners_that_nearly_coincide_are_joined_along_their_edges(strangers):
    """An exporter that rounds or quantises leaves copies of a corner some hundredths of a millimetre apart."""
    x, _, cells, *_ = strangers.skirt()
    moved, faces = soup(x, cells.tolist(), 3e-5)
    garment = make_garment(obj(moved, faces), METRES)
    assert len(garment.x) == len(x) - (strangers.ROWS + 1), "one side seam is doubled in the file"
    place = cKDTree(x).query(garment.x)[0]
    assert place.max() < 1.5e-4
    (note,) = [note for note in garment.notes if "joined with their twins" in note]
    assert re.search(r"moves some by up to 0\.1\d? mm", note), note
    whole = make_garment(obj(x, cells), METRES)
    assert not any("moves some" in note for note in whole.notes)


@pytest.mark.parametrize(
    ("cell", "apart", "joined"), [(0.1, 7e-5, True), (0.1, 1e-3, False), (0.004, 3e-5, True), (0.004, 2e-4, False)]
)
def test_how_near_is_near_enough_depends_on_the_edges(cell, apart, joined):
    """Half a millimetre at most, and not more than a twentieth of an edge."""
    moved, faces = soup(GRID * (cell / 0.1), CELLS, apart)
    if joined:
        assert len(make_garment(obj(moved, faces), METRES).x) == 9
        return
    with pytest.raises(MeshFileError, match=r"of its 8 triangles hang on no other: .* lie [\d.]+ mm from") as caught:
        make_garment(obj(moved, faces), METRES)
    assert caught.value.place.startswith("cloth.obj, lines")
    assert "Merge" in caught.value.remedy


def test_a_file_that_holds_the_body_too_is_refused_by_the_bodys_name(strangers):
    body = default_body()
    x, _, quads, *_ = strangers.skirt()
    text = ["o skirt", *("v {} {} {}".format(*p) for p in x)]
    text += ["f " + " ".join(str(k + 1) for k in cell) for cell in quads]
    person = ["o Person", *("v {} {} {}".format(*p) for p in body.rest_vertices)]
    person += ["f {} {} {}".format(*face) for face in body.faces + len(x) + 1]
    with pytest.raises(MeshFileError, match="holds the body that it is worn by: 'Person'") as caught:
        read_garment("\n".join(text + person).encode(), "scene.obj", body.rest_vertices, Told("m", "y"))
    assert "Export the garment alone" in caught.value.remedy
    alone = read_garment("\n".join(text).encode(), "skirt.obj", body.rest_vertices, Told("m", "y"))
    assert not any("taken as one" in note for note in alone.notes)


def test_a_suit_on_the_skin_is_none_of_the_body():
    """What is copied from the body from ankles to neck, and lies on it, is a garment."""
    body = default_body()
    inside = (body.rest_vertices[:, 1] > 0.12) & (body.rest_vertices[:, 1] < 1.40)
    faces = body.faces[inside[body.faces].all(axis=1)]
    text = ["v {} {} {}".format(*p) for p in body.rest_vertices] + ["f {} {} {}".format(*face + 1) for face in faces]
    assert len(read_garment("\n".join(text).encode(), "suit.obj", body.rest_vertices, Told("m", "y")).x) > 1000


def test_objects_taken_as_one_garment_are_named(skirt):
    assert "its parts are taken as one garment: 'front', 'back'" in skirt.notes


@pytest.mark.parametrize(
    ("name", "told"),
    [("Body", True), ("CC_Base_Body.001", True), ("BodyMesh", True), ("body_skin", True), ("bodysuit", False),
     ("skinny_jeans", False), ("Somebody", False), ("hairband", False)],
)  # fmt: skip
def test_a_part_that_is_called_as_a_person_is_is_asked_about(name, told):
    """Open at the neck, as many are, it has no shape that a garment could not have."""
    lines = ["v {} {} {}".format(*v) for v in GRID] + ["o dress", "f 1 2 5 4", f"o {name}", "f 2 3 6 5"]
    (note,) = [note for note in make_garment(parse_obj("\n".join(lines)), METRES).notes if "taken as one" in note]
    assert note.startswith(f"its parts are taken as one garment: 'dress', '{name}'")
    assert note.endswith(f"; where '{name}' is the person, leave that out of the export") == told


def test_two_layers_with_the_same_edges_a_millimetre_apart_stay_two():
    both = np.vstack([GRID, GRID + [0, 0, 1e-3]])
    assert len(make_garment(obj(both, [*CELLS, *(np.array(CELLS) + 9).tolist()]), METRES).x) == 18


@pytest.mark.parametrize(("gap", "sewn", "told"), [(2e-3, False, True), (2e-3, True, False), (2e-2, False, False)])
def test_a_seam_that_gapes_by_a_little_is_told(gap, sewn, told):
    """It is not welded, and falls open when it is worn: stitch lines would sew it."""
    x, cells = halves(False)
    x = np.where(np.arange(12)[:, None] < 6, x, x + [gap, 0, 0])
    garment = make_garment(obj(x, cells, None, [(1, 6), (3, 8), (5, 10)] * sewn), METRES)
    assert len(garment.x) == 12
    notes = [note for note in garment.notes if "left open" in note]
    assert len(notes) == told
    if told:
        assert notes[0].startswith("6 vertices of open edges lie up to 2 mm from others along them and are left open")
        assert "cloth.obj, lines 13, 14, 15, 16" in notes[0]


def test_one_triangle_is_a_garment():
    assert len(make_garment(obj(GRID, [[0, 1, 3]]), METRES).x) == 3


def test_a_polygon_without_texture_coordinates_is_named():
    lines = ["v {} {} {}".format(*v) for v in GRID] + ["vt {} {}".format(*v[:2]) for v in GRID]
    cells = [" ".join(f"{v + 1}/{v + 1}" for v in cell) for cell in CELLS]
    cells[2] = " ".join(str(v + 1) for v in CELLS[2])
    garment = make_garment(parse_obj("\n".join(lines + [f"f {cell}" for cell in cells]), "cloth.obj"), METRES)
    (note,) = [note for note in garment.notes if note.startswith("rest shape")]
    assert "1 of its polygons have no texture coordinates (cloth.obj, line 21)" in note
    whole = make_garment(obj(GRID, CELLS, GRID[:, :2]), METRES)
    assert not any("no texture coordinates" in note for note in whole.notes)
    bare = make_garment(obj(GRID, CELLS), METRES)
    assert any("as the file has no texture coordinates" in note for note in bare.notes)


def test_vertices_inside_a_layer_are_not_welded_to_another():
    """Two sheets that touch in their middles stay two: only open edges are joined."""
    above = GRID + np.array([0, 0, 0.05])
    above[4] = GRID[4]
    both = np.vstack([GRID, above])
    garment = make_garment(obj(both, [*CELLS, *(np.array(CELLS) + 9).tolist()]), METRES)
    assert len(garment.x) == 18


@pytest.mark.parametrize(
    ("raw", "words"),
    [
        (obj([*GRID, [0.15, 0.05, 0.1]], [*CELLS, [1, 4, 9]]), "more than two"),
        (obj([*GRID, [0.05, 0.0, 0.0]], [*CELLS, [0, 9, 1]]), "no area"),
        (obj(GRID, CELLS, None, [(0, 1)]), "corners of one triangle"),
        (obj([*GRID, [1, 1, 1]], CELLS, None, [(0, 9)]), "in no triangle"),
    ],
)
def test_what_is_no_cloth_is_refused_by_triangle(raw, words):
    with pytest.raises(MeshFileError, match=words) as caught:
        make_garment(raw, METRES)
    assert "cloth.obj" in caught.value.place
    assert caught.value.remedy


def test_a_moebius_strip_is_refused():
    n = 12
    angle = np.linspace(0, 2 * np.pi, n, endpoint=False)
    width = np.stack([np.cos(angle / 2) * np.cos(angle), np.sin(angle / 2), np.cos(angle / 2) * np.sin(angle)], axis=1)
    middle = np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=1)
    x = np.vstack([middle + 0.2 * width, middle - 0.2 * width])
    quads = [[k, k + 1, n + k + 1, n + k] for k in range(n - 1)] + [[n - 1, n, 0, 2 * n - 1]]
    with pytest.raises(MeshFileError, match="one side only"):
        make_garment(obj(x, quads), METRES)


def test_kinds_of_files_are_told_by_content():
    assert is_mesh(b"glTF\x02\0\0\0")
    assert is_mesh(b"# made by hand\nv 0 0 0\n")
    assert not is_mesh(b'{"pattern": {"v 1": 2}}')
    assert not is_mesh(b"no garment at all")
