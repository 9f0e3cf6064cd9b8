"""Reading .glb: the squat that the script writes with bones rolled any way, against our own skinning; broken files."""

import itertools
import struct

import numpy as np
import pytest
from small_glb import glb, skinned

from tryon_solver.body import default_body
from tryon_solver.body.pose import skin
from tryon_solver.files.gltf import parse_glb
from tryon_solver.files.raw_mesh import MeshFileError


@pytest.fixture(scope="module")
def squat(strangers, tmp_path_factory):
    path = tmp_path_factory.mktemp("glb") / "squat.glb"
    strangers.write_squat(path, default_body(), 2.0)
    return path.read_bytes()


def test_a_skin_moves_as_ours_does(strangers, squat):
    body = default_body()
    motion = strangers.motion_from_rest(body, "squat", 2.0)
    scene = parse_glb(squat)
    assert scene.duration == pytest.approx(59 / 30)
    alike = (body.skin_weights > 0).sum(axis=1) <= 4  # the script writes the four largest weights
    assert alike.mean() > 0.5
    for frame in (0, 37, 59):
        x = scene.positions(frame * motion.dt)
        assert len(x) == 19282
        ours = skin(body, motion.pose(frame))
        assert np.abs(ours - skin(body, motion.pose(0))).max() > (0.1 if frame else -1)
        np.testing.assert_allclose(x[: body.vertex_count][alike], ours[alike], atol=1e-5)


def test_between_keys_bones_turn(squat):
    """Half way between two keys a rotation is half way, not where straight lines lead: limbs keep their lengths."""
    scene = parse_glb(squat)
    edge = scene.raw_mesh().faces[:50, :2]
    lengths = [
        np.linalg.norm(x[edge[:, 0]] - x[edge[:, 1]], axis=1)
        for x in (scene.positions(1.5), scene.positions(1.5 + 1 / 60))
    ]
    np.testing.assert_allclose(lengths[1], lengths[0], rtol=0.02)


def triangle(**changes):
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": points.nbytes}],
        "bufferViews": [{"buffer": 0, "byteLength": points.nbytes}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0, "scale": [2, 2, 2], "translation": [0, 0, 5], "rotation": [0, 0, 0.5**0.5, 0.5**0.5]}],
    }
    return glb(document | changes, points.tobytes())


def sheet(*modes, indices=None):
    """Five points in a zigzag that climbs, listed as they are or by `indices`, as primitives of these modes."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 2, 0]], np.float32)
    ids = np.array([0, 1, 2, 3, 4] if indices is None else indices, np.uint16)
    primitives = [{"attributes": {"POSITION": 0}, "indices": 1, "mode": mode} for mode in modes]
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": points.nbytes + ids.nbytes}],
        "bufferViews": [
            {"buffer": 0, "byteLength": points.nbytes},
            {"buffer": 0, "byteOffset": points.nbytes, "byteLength": ids.nbytes},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 5, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": len(ids), "type": "SCALAR"},
        ],
        "meshes": [{"primitives": primitives}],
        "nodes": [{"mesh": 0}],
    }
    return glb(document, points.tobytes() + ids.tobytes())


STRIP, FAN, TRIANGLES, LINES = 5, 6, 4, 1


def test_strips_are_taken_as_the_triangles_they_are_all_turned_alike():
    mesh = parse_glb(sheet(STRIP)).raw_mesh()
    assert mesh.faces.tolist() == [[0, 1, 2], [1, 3, 2], [2, 3, 4]]
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()
    joined = parse_glb(sheet(STRIP, indices=[0, 1, 2, 2, 2, 3, 4])).raw_mesh()
    assert joined.faces.tolist() == [[0, 1, 2], [2, 3, 4]]


def test_fans_are_taken_and_a_strip_beside_triangles_is_not_dropped():
    assert parse_glb(sheet(FAN, indices=[0, 1, 3, 2])).raw_mesh().faces.tolist() == [[1, 3, 0], [3, 2, 0]]
    both = parse_glb(sheet(TRIANGLES, STRIP, indices=[0, 1, 2])).raw_mesh()
    assert both.faces.tolist() == [[0, 1, 2], [5, 6, 7]]
    assert both.notes == ()


def test_points_and_lines_beside_triangles_are_told():
    mesh = parse_glb(sheet(TRIANGLES, LINES, indices=[0, 1, 2])).raw_mesh()
    assert mesh.notes == ("it holds points or lines beside its triangles (1 sets): they are left out",)


@pytest.mark.parametrize(
    "extension",
    ["EXT_texture_webp", "KHR_texture_basisu", "KHR_materials_clearcoat", "KHR_lights_punctual", "KHR_xmp_json_ld"],
)
def test_what_a_file_needs_for_its_looks_alone_is_not_missed(extension):
    assert len(parse_glb(triangle(extensionsRequired=[extension, "KHR_mesh_quantization"])).raw_mesh().faces) == 1


def deep():
    text = b"[" * 200_000
    return struct.pack("<4sIIII", b"glTF", 2, 20 + len(text), len(text), 0x4E4F534A) + text


def test_nodes_place_their_meshes():
    mesh = parse_glb(triangle()).raw_mesh()
    np.testing.assert_allclose(mesh.vertices, [[0, 0, 5], [0, 2, 5], [-2, 0, 5]], atol=1e-6)
    assert mesh.faces.tolist() == [[0, 1, 2]]


ELSEWHERE = [{"mesh": 0, "name": "Cube", "translation": [0, 0, 9]}, {"children": [2]}, {"mesh": 0}]


@pytest.mark.parametrize(
    ("scenes", "depths"),
    [
        ({"scenes": [{"nodes": [0]}, {"nodes": [1]}], "scene": 1}, [0]),
        ({"scenes": [{"nodes": [1]}, {"nodes": [0]}]}, [0]),
        ({"scenes": [{"nodes": [0, 1]}], "scene": 0}, [9, 0]),
        ({}, [9, 0]),
    ],
)
def test_only_the_scene_that_is_shown_is_read(scenes, depths):
    """With all that hangs on its nodes; everything where a file has no scenes."""
    mesh = parse_glb(triangle(nodes=ELSEWHERE, **scenes)).raw_mesh()
    assert mesh.vertices[:, 2].tolist() == np.repeat(depths, 3).tolist()
    left_out = "its scene does not show the meshes of 'Cube': they are left out"
    assert mesh.notes == ((left_out,) if len(depths) == 1 else ())


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (triangle(scenes=[{}]), "no triangles in the scene that it shows"),
        (triangle(scenes=[{"nodes": [7]}]), "not a sound glTF file"),
        (triangle(scenes=[{"nodes": [0]}], scene=3), "not a sound glTF file"),
        (b"PK\x03\x04", "does not begin as a .glb does"),
        (triangle()[:-8], "bytes"),
        (triangle(extensionsRequired=["KHR_draco_mesh_compression"]), "KHR_draco_mesh_compression"),
        (triangle(extensionsRequired=["EXT_texture_webp", "EXT_mesh_gpu_instancing"]), "EXT_mesh_gpu_instancing"),
        (triangle(buffers=[{"byteLength": 36, "uri": "a.bin"}]), "another file"),
        (triangle(nodes=[]), "no triangles"),
        (triangle(accessors=[{"bufferView": 0, "componentType": 5126, "count": 9, "type": "VEC3"}]), "in the middle"),
        (triangle(meshes=[]), "not a sound glTF file"),
        (glb([]), "not a sound glTF file"),
        (glb("").replace(b'""  ', b"[" * 4), "not a sound glTF file"),
        (deep(), "not a sound glTF file"),
    ],
)
def test_what_can_not_be_read_is_named(content, words):
    with pytest.raises(MeshFileError, match=words) as caught:
        parse_glb(content, "a.glb")
    assert caught.value.place == "a.glb"


def test_a_skin_and_animation_that_fit_are_read():
    np.testing.assert_allclose(parse_glb(skinned()).positions(0.5), [[0, 0, 2], [1, 0, 2], [0, 1, 2]])


@pytest.mark.parametrize(
    ("content", "place", "words"),
    [
        (skinned(joint=9), "a.glb, mesh 'cloak', JOINTS_0[2]", "joint 9, a joint that is not there; there are 1"),
        (skinned(skin=3), "a.glb, mesh 'cloak'", "skin 3"),
        (skinned(bone=7), "a.glb, skin 0", "node 7"),
        (skinned(node=5), "a.glb, animation 0, channel 0", "node 5"),
        (skinned(path="colour"), "a.glb, animation 0, channel 0", "'colour', which is not read"),
        (skinned(path="rotation"), "a.glb, animation 0, channel 0", "a rotation of 4 numbers is animated by 3"),
    ],
)
def test_a_skin_or_animation_that_does_not_fit_is_named(content, place, words):
    with pytest.raises(MeshFileError, match=words) as caught:
        parse_glb(content, "a.glb")
    assert caught.value.place == place
    assert caught.value.remedy


@pytest.mark.parametrize(
    ("children", "within"), [([[1], [2], [1]], {1, 2}), ([[1, 2], [1], []], {1}), ([[1], [2], [0]], {0, 1, 2})]
)
def test_nodes_that_hang_from_each_other_in_a_circle_are_named(children, within):
    """From parent to child; also where a node beside the circle has the last word on whose child one is."""
    names = ["root", "hips", "thigh"]
    nodes = [{"name": name, "children": below} for name, below in zip(names, children)]
    for order in ([0, 1, 2], [1, 2, 0]):
        place = [order.index(k) for k in range(3)]
        mixed = [{**nodes[k], "mesh": 0, "children": [place[child] for child in children[k]]} for k in order]
        with pytest.raises(MeshFileError, match="hang from each other in a circle: '") as caught:
            parse_glb(triangle(nodes=mixed), "a.glb")
        told = [names.index(name.strip("'")) for name in caught.value.message.partition(": ")[2].split(" > ")]
        assert set(told) == within
        assert told[0] == told[-1]
        assert all(child in children[parent] for parent, child in itertools.pairwise(told))
        assert caught.value.place == f"a.glb, node {place[told[0]]}"
        assert "children" in caught.value.remedy


def test_a_name_that_is_no_text_is_refused():
    content = triangle(nodes=[{"mesh": 0, "name": "sk\ud800"}])
    with pytest.raises(MeshFileError, match="half of a character") as caught:
        parse_glb(content, "a.glb")
    assert caught.value.place == "nodes[0].name"
    str(caught.value).encode()


def morphed(target: dict, blob: bytes = b"") -> bytes:
    """A triangle with a shape key whose accessor is `target`; `blob` is what lies behind the triangle's 36 bytes."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    own = {"componentType": 5126, "count": 3, "type": "VEC3"}
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": points.nbytes + len(blob)}],
        "bufferViews": [
            {"buffer": 0, "byteLength": points.nbytes},
            {"buffer": 0, "byteOffset": points.nbytes, "byteLength": len(blob)},
        ],
        "accessors": [{"bufferView": 0, **own}, {**own, **target}],
        "meshes": [{"name": "face", "primitives": [{"attributes": {"POSITION": 0}, "targets": [{"POSITION": 1}]}]}],
        "nodes": [{"mesh": 0, "weights": [0.5]}],
    }
    return glb(document, points.tobytes() + blob)


MOVED = struct.pack("<HH3f", 2, 0, 0.0, 0.0, 4.0)  # vertex 2 goes along z; the second number fills up to four bytes
SPARSE = {
    "count": 1,
    "indices": {"bufferView": 1, "componentType": 5123},
    "values": {"bufferView": 1, "byteOffset": 4},
}


def test_a_shape_key_that_says_only_what_it_moves_is_read():
    """As exporters write them: a sparse accessor on nothing, one on a view of its own, and one that moves nothing."""
    moved = parse_glb(morphed({"sparse": SPARSE}, MOVED)).positions(0.0)
    np.testing.assert_allclose(moved, [[0, 0, 0], [1, 0, 0], [0, 1, 2]])
    onto = parse_glb(morphed({"bufferView": 0, "sparse": SPARSE}, MOVED)).positions(0.0)
    np.testing.assert_allclose(onto, [[0, 0, 0], [1.5, 0, 0], [0, 1, 2]])
    np.testing.assert_allclose(parse_glb(morphed({})).positions(0.0), [[0, 0, 0], [1, 0, 0], [0, 1, 0]])


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (morphed({"sparse": SPARSE}, struct.pack("<HH3f", 3, 0, 0.0, 0.0, 4.0)), "row 3, a row that is not there"),
        (morphed({"sparse": SPARSE}, MOVED[:-4]), "in the middle of its data"),
        (morphed({"sparse": {**SPARSE, "count": 9}}, MOVED), "in the middle of its data"),
        (morphed({"count": 10**12}), "in the middle of its data"),
        (triangle(accessors=[{"componentType": 5126, "count": 3, "type": "VEC3"}]), "positions are not there"),
    ],
)
def test_a_sparse_accessor_that_does_not_fit_is_named(content, words):
    with pytest.raises(MeshFileError, match=words):
        parse_glb(content, "a.glb")
