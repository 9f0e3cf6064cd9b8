"""Files of other kinds, given as a body or as a motion, are named with what to do about them."""

import re

import pytest

from tryon_solver.files.foreign import no_body, no_motion
from tryon_solver.files.mesh_body import read_frames
from tryon_solver.files.raw_mesh import MeshFileError

FBX = b"Kaydara FBX Binary  \x00\x1a\x00" + b"\x00" * 40


@pytest.mark.parametrize(
    ("start", "name", "what", "remedy"),
    [
        (FBX, "a.fbx", "an FBX file", "Export it as a .glb with its animation.*Blender opens it and exports a .glb"),
        (FBX, "upload", "an FBX file", "Blender"),
        (b"; FBX 7.4.0 project file\n", "a", "an FBX file", "Blender"),
        (b"not sound", "a.FBX", "an FBX file", "Blender"),
        (b"BLENDER-v300", "a", "a Blender file", "Blender opens it"),
        (b'<?xml version="1.0"?>\n<COLLADA xmlns', "a", "a COLLADA file", "Blender"),
        (b"\nHIERARCHY\nROOT Hips", "a", "a BVH file", "give it as the motion"),
        (b"\x80\x04", "a.pkl", "a Python pickle file", "numpy.savez"),
        (b"\x93NUMPY\x01", "a", "a NumPy array file", "numpy.savez"),
        (b"anything", "a.c3d", "a C3D file", "markers"),
        (b"\x1f\x8b\x08\x08", "a.obj.gz", "a gzip-compressed file", "Unpack it"),
    ],
)
def test_what_is_no_body_says_what_it_is(tmp_path, start, name, what, remedy):
    path = tmp_path / name
    path.write_bytes(start)
    with pytest.raises(MeshFileError, match=f"it is {what}, which is not read here") as caught:
        read_frames(path)
    assert caught.value.place == name
    assert "--" not in caught.value.remedy
    with pytest.raises(MeshFileError, match=remedy):
        read_frames(path, name="dance")


@pytest.mark.parametrize(
    ("start", "name", "what", "remedy"),
    [
        (FBX, "a.fbx", "an FBX file", "Convert it to BVH; Blender opens it and exports BVH"),
        (b"glTF\x02", "a", "a glTF file", "as the body, which then moves by itself"),
        (b"{}", "a.gltf", "a glTF file", "as the body"),
        (b"PK\x03\x04" + b"\x00" * 26 + b"poses.npy", "a.npz", "a NumPy archive file", "poses of SMPL.* to BVH"),
        (b"PK\x03\x04" + b"\x00" * 26 + b"walk.bvh", "a.bvh", "a zip archive file", "Unpack it"),
        (b"\x1f\x8b\x08\x08", "walk.bvh.gz", "a gzip-compressed file", "Unpack it"),
        (b":ASF-FORMAT\n", "a", "an ASF file", "Convert it to BVH"),
    ],
)
def test_what_is_no_motion_says_what_it_is(start, name, what, remedy):
    why, do = no_motion(start, name)
    assert why == f"it is {what}, which is not read here"
    assert re.search(remedy, do)


@pytest.mark.parametrize(
    ("start", "name"),
    [(b"HIERARCHY\n", "a.bvh"), (b"HIERARCHY\n", "walk.fbx"), (b"\xef\xbb\xbfHIERARCHY", "a"), (b"", "")],
)
def test_what_may_be_a_motion_is_left_to_its_reader(start, name):
    assert no_motion(start, name) is None


@pytest.mark.parametrize("start", [b"v 0 0 0\n", b"glTF\x02", b"PK\x03\x04", b"ply\n", b"solid x", b""])
def test_what_may_be_a_body_is_left_to_its_reader(start):
    assert no_body(start, "upload") is None
