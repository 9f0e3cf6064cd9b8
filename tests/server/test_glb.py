"""Scenes as .glb files, read back by trimesh and by the JSON's own references."""

from __future__ import annotations

import json
import struct

import numpy as np
import pytest
import trimesh

from tryon_server.looks.glb import Part, glb, split_corners, vertex_normals
from tryon_server.looks.maps import map_png, tile_size
from tryon_server.looks.surface import Finish, Repeat, surface_of
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.materials.look import Look

# Two squares of 0.1 m, sewn along the edge 1-2; the second piece begins 1 m further along u.
POSITIONS = np.array([[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0], [0.2, 0, 0], [0.2, 0.1, 0]])
FACES = np.array([[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]])
PANELS = np.array([0, 0, 1, 1])
UV = POSITIONS[FACES][..., :2] + np.where(PANELS == 1, 0.9, 0.0)[:, None, None] * np.array([1, 0])
DENIM = FABRICS["denim"]
SIZES = {5126: 4, 5125: 4}
WIDTH = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}


def cloth(surface=None) -> Part:
    return Part("cloth", POSITIONS, FACES, UV, PANELS, surface or surface_of("denim", DENIM.look))


def taken_apart(content: bytes) -> tuple[dict, bytes]:
    """JSON and buffer, by the container's own lengths."""
    magic, version, length = struct.unpack("<4sII", content[:12])
    assert (magic, version, length) == (b"glTF", 2, len(content))
    size, kind = struct.unpack("<I4s", content[12:20])
    assert (kind, size % 4) == (b"JSON", 0)
    rest = content[20 + size :]
    assert struct.unpack("<I4s", rest[:8]) == (len(rest) - 8, b"BIN\0")
    return json.loads(content[20 : 20 + size]), rest[8:]


def values(scene: dict, buffer: bytes, accessor: int) -> np.ndarray:
    """(count, width) of an accessor."""
    told = scene["accessors"][accessor]
    view = scene["bufferViews"][told["bufferView"]]
    assert view["byteOffset"] % SIZES[told["componentType"]] == 0
    kind = np.float32 if told["componentType"] == 5126 else np.uint32
    flat = np.frombuffer(buffer[view["byteOffset"] : view["byteOffset"] + view["byteLength"]], kind)
    assert len(flat) == told["count"] * WIDTH[told["type"]]
    return flat.reshape(told["count"], -1)


def test_a_seam_s_vertices_are_there_once_for_each_piece():
    corners, source = split_corners(cloth())
    assert len(source) == 8
    np.testing.assert_array_equal(source[corners], FACES)
    assert set(source.tolist()) == set(range(6))


def test_what_has_no_maps_asks_for_no_extension():
    scene, _ = taken_apart(glb([Part("body", POSITIONS, FACES)]))
    assert "extensionsUsed" not in scene
    assert "extensionsRequired" not in scene


def test_the_scene_is_whole_and_every_reference_in_it_holds():
    scene, buffer = taken_apart(glb([cloth(), Part("body", POSITIONS + 1, FACES)]))
    assert scene["asset"]["version"] == "2.0"
    assert scene["buffers"] == [{"byteLength": len(buffer)}]
    assert scene["extensionsUsed"] == ["KHR_materials_sheen", "KHR_texture_transform"]
    assert scene["extensionsRequired"] == ["KHR_texture_transform"], "without it the weave is a metre wide"
    assert [node["name"] for node in scene["nodes"]] == ["cloth", "body"]
    for mesh in scene["meshes"]:
        (primitive,) = mesh["primitives"]
        counts = {scene["accessors"][accessor]["count"] for accessor in primitive["attributes"].values()}
        assert len(counts) == 1
        assert values(scene, buffer, primitive["indices"]).max() == counts.pop() - 1
        assert primitive["material"] < len(scene["materials"])
    for view in scene["bufferViews"]:
        assert view["byteOffset"] % 4 == 0
        assert view["byteOffset"] + view["byteLength"] <= len(buffer)
    for texture in scene["textures"]:
        assert texture["source"] < len(scene["images"])
        assert texture["sampler"] < len(scene["samplers"])


def test_texture_coordinates_are_the_pattern_s_in_metres_and_each_map_has_its_size():
    """At (u, v) m a map of that size shows its point (u/width, 1 - v/height): rows of a picture go down, v goes up."""
    scene, buffer = taken_apart(glb([cloth()]))
    (primitive,) = scene["meshes"][0]["primitives"]
    uv = values(scene, buffer, primitive["attributes"]["TEXCOORD_0"])
    where = values(scene, buffer, primitive["attributes"]["POSITION"])
    triangles = values(scene, buffer, primitive["indices"]).reshape(-1, 3)
    np.testing.assert_allclose(where[triangles], POSITIONS[FACES], atol=1e-7)
    np.testing.assert_allclose(uv[triangles] * (1, -1), UV, atol=1e-7)
    (material,) = scene["materials"]
    rough = material["pbrMetallicRoughness"]
    for told in (rough["baseColorTexture"], rough["metallicRoughnessTexture"], material["normalTexture"]):
        scale = told["extensions"]["KHR_texture_transform"]["scale"]
        assert scale == pytest.approx([1 / length for length in tile_size(DENIM.look)])
    assert material["extensions"]["KHR_materials_sheen"]["sheenRoughnessFactor"] == 0.5


def test_the_pictures_are_those_that_the_page_is_handed():
    scene, buffer = taken_apart(glb([cloth()]))
    kept = []
    for image in scene["images"]:
        view = scene["bufferViews"][image["bufferView"]]
        assert image["mimeType"] == "image/png"
        kept.append(buffer[view["byteOffset"] : view["byteOffset"] + view["byteLength"]])
    assert kept == [map_png(DENIM.look, kind) for kind in ("colour", "roughness", "normal")]


def test_a_print_takes_the_place_of_the_colour_and_leaves_the_weave():
    picture = Repeat(b"\xff\xd8 no real picture", (0.3, 0.2), "image/jpeg")
    scene, buffer = taken_apart(glb([cloth(surface_of("denim", DENIM.look, Finish(printed=picture)))]))
    colour = scene["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]
    assert colour["extensions"]["KHR_texture_transform"]["scale"] == pytest.approx([1 / 0.3, 5])
    image = scene["images"][scene["textures"][colour["index"]]["source"]]
    view = scene["bufferViews"][image["bufferView"]]
    assert image["mimeType"] == "image/jpeg"
    assert buffer[view["byteOffset"] : view["byteOffset"] + view["byteLength"]] == picture.content
    assert len(scene["images"]) == 3


def test_another_reader_finds_the_same_surface(tmp_path):
    (tmp_path / "scene.glb").write_bytes(glb([cloth(), Part("body", POSITIONS + 1, FACES)]))
    read = trimesh.load_scene(tmp_path / "scene.glb")
    assert set(read.geometry) == {"cloth", "body"}
    np.testing.assert_allclose(read.geometry["body"].vertices, POSITIONS + 1, atol=1e-6)
    assert read.geometry["cloth"].area == pytest.approx(0.02)


def test_normals_are_the_surface_s_and_smooth_across_a_seam():
    folded = POSITIONS.astype(np.float32)
    folded[4:, 0], folded[4:, 2] = 0.1, -0.1  # the second square turns back at a right angle
    normals = vertex_normals(folded, FACES)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-6)
    np.testing.assert_allclose(normals[3], (0, 0, 1), atol=1e-6)
    assert normals[1] @ (1, 0, 1) / np.sqrt(2) > 0.94  # between the two, by the areas around it
    scene, buffer = taken_apart(glb([Part("cloth", folded, FACES, UV, PANELS, surface_of("plain", Look()))]))
    attributes = scene["meshes"][0]["primitives"][0]["attributes"]
    drawn, where = (values(scene, buffer, attributes[name]) for name in ("NORMAL", "POSITION"))
    on_seam = np.abs(where - folded[1]).max(axis=1) < 1e-6
    assert on_seam.sum() == 2
    np.testing.assert_array_equal(drawn[on_seam][0], drawn[on_seam][1])
