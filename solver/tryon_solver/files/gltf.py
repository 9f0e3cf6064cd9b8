"""glTF 2.0 in its binary form (.glb): meshes, and skinned or rigid animation, by numpy alone.

Read is what a garment or a body needs: triangles, also in strips and fans, with positions, texture coordinates and skin
weights, the tree of nodes, skins, animations of translation, rotation and scale, morph targets, sparse or not. Not
read: compressed meshes (Draco, meshopt) and files that keep their data elsewhere; each is named with its remedy.
Khronos Group, glTF 2.0 Specification, sections 3.6 (accessors) and 3.7 (skins, morph targets); animations are in
gltf_animation.py.
"""

from __future__ import annotations

import graphlib
import json
import re
import struct
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tryon_solver.body import quaternions
from tryon_solver.files.gltf_animation import Channel, Choice, choose
from tryon_solver.files.gltf_primitives import MODES, as_triangles
from tryon_solver.files.raw_mesh import MeshFileError, RawMesh
from tryon_solver.files.sides import side_of
from tryon_solver.geometry.text_check import RENAME_IT, find_unencodable

COMPONENTS = {5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
JSON_CHUNK, BIN_CHUNK = 0x4E4F534A, 0x004E4942
READ_EXTENSIONS = {"KHR_mesh_quantization", "KHR_animation_pointer"}  # the latter's channels move no node
LOOKS = re.compile(r"_(materials?|techniques|textures?|lights?|packing|xmp|audio)(_|$)|^VRMC?(_|$)")  # not the shape
LISTED = 3  # names of meshes that are left out
AGAIN = "Export it again as a plain .glb: one file, no compression, triangles"


@dataclass
class _Primitive:
    """Triangles of one mesh as one node shows them."""

    node: int
    skin: int | None
    name: str
    positions: np.ndarray  # (V, 3), of the mesh, before the node moves it
    faces: np.ndarray  # (F, 3)
    uv: np.ndarray | None  # (V, 2)
    joints: np.ndarray | None  # (V, K) indices into the skin's joints
    weights: np.ndarray | None  # (V, K)
    targets: np.ndarray  # (M, V, 3) displacements of the morph targets
    rest_morph: np.ndarray  # (M,)


@dataclass
class GltfScene:
    """What a .glb shows; sampled at any time by `positions`."""

    name: str
    parents: list[int]
    node_names: list[str]
    translations: np.ndarray  # (N, 3)
    rotations: np.ndarray  # (N, 4)
    scales: np.ndarray  # (N, 3)
    matrices: dict[int, np.ndarray]  # of nodes that give one instead
    primitives: list[_Primitive] = field(default_factory=list)
    skins: list[tuple[list[int], np.ndarray]] = field(default_factory=list)  # joint nodes, inverse bind matrices
    animation: Choice | None = None
    channels: list[Channel] = field(default_factory=list)  # of the animation that is played
    left_out: tuple[str, ...] = ()  # names of nodes with meshes that its scene does not show
    no_surface: int = 0  # primitives that are points or lines

    @property
    def begins(self) -> float:
        """Time of the first key [s]; 0 without an animation."""
        return min((float(channel.times[0]) for channel in self.channels), default=0.0)

    @property
    def duration(self) -> float:
        """From the first key to the last [s]; 0 without an animation."""
        return max((float(channel.times[-1]) for channel in self.channels), default=0.0) - self.begins

    def notes(self) -> tuple[str, ...]:
        """What there is to say about its animations, for people."""
        said = [self.animation.describe()] if self.animation else []
        if self.channels and self.begins > 0:
            said.append(f"its first key is at {self.begins:.2f} s: it begins there")
        if self.left_out:
            names = ", ".join(repr(name) for name in self.left_out[:LISTED])
            more = f" and {len(self.left_out) - LISTED} more" if len(self.left_out) > LISTED else ""
            said.append(f"its scene does not show the meshes of {names}{more}: they are left out")
        if self.no_surface:
            said.append(f"it holds points or lines beside its triangles ({self.no_surface} sets): they are left out")
        return tuple(filter(None, said))

    def raw_mesh(self) -> RawMesh:
        """All triangles, as they are at the first key."""
        faces, uv, part, start = [], [], [], 0
        has_uv = all(primitive.uv is not None for primitive in self.primitives)
        for k, primitive in enumerate(self.primitives):
            faces.append(primitive.faces + start)
            if has_uv:
                assert primitive.uv is not None
                uv.append(primitive.uv[primitive.faces])
            part.append(np.full(len(primitive.faces), k))
            start += len(primitive.positions)
        count = sum(len(f) for f in faces)
        bare = np.array([primitive.uv is None for primitive in self.primitives])[np.concatenate(part)]
        return RawMesh(
            vertices=self.positions(self.begins),
            faces=np.vstack(faces).astype(np.int32),
            uv=np.vstack(uv).astype(np.float64) if has_uv else None,
            lines=np.empty((0, 2), np.int32),
            part_of_face=np.concatenate(part).astype(np.int32),
            part_names=tuple(primitive.name for primitive in self.primitives),
            origin_of_face=np.arange(count, dtype=np.int32),
            origin_word="triangle",
            name=self.name,
            without_uv=np.flatnonzero(bare & ~bare.all()),
            notes=self.notes(),
        )

    def positions(self, time: float) -> np.ndarray:
        """(V, 3) vertices of all triangles in the scene at `time` s of its keys, in the file's metres."""
        local, morphs = self._local(time)
        world = self._world(local)
        parts = []
        for primitive in self.primitives:
            points = primitive.positions
            if len(primitive.targets):
                points = points + np.tensordot(morphs.get(primitive.node, primitive.rest_morph), primitive.targets, 1)
            if primitive.skin is None or primitive.joints is None:
                matrix = world[primitive.node]
                parts.append(points @ matrix[:3, :3].T + matrix[:3, 3])
                continue
            nodes, inverse_bind = self.skins[primitive.skin]
            bones = world[nodes] @ inverse_bind
            assert primitive.weights is not None
            blended = np.einsum("vk,vkxy->vxy", primitive.weights, bones[primitive.joints])
            parts.append(np.einsum("vxy,vy->vx", blended[:, :3, :3], points) + blended[:, :3, 3])
        return np.vstack(parts)

    def carriers(self) -> set[int]:
        """The nodes that triangles move with: those that show them, or the bones of their skins, and what these hang
        from."""
        found: set[int] = set()
        for primitive in self.primitives:
            bones = () if primitive.skin is None else self.skins[primitive.skin][0]
            for node in (primitive.node, *bones):
                while node >= 0 and node not in found:
                    found.add(node)
                    node = self.parents[node]
        return found

    def leftward(self) -> np.ndarray | None:
        """(3,) from the middle of the skins' joints that are named right to that of those named left, at the first key;
        None where there are none of either."""
        places = self._world(self._local(self.begins)[0])[:, :3, 3]
        joints = sorted({joint for joints, _ in self.skins for joint in joints})
        sides = [side_of(self.node_names[joint]) for joint in joints]
        left, right = ([joint for joint, of in zip(joints, sides) if of == side] for side in ("left", "right"))
        return places[left].mean(axis=0) - places[right].mean(axis=0) if left and right else None

    def _world(self, local: np.ndarray) -> np.ndarray:
        """(N, 4, 4) of all nodes, from those relative to their parents."""
        world = np.empty((len(self.parents), 4, 4))
        for node in self._order():
            parent = self.parents[node]
            world[node] = local[node] if parent < 0 else world[parent] @ local[node]
        return world

    def _order(self) -> list[int]:
        """Nodes with parents before children."""
        depth = []
        for node in range(len(self.parents)):
            count, at = 0, node
            while self.parents[at] >= 0 and count <= len(self.parents):
                at, count = self.parents[at], count + 1
            depth.append(count)
        return np.argsort(depth, kind="stable").tolist()

    def _local(self, time: float) -> tuple[np.ndarray, dict[int, np.ndarray]]:
        translations, rotations, scales = self.translations.copy(), self.rotations.copy(), self.scales.copy()
        morphs: dict[int, np.ndarray] = {}
        animated = set()
        for channel in self.channels:
            value = channel.at(time)
            if channel.path == "weights":
                morphs[channel.node] = value
                continue
            animated.add(channel.node)
            {"translation": translations, "rotation": rotations, "scale": scales}[channel.path][channel.node] = value
        local = np.zeros((len(self.parents), 4, 4))
        local[:, :3, :3] = quaternions.to_matrix(quaternions.normalise(rotations)) * scales[:, None, :]
        local[:, :3, 3], local[:, 3, 3] = translations, 1.0
        for node, matrix in self.matrices.items():
            if node not in animated:
                local[node] = matrix
        return local, morphs


def parse_glb(content: bytes, name: str = "mesh.glb", animation: str | None = None) -> GltfScene:
    """Read a .glb; `animation` is the name of the one to read, None for the first.

    Raises MeshFileError naming what of it can't be read.
    """
    try:
        return _Parser(content, name).scene(animation)
    except (
        KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError, RecursionError, struct.error
    ) as error:
        if isinstance(error, MeshFileError):
            raise
        raise MeshFileError(f"it is not a sound glTF file ({error!r})", name, AGAIN) from error


class _Parser:
    def __init__(self, content: bytes, name: str) -> None:
        self.name = name
        if len(content) < 20 or content[:4] != b"glTF":
            raise MeshFileError("it does not begin as a .glb does", name, AGAIN)
        version, length = struct.unpack_from("<II", content, 4)
        if version != 2 or length > len(content):
            raise MeshFileError(f"it is glTF {version} of {length} bytes, {len(content)} are there", name, AGAIN)
        at = 12
        chunks: dict[int, bytes] = {}
        while at + 8 <= length:
            size, kind = struct.unpack_from("<II", content, at)
            chunks.setdefault(kind, content[at + 8 : at + 8 + size])
            at += 8 + size + (-size) % 4
        self.document: dict[str, Any] = json.loads(chunks[JSON_CHUNK])
        if (found := find_unencodable(self.document)) is not None:
            raise MeshFileError(found[1], found[0], RENAME_IT)
        self.blob = chunks.get(BIN_CHUNK, b"")
        needed = set(self.document.get("extensionsRequired", ())) - READ_EXTENSIONS
        needed = {extension for extension in needed if not LOOKS.search(extension)}
        if needed:
            raise MeshFileError(f"it needs the extension {min(needed)}, which is not read", name, AGAIN)

    def shown(self) -> set[int]:
        """The nodes of the scene that the file shows, the first where it names none; all where it has no scenes."""
        nodes, scenes = self.document.get("nodes", []), self.document.get("scenes", [])
        if not scenes:
            return set(range(len(nodes)))
        found: set[int] = set()
        ahead = list(scenes[self.document.get("scene", 0)].get("nodes", ()))
        while ahead:
            node = ahead.pop()
            if node not in found:
                found.add(node)
                ahead += nodes[node].get("children", ())
        return found

    def scene(self, animation: str | None) -> GltfScene:
        document = self.document
        nodes = document.get("nodes", [])
        self.refuse_cycle(nodes)
        parents = [-1] * len(nodes)
        for k, node in enumerate(nodes):
            for child in node.get("children", ()):
                parents[child] = k
        scene = GltfScene(
            name=self.name,
            parents=parents,
            node_names=[str(node.get("name", "")) for node in nodes],
            translations=np.array([n.get("translation", [0, 0, 0]) for n in nodes], np.float64).reshape(-1, 3),
            rotations=np.array([n.get("rotation", [0, 0, 0, 1]) for n in nodes], np.float64).reshape(-1, 4),
            scales=np.array([n.get("scale", [1, 1, 1]) for n in nodes], np.float64).reshape(-1, 3),
            matrices={
                k: np.array(node["matrix"], np.float64).reshape(4, 4).T
                for k, node in enumerate(nodes)
                if "matrix" in node
            },
        )
        for skin in document.get("skins", ()):
            count = len(skin["joints"])
            inverse = np.tile(np.eye(4), (count, 1, 1))
            if "inverseBindMatrices" in skin:
                inverse = self.accessor(skin["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
            joints = list(skin["joints"])
            self.refuse_beyond(np.array(joints), len(nodes), f"skin {len(scene.skins)}", "node")
            if len(inverse) != count:
                raise self.fault(f"it has {len(inverse)} bind matrices for {count} joints", f"skin {len(scene.skins)}")
            scene.skins.append((joints, inverse))
        shown = self.shown()
        scene.left_out = tuple(
            str(node.get("name", f"node {k}")) for k, node in enumerate(nodes) if "mesh" in node and k not in shown
        )
        for k, node in enumerate(nodes):
            if "mesh" in node and k in shown:
                mesh = document["meshes"][node["mesh"]]
                for primitive in mesh["primitives"]:
                    if primitive.get("mode", MODES["triangles"]) in MODES.values():
                        scene.primitives.append(self.primitive(primitive, mesh, node, k))
                        self.refuse_unfit(scene, scene.primitives[-1])
                    else:
                        scene.no_surface += 1
        if not scene.primitives:
            where = " in the scene that it shows" if scene.left_out else ""
            raise MeshFileError(f"it has no triangles{where}", self.name, AGAIN)
        animations = document.get("animations", [])
        carriers = scene.carriers()
        scene.animation = choose(animations, lambda k: self.moves(animations[k], carriers, k), animation, self.name)
        if scene.animation is not None:
            played = animations[scene.animation.played]
            place = f"animation {scene.animation.played}"
            channels = [channel for channel in played["channels"] if "node" in channel["target"]]  # others move nothing
            scene.channels = [self.channel(played, channel, place) for channel in channels]
            self.refuse_unfit_channels(scene, place)
        return scene

    def fault(self, message: str, place: str) -> MeshFileError:
        return MeshFileError(message, f"{self.name}, {place}", AGAIN)

    def refuse_cycle(self, nodes: list[dict[str, Any]]) -> None:
        """Raises MeshFileError when a node hangs from itself, by others or at once."""
        try:
            graphlib.TopologicalSorter({k: node.get("children", ()) for k, node in enumerate(nodes)}).prepare()
        except graphlib.CycleError as error:
            around = error.args[1][::-1]  # from parent to child
            names = " > ".join(repr(nodes[k].get("name", f"node {k}")) for k in around)
            raise MeshFileError(
                f"its nodes hang from each other in a circle: {names}",
                f"{self.name}, node {around[0]}",
                "Take the first of them out of the children of the one before it, and export it again",
            ) from error

    def refuse_beyond(self, ids: np.ndarray, count: int, place: str, what: str) -> None:
        """Raises MeshFileError when one of these ids is none of 0 to count - 1."""
        wrong = np.argwhere((ids < 0) | (ids >= count))
        if len(wrong):
            value = int(ids[tuple(wrong[0])])
            raise self.fault(f"it refers to {what} {value}, a {what} that is not there; there are {count}", place)

    def refuse_unfit(self, scene: GltfScene, primitive: _Primitive) -> None:
        """Raises MeshFileError when the vertices of a primitive don't fit each other or its skin."""
        count = len(primitive.positions)
        place = f"mesh {primitive.name!r}"
        self.refuse_beyond(primitive.faces, count, f"{place}, a triangle", "vertex")
        if primitive.positions.shape[1] != 3:
            raise self.fault(f"its positions have {primitive.positions.shape[1]} numbers each, not 3", place)
        for values, key in (
            (primitive.uv, "TEXCOORD_0"), (primitive.joints, "JOINTS_0"), (primitive.weights, "WEIGHTS_0")
        ):
            if values is not None and len(values) != count:
                raise self.fault(f"it has {len(values)} values for {count} vertices", f"{place}, {key}")
        if primitive.skin is None or primitive.joints is None or primitive.weights is None:
            return
        self.refuse_beyond(np.array([primitive.skin]), len(scene.skins), place, "skin")
        if primitive.weights.shape != primitive.joints.shape:
            raise self.fault("its joints and weights are of different numbers", f"{place}, JOINTS_0 and WEIGHTS_0")
        joint_count = len(scene.skins[primitive.skin][0])
        wrong = np.flatnonzero(((primitive.joints < 0) | (primitive.joints >= joint_count)).any(axis=1))
        if len(wrong):
            self.refuse_beyond(primitive.joints[wrong[0]], joint_count, f"{place}, JOINTS_0[{wrong[0]}]", "joint")
        total = primitive.weights.sum(axis=1)
        shown = np.unique(primitive.faces)
        bare = shown[total[shown] <= 0]
        if len(bare):
            raise MeshFileError(
                f"{len(bare)} of its {count} vertices hang on no joint, their weights are all 0; the first is vertex "
                f"{bare[0]}",
                f"{self.name}, {place}, WEIGHTS_0[{bare[0]}]",
                "Give every vertex of the skin a weight, or take what no joint moves out of the skinned mesh",
            )
        primitive.weights = primitive.weights / np.where(total > 0, total, 1.0)[:, None]

    def refuse_unfit_channels(self, scene: GltfScene, animation: str) -> None:
        """Raises MeshFileError when an animation moves what is not there, or not as it can be moved."""
        morphs = {primitive.node: len(primitive.targets) for primitive in scene.primitives}
        for k, channel in enumerate(scene.channels):
            place = f"{animation}, channel {k}"
            self.refuse_beyond(np.array([channel.node]), len(scene.parents), place, "node")
            widths = {"translation": 3, "rotation": 4, "scale": 3, "weights": morphs.get(channel.node)}
            if channel.path not in widths:
                raise self.fault(f"it animates {channel.path!r}, which is not read", place)
            width, found = widths[channel.path], channel.values.shape[-1]
            if width is not None and width != found:
                raise self.fault(f"a {channel.path} of {width} numbers is animated by {found}", place)
            if (key := channel.key_out_of_order()) is not None:
                before, here = channel.times[key - 1], channel.times[key]
                message = f"key {key} is at {here:g} s and key {key - 1} before it at {before:g} s: times must increase"
                raise self.fault(message, f"{animation}, sampler {channel.sampler}")

    def primitive(self, primitive: dict[str, Any], mesh: dict[str, Any], node: dict[str, Any], k: int) -> _Primitive:
        attributes = primitive["attributes"]
        if not self.document["accessors"][attributes["POSITION"]].keys() & {"bufferView", "sparse"}:
            raise self.fault("its positions are not there, or compressed", f"mesh {mesh.get('name', k)!r}")
        positions = self.accessor(attributes["POSITION"])
        if "indices" in primitive:
            corners = self.accessor(primitive["indices"]).astype(np.int64).ravel()
        else:
            corners = np.arange(len(positions))
        faces = as_triangles(corners, primitive.get("mode", MODES["triangles"]))
        skin = node.get("skin") if "JOINTS_0" in attributes else None
        joints = weights = None
        if skin is not None:
            sets = [n for n in range(4) if f"JOINTS_{n}" in attributes]
            joints = np.hstack([self.accessor(attributes[f"JOINTS_{n}"]) for n in sets]).astype(np.int64)
            weights = np.hstack([self.accessor(attributes[f"WEIGHTS_{n}"]) for n in sets])
        targets = [self.accessor(t["POSITION"]) for t in primitive.get("targets", ()) if "POSITION" in t]
        return _Primitive(
            node=k,
            skin=skin,
            name=node.get("name") or mesh.get("name") or f"mesh {k}",
            positions=positions,
            faces=faces,
            uv=self.accessor(attributes["TEXCOORD_0"]) if "TEXCOORD_0" in attributes else None,
            joints=joints,
            weights=weights,
            targets=np.array(targets).reshape(len(targets), len(positions), 3),
            rest_morph=np.array(node.get("weights") or mesh.get("weights") or [0.0] * len(targets), np.float64),
        )

    def moves(self, animation: dict[str, Any], carriers: set[int], k: int) -> bool:
        """Whether animation k changes any of the nodes that carry triangles."""
        for channel in animation["channels"]:
            keys = self.document["accessors"][animation["samplers"][channel["sampler"]]["input"]]["count"]
            if channel["target"].get("node") not in carriers or keys < 2:
                continue
            if self.channel(animation, channel, f"animation {k}").changes():
                return True
        return False

    def channel(self, animation: dict[str, Any], channel: dict[str, Any], place: str) -> Channel:
        index, target = channel["sampler"], channel["target"]
        sampler = animation["samplers"][index]
        times = self.accessor(sampler["input"]).ravel()
        values = self.accessor(sampler["output"])
        if not len(times):
            raise self.fault("it has no keys", f"{place}, sampler {index}")
        interpolation = sampler.get("interpolation", "LINEAR")
        values = values.reshape(len(times), 3, -1) if interpolation == "CUBICSPLINE" else values.reshape(len(times), -1)
        return Channel(target["node"], target["path"], index, times, values, interpolation)

    def accessor(self, index: int) -> np.ndarray:
        """(count, width) float64: what its view holds, zeros where it has none, with what a sparse one puts in place
        of some."""
        accessor = self.document["accessors"][index]
        component, width, count = accessor["componentType"], WIDTHS[accessor["type"]], accessor["count"]
        kind: np.dtype[Any] = np.dtype(COMPONENTS[component])
        if count > len(self.blob):  # of vertices, each of which takes bytes somewhere
            raise MeshFileError("it ends in the middle of its data", self.name, "Copy or export it again")
        values = np.zeros((count, width), kind)
        if "bufferView" in accessor:
            values = self.rows(accessor, component, width, count)
        if "sparse" in accessor:
            sparse = accessor["sparse"]
            rows = self.rows(sparse["indices"], sparse["indices"]["componentType"], 1, sparse["count"])[:, 0]
            self.refuse_beyond(rows.astype(np.int64), count, f"accessor {index}, sparse", "row")
            values = values.copy()
            values[rows] = self.rows(sparse["values"], component, width, sparse["count"])
        numbers = values.astype(np.float64)
        if accessor.get("normalized") and kind.kind in "iu":
            numbers = np.maximum(numbers / np.iinfo(kind).max, -1.0)
        if not np.isfinite(numbers).all():
            raise MeshFileError("it holds a number that is not finite", self.name, AGAIN)
        return numbers

    def rows(self, held: dict[str, Any], component: int, width: int, count: int) -> np.ndarray:
        """(count, width) as the buffer has them, of the view and the offset that `held` says."""
        view = self.document["bufferViews"][held["bufferView"]]
        if "uri" in self.document["buffers"][view["buffer"]]:
            raise MeshFileError("it keeps its data in another file", self.name, AGAIN)
        kind = np.dtype(COMPONENTS[component]).newbyteorder("<")
        stride = view.get("byteStride") or kind.itemsize * width
        start = view.get("byteOffset", 0) + held.get("byteOffset", 0)
        if count and start + (count - 1) * stride + kind.itemsize * width > len(self.blob):
            raise MeshFileError("it ends in the middle of its data", self.name, "Copy or export it again")
        return np.ndarray((count, width), kind, self.blob, start, (stride, kind.itemsize))
