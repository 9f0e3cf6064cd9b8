"""OBJ files as exporters write them, and what is said of those that are broken."""

import numpy as np
import pytest

from tryon_solver.files.obj import parse_obj, parse_positions
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


def test_further_frames_are_read_for_their_positions_only():
    np.testing.assert_array_equal(parse_positions("o a\nv 1 2 3\nvt 0 0\nf 1 2 99\n", "b.obj"), [[1, 2, 3]])
