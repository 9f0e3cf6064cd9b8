"""Frames that come a file each, in the order of the number that differs between their names."""

import zipfile

import numpy as np
import pytest

from tryon_solver.files.mesh_body import read_frames
from tryon_solver.files.numbering import frame_numbers, gaps
from tryon_solver.files.raw_mesh import MeshFileError

TRIANGLE = "v 0 0 {}\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


@pytest.mark.parametrize("name", ["scan-{}-v2.obj", "2_{}.obj", "take 3 {:04d}.OBJ", "{}.obj", "{}_of_12.obj"])
def test_the_number_that_differs_is_the_frames(name):
    numbers = list(range(12))[::-1]
    assert frame_numbers([name.format(k) for k in numbers], "walk") == numbers


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (["a1-v2.obj", "a2-v2.obj", "a2-v3.obj"], "2 numbers differ between names such as a1-v2.obj and a2-v3.obj"),
        (["left1.obj", "right2.obj"], "left1.obj and right2.obj differ in more than a number"),
        (["a.obj", "b.obj"], "a.obj and b.obj differ in more than a number"),
        (["a1.obj", "a2.obj", "a01.obj"], "a1.obj and a01.obj have the same number"),
        (["a.obj", "a.OBJ"], "a.obj and a.OBJ have the same number"),
    ],
)
def test_names_that_do_not_tell_their_order_are_refused(names, words):
    with pytest.raises(MeshFileError) as caught:
        frame_numbers(names, "walk")
    assert words in str(caught.value)
    assert (caught.value.place, "one number differs" in caught.value.remedy) == ("walk", True)


def test_one_file_alone_needs_no_number():
    assert frame_numbers(["stands.obj"], "folder") == [0]


def test_gaps_are_of_the_same_number():
    assert gaps([0, 1, 2, 3]) == gaps([1, 5]) == []
    assert "10 follows 1" in gaps([0, 1, 10])[0]


@pytest.mark.parametrize("packed", [False, True])
def test_a_folder_and_an_archive_are_read_in_that_order(tmp_path, packed):
    folder = tmp_path / "scans"
    folder.mkdir()
    files = [(f"scan-{k}-v2.obj", TRIANGLE.format(k)) for k in (10, 0, 2, 11, *range(3, 10), 1)]
    for name, text in files:
        (folder / name).write_text(text)
    if packed:
        with zipfile.ZipFile(tmp_path / "scans.zip", "w") as archive:
            for name, text in files:
                archive.writestr(f"scans/{name}", text)
    raw = read_frames(tmp_path / "scans.zip" if packed else folder)
    np.testing.assert_array_equal(raw.frames[:, 0, 2], range(12))
    assert raw.place(10).endswith("scan-10-v2.obj")
    assert len(raw.notes) == 1
