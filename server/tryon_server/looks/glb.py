"""Scenes as .glb files: surfaces with the maps of their fabrics. Khronos glTF 2.0; one buffer, nothing outside.

Texture coordinates are the pattern's, in metres; KHR_texture_transform says how often a map repeats in one. glTF's v
runs down a picture, so that of a file is the pattern's turned over. Who does not know that extension would show the
weave a metre wide: what an asset can't be rendered without is listed in `extensionsRequired` (glTF 2.0, section 3.12),
so that it is refused. Without the sheen fabric is duller, and shown.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tryon_server.looks.surface import Repeat, Surface

MAGIC, VERSION = 0x46546C67, 2
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942
FLOAT, UNSIGNED = 5126, 5125  # component types
VERTICES, INDICES = 34962, 34963  # targets of buffer views
REPEAT, LINEAR, TRILINEAR = 10497, 9729, 9987
TRANSFORM, SHEEN = "KHR_texture_transform", "KHR_materials_sheen"
SAME_CORNER = 1e-6  # m: pattern coordinates that agree to this are one
SKIN = {"baseColorFactor": [0.55, 0.37, 0.29, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.7}


@dataclass(frozen=True, eq=False)
class Part:
    """One surface of a scene.

    positions: (N, 3) m. faces: (F, 3) triangles, counter-clockwise from outside. uv: (F, 3, 2) m, pattern coordinates
    of each corner, and panel_of_face: (F,), the piece that a triangle is of: two may use the same coordinates; None of
    what has no pattern. surface: what it looks like; None: as skin.
    """

    name: str
    positions: npt.NDArray[np.floating[Any]]
    faces: npt.NDArray[np.integer[Any]]
    uv: npt.NDArray[np.floating[Any]] | None = None
    panel_of_face: npt.NDArray[np.integer[Any]] | None = None
    surface: Surface | None = None


def glb(parts: Sequence[Part]) -> bytes:
    """The parts as one scene, a node each."""
    file = _File()
    for part in parts:
        file.add(part)
    return file.content()


class _File:
    """What is written so far: the JSON's lists and the bytes that they refer to."""

    def __init__(self) -> None:
        self._binary = bytearray()
        self._lists: dict[str, list[dict[str, Any]]] = {}
        self._extensions: set[str] = set()

    def add(self, part: Part) -> None:
        corners, source = split_corners(part)
        positions = np.asarray(part.positions, np.float32)
        attributes = {"POSITION": self._floats(positions[source], bounded=True)}
        attributes["NORMAL"] = self._floats(vertex_normals(positions, part.faces)[source])
        if part.uv is not None:
            uv = np.empty((len(source), 2), np.float32)
            uv[corners.ravel()] = part.uv.reshape(-1, 2) * (1, -1)
            attributes["TEXCOORD_0"] = self._floats(uv)
        primitive = {"attributes": attributes, "indices": self._indices(corners), "material": self._material(part)}
        mesh = self._list("meshes", {"name": part.name, "primitives": [primitive]})
        self._list("nodes", {"name": part.name, "mesh": mesh})

    def content(self) -> bytes:
        """The whole file."""
        plain: dict[str, Any] = {"asset": {"version": "2.0", "generator": "tryon"}, "scene": 0, **self._lists}
        plain["scenes"] = [{"nodes": list(range(len(self._lists["nodes"])))}]
        plain["buffers"] = [{"byteLength": len(self._binary)}]
        if self._extensions:
            plain["extensionsUsed"] = sorted(self._extensions)
            plain["extensionsRequired"] = [TRANSFORM]
        text = json.dumps(plain, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<II", len(text), JSON_CHUNK) + text
        chunks += struct.pack("<II", len(self._binary), BINARY_CHUNK) + bytes(self._binary)
        return struct.pack("<III", MAGIC, VERSION, 12 + len(chunks)) + chunks

    def _material(self, part: Part) -> int:
        surface = part.surface
        if surface is None:
            return self._list("materials", {"name": "skin", "pbrMetallicRoughness": SKIN})
        self._extensions |= {TRANSFORM, SHEEN}
        sheen = {"sheenColorFactor": list(surface.sheen), "sheenRoughnessFactor": surface.sheen_roughness}
        material = {
            "name": surface.name,
            "doubleSided": True,
            "pbrMetallicRoughness": {
                "baseColorTexture": self._texture(surface.colour),
                "metallicRoughnessTexture": self._texture(surface.roughness),
            },
            "normalTexture": self._texture(surface.normal),
            "extensions": {SHEEN: sheen},
        }
        return self._list("materials", material)

    def _texture(self, picture: Repeat) -> dict[str, Any]:
        view = self._view(picture.content)
        image = self._list("images", {"bufferView": view, "mimeType": picture.kind})
        if "samplers" not in self._lists:
            wrap = {"wrapS": REPEAT, "wrapT": REPEAT}
            self._list("samplers", {"magFilter": LINEAR, "minFilter": TRILINEAR, **wrap})
        texture = self._list("textures", {"source": image, "sampler": 0})
        scale = [1 / length for length in picture.size]
        return {"index": texture, "extensions": {TRANSFORM: {"scale": scale}}}

    def _floats(self, values: npt.NDArray[np.float32], bounded: bool = False) -> int:
        accessor: dict[str, Any] = {
            "bufferView": self._view(values.astype("<f4").tobytes(), VERTICES),
            "componentType": FLOAT,
            "count": len(values),
            "type": f"VEC{values.shape[1]}",
        }
        if bounded:
            accessor["min"], accessor["max"] = values.min(axis=0).tolist(), values.max(axis=0).tolist()
        return self._list("accessors", accessor)

    def _indices(self, corners: npt.NDArray[np.integer[Any]]) -> int:
        view = self._view(corners.astype("<u4").tobytes(), INDICES)
        return self._list(
            "accessors",
            {"bufferView": view, "componentType": UNSIGNED, "count": corners.size, "type": "SCALAR"},
        )

    def _view(self, content: bytes, target: int | None = None) -> int:
        view = {"buffer": 0, "byteOffset": len(self._binary), "byteLength": len(content)}
        self._binary += content + bytes(-len(content) % 4)
        return self._list("bufferViews", view if target is None else {**view, "target": target})

    def _list(self, name: str, entry: dict[str, Any]) -> int:
        entries = self._lists.setdefault(name, [])
        entries.append(entry)
        return len(entries) - 1


def split_corners(part: Part) -> tuple[npt.NDArray[np.integer[Any]], npt.NDArray[np.integer[Any]]]:
    """Triangles (F, 3) of vertices that have one pattern coordinate each, and the vertex of the part that each is.

    A vertex on a seam is there once for every piece that meets there.
    """
    faces = np.asarray(part.faces, np.int64)
    if part.uv is None:
        return faces, np.arange(len(part.positions))
    panel = np.zeros(len(faces), np.int64) if part.panel_of_face is None else part.panel_of_face
    places = np.rint(part.uv.reshape(-1, 2) / SAME_CORNER).astype(np.int64)
    corner = np.column_stack([faces.ravel(), np.repeat(panel, 3), places])
    distinct, which = np.unique(corner, axis=0, return_inverse=True)
    return which.reshape(faces.shape), distinct[:, 0]


def vertex_normals(positions: npt.NDArray[np.float32], faces: npt.NDArray[np.integer[Any]]) -> npt.NDArray[np.float32]:
    """(N, 3) unit, of all triangles around a vertex by their areas, seams are smooth; up where there are none."""
    a, b, c = (positions[faces[:, k]].astype(np.float64) for k in range(3))
    across = np.cross(b - a, c - a)
    normals = np.zeros((len(positions), 3))
    for k in range(3):
        np.add.at(normals, faces[:, k], across)
    length = np.linalg.norm(normals, axis=1)
    normals[length == 0] = (0, 1, 0)
    return (normals / np.where(length > 0, length, 1)[:, None]).astype(np.float32)
