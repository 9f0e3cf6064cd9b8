"""OBJ files as exporters write them, and what is said of those that are broken."""

import numpy as np
import pytest

from tryon_solver.files.obj import parse_frame, parse_obj, refuse_other_polygons
from tryon_solver.files.raw_mesh import MeshFileError

SQUARE = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\n"


def test_quads_are_cut_along_the_shorter_diagonal():
    kite = "v 0 0 0\nv 1 -1 0\nv 10 0 0\nv 1 1 0\nf 1 2 3 4\n"
    faces = parse_obj(kite).faces
    assert sorted(map(sorted, faces.tolist())) == [[0, 1, 3], [1, 2, 3]]


def test_indices_count_backwards_and_lines_go_on():
    mesh = parse_obj(SQUARE + "vt 0 0\nvt 1 0\nvt 1 1\nf -4/1 -3/2 \\\n -2/3\n")
    assert mesh.faces.tolist() == [[0, 1, 2]]
    np.testing.assert_array_equal(mesh.uv, [[[0, 0], [1, 0], [1, 1]]])
    assert mesh.origin_of_face.tolist() == [8]
    assert mesh.place(0) == "mesh.obj, line 8"


def test_groups_lines_and_everything_else():
    text = "mtllib a.mtl\no shirt\n" + SQUARE + "vn 0 0 1\ns 1\nusemtl a\nf 1//1 2//1 3//1\n"
    text += "g sleeve\nf 1 3 4\nl 2 4 1\n"
    mesh = parse_obj(text)
    assert mesh.part_names == ("shirt", "sleeve")
    assert mesh.part_of_face.tolist() == [0, 1]
    assert mesh.lines.tolist() == [[1, 3], [3, 0]]
    assert mesh.uv is None


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("v 1 2", "3 numbers are expected"),
        ("v 1,5 2 3", "'1,5' is not a finite number"),
        ("v nan 0 0", "not a finite number"),
        ("f 1 2 9", "no vertex 9"),
        ("f 1 2 0", "no vertex 0"),
        ("f 1 2", "at least 3 corners"),
        ("f 1/1 2/1 3/1", "no texture coordinate 1"),
        ("l 1 x", "'x' is not the number of a vertex"),
    ],
)
def test_faults_name_the_line(line, words):
    with pytest.raises(MeshFileError, match=words) as caught:
        parse_obj(SQUARE + "f 1 2 3\n" + line + "\n", "shirt.obj")
    assert caught.value.place == "shirt.obj, line 6"
    assert caught.value.remedy


def test_a_file_without_polygons_is_refused():
    with pytest.raises(MeshFileError, match="no polygons"):
        parse_obj(SQUARE)


def test_further_frames_are_read_for_their_positions_and_polygons():
    positions, polygons = parse_frame("o a\nv 1 2 3\nv 4 5 6\nvt 0 0\nf 1/1/1 2 -1\n", "b.obj")
    np.testing.assert_array_equal(positions, [[1, 2, 3], [4, 5, 6]])
    assert [(polygon.line, polygon.corners()) for polygon in polygons] == [(5, (0, 1, 1))]


def test_polygons_of_a_further_frame_are_those_of_the_first_however_they_are_written():
    first = parse_frame(SQUARE + "f 1 2 3\nf 1 3 4\n", "1.obj")[1]
    for text in ("f -4//1 2 3/7\nf 1 3 4\n", "f 1 2 3\nf 1 3 4\n", ""):
        refuse_other_polygons(parse_frame(SQUARE + text, "2.obj")[1], first, "2.obj")


@pytest.mark.parametrize(
    ("polygons", "place", "words"),
    [
        ("f 1 3 4\nf 1 2 3\n", "2.obj, line 5", "polygon f 1 3 4 is f 1 2 3 in the first"),
        ("f 1 2 3\nf 1 4 3\n", "2.obj, line 6", "polygon f 1 4 3 is f 1 3 4 in the first"),
        ("f 1 2 3\n", "2.obj", "1 polygons, the first frame has 2"),
        ("f 1 2 3\nf 1 3 x\n", "2.obj, line 6", "f 1 3 x"),
    ],
)
def test_other_polygons_in_a_further_frame_are_refused(polygons, place, words):
    first = parse_frame(SQUARE + "f 1 2 3\nf 1 3 4\n", "1.obj")[1]
    with pytest.raises(MeshFileError, match=words) as caught:
        refuse_other_polygons(parse_frame(SQUARE + polygons, "2.obj")[1], first, "2.obj")
    assert caught.value.place == place
