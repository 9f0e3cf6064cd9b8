"""Small .glb files, made byte by byte: one triangle on a bone that animations move."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np

LIFT = (((0.0, 1.0), (0.0, 4.0)),)  # of every animation: times s, and how far the bone is along z then


def glb(document: object, blob: bytes = b"") -> bytes:
    """A .glb of this document and these bytes."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(blob), 0x004E4942) + blob
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def plain(vertices: np.ndarray, faces: np.ndarray) -> bytes:
    """A mesh of vertices (V, 3) and faces (F, 3), as they are."""
    points, ids = vertices.astype(np.float32), faces.astype(np.uint32)
    blob = points.tobytes() + ids.tobytes()
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(blob)}],
        "bufferViews": [
            {"buffer": 0, "byteLength": points.nbytes},
            {"buffer": 0, "byteOffset": points.nbytes, "byteLength": ids.nbytes},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(points), "type": "VEC3"},
            {"bufferView": 1, "componentType": 5125, "count": ids.size, "type": "SCALAR"},
        ],
        "meshes": [{"name": "cloak", "primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "nodes": [{"mesh": 0}],
    }
    return glb(document, blob)


def skinned(
    joint: int = 0,
    skin: int = 0,
    node: int = 1,
    path: str = "translation",
    bone: int = 1,
    weights: tuple[float, float, float] = (1.0, 1.0, 1.0),
    lifts: tuple[tuple[tuple[float, ...], tuple[float, ...]], ...] = LIFT,
    names: tuple[str, ...] = ("",),
) -> bytes:
    """A triangle on one bone, its last vertex on `joint`, that each animation of `names` moves as its `lifts` say."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    joints = np.array([[0, 0, 0, 0], [0, 0, 0, 0], [joint, 0, 0, 0]], np.uint8)
    share = np.outer(weights, [1, 0, 0, 0]).astype(np.float32)
    arrays = [(points, 5126, "VEC3"), (joints, 5121, "VEC4"), (share, 5126, "VEC4")]
    animations: list[dict[str, Any]] = []
    for name, (times, heights) in zip(names, lifts, strict=True):
        animation: dict[str, Any] = {"name": name} if name else {}
        animation |= {"channels": [], "samplers": []}
        if times:
            animation["channels"] = [{"sampler": 0, "target": {"node": node, "path": path}}]
            animation["samplers"] = [{"input": len(arrays), "output": len(arrays) + 1}]
            places = np.zeros((len(times), 3), np.float32)
            places[:, 2] = heights
            arrays += [(np.array(times, np.float32), 5126, "SCALAR"), (places, 5126, "VEC3")]
        animations.append(animation)
    blob, views, accessors = b"", [], []
    for array, component, kind in arrays:
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": array.nbytes})
        accessors.append({"bufferView": len(accessors), "componentType": component, "count": len(array), "type": kind})
        blob += array.tobytes()
    attributes = {"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2}
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(blob)}],
        "bufferViews": views,
        "accessors": accessors,
        "meshes": [{"name": "cloak", "primitives": [{"attributes": attributes}]}],
        "skins": [{"joints": [bone]}],
        "nodes": [{"mesh": 0, "skin": skin}, {}],
        "animations": animations,
    }
    return glb(document, blob)
