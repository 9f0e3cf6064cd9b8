"""The arrays that frames refer to, checked, and their way to and from a `topology` message. PROTOCOL.md section 4."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from .arrays import pack_array, unpack_array
from .errors import ProtocolError
from .grid import GRID
from .messages import ArrayData, BodyTopology, ClothTopology, GarmentTopology, TopologyMessage

Floats = npt.NDArray[np.float32]
Indices = npt.NDArray[np.uint32]


@dataclass(frozen=True, eq=False)
class BodySurface:
    """A body surface bound to joints, exactly as it goes over the wire (float32), so that both sides pose the same one.

    rest_vertices: (B,3) float32 m, rest pose, Y up, facing +Z.
    faces: (F,3) uint32, closed, counter-clockwise from outside.
    joint_names: J names. parents: (J,) int32, -1 for joint 0 alone, parents before children.
    rest_joints: (J,3) float32 m. skin_joints: (B,K) uint16. skin_weights: (B,K) float32, rows sum to 1.
    """

    rest_vertices: Floats
    faces: Indices
    joint_names: tuple[str, ...]
    parents: npt.NDArray[np.int32]
    rest_joints: Floats
    skin_joints: npt.NDArray[np.uint16]
    skin_weights: Floats

    def __post_init__(self) -> None:
        joints, vertices = len(self.joint_names), len(self.rest_vertices)
        influences = self.skin_joints.shape[-1] if self.skin_joints.ndim == 2 else 0
        if not 1 <= joints <= 1024:
            raise _invalid("body.joint_names", f"There are {joints} joints.", "A body has 1 to 1024 joints.")
        _convert(self, "rest_vertices", "body", np.float32, (None, 3))
        _convert(self, "faces", "body", np.uint32, (None, 3))
        _convert(self, "parents", "body", np.int32, (joints,))
        _convert(self, "rest_joints", "body", np.float32, (joints, 3))
        _convert(self, "skin_joints", "body", np.uint16, (vertices, influences))
        _convert(self, "skin_weights", "body", np.float32, (vertices, influences))
        _check_indices(self.faces, vertices, "body.faces", "vertex")
        _check_indices(self.skin_joints, joints, "body.skin_joints", "joint")
        expected = self.parents < np.arange(joints)
        if self.parents[0] != -1 or not expected.all() or (self.parents[1:] < 0).any():
            raise _invalid(
                "body.parents",
                "They form no tree in order.",
                "Give joint 0 the parent -1, and parents before children.",
            )
        wrong = np.flatnonzero(~(np.abs(self.skin_weights.sum(axis=1, dtype=np.float64) - 1.0) < 1e-4))
        if vertices and (wrong.size or influences == 0):
            vertex = int(wrong[0]) if wrong.size else 0
            raise _invalid(f"body.skin_weights[{vertex}]", "The weights don't sum to 1.", "Normalise each row.")


@dataclass(frozen=True, eq=False)
class Topology:
    """What frames refer to: the cloth's triangles, the body model and the grid.

    topology_id: 1 or more; a new one for every change. cloth_vertex_count: N.
    faces: (F,3) uint32 cloth triangles. uv: (F,3,2) float32 m pattern coordinates of the triangle corners, or None.
    panel_of_face: (F,) uint16 index into panel_names, or None. grid: q in m. garments: what is worn, from the innermost
    outwards, each with its own share of vertices, triangles and panels, one after the other; () if that is not told.

    Raises:
        ProtocolError: code "invalid_array", naming the array, when they don't fit together.
    """

    topology_id: int
    cloth_vertex_count: int
    faces: Indices
    body: BodySurface
    uv: Floats | None = None
    panel_of_face: npt.NDArray[np.uint16] | None = None
    panel_names: tuple[str, ...] = ()
    grid: float = field(default=GRID)
    garments: tuple[GarmentTopology, ...] = ()

    def __post_init__(self) -> None:
        if not 1 <= self.topology_id < 2**32:
            raise _invalid("topology_id", f"It is {self.topology_id}.", "Use 1 to 2^32 - 1.")
        if self.cloth_vertex_count < 1:
            raise _invalid("cloth.vertex_count", "There is no cloth vertex.", "A garment has at least one vertex.")
        if not 0 < self.grid <= 1e-3:
            raise _invalid("grid", f"It is {self.grid} m.", "Use a grid of at most 1 mm, 1/16 mm as a rule.")
        _convert(self, "faces", "cloth", np.uint32, (None, 3))
        _check_indices(self.faces, self.cloth_vertex_count, "cloth.faces", "vertex")
        if self.uv is not None:
            _convert(self, "uv", "cloth", np.float32, (len(self.faces), 3, 2))
        if self.panel_of_face is not None:
            _convert(self, "panel_of_face", "cloth", np.uint16, (len(self.faces),))
            _check_indices(self.panel_of_face, len(self.panel_names), "cloth.panel_of_face", "panel")
        if self.garments:
            self._check_garments()

    def _check_garments(self) -> None:
        whole = {"vertices": self.cloth_vertex_count, "faces": len(self.faces), "panels": len(self.panel_names)}
        if not self.panel_names:
            del whole["panels"]
        for kind, count in whole.items():
            first = 0
            for number, garment in enumerate(self.garments):
                start, own = getattr(garment, kind)
                if start != first:
                    place = f"cloth.garments[{number}].{kind}"
                    raise _invalid(place, f"They begin at {start}.", f"Begin at {first}, where the others end.")
                first += own
            if first != count:
                raise _invalid("cloth.garments", f"They have {first} {kind} of {count}.", "Share out all of them.")

    def to_message(self, *, compress: bool = True) -> TopologyMessage:
        """compress: zstd every array; False for a client that named no "zstd" in its hello."""

        def pack(array: npt.NDArray[Any], dtype: str) -> ArrayData:
            return pack_array(array, dtype, compress=compress)

        body = self.body
        return TopologyMessage(
            topology_id=self.topology_id,
            grid=self.grid,
            cloth=ClothTopology(
                vertex_count=self.cloth_vertex_count,
                faces=pack(self.faces, "uint32"),
                uv=None if self.uv is None else pack(self.uv, "float32"),
                panel_of_face=None if self.panel_of_face is None else pack(self.panel_of_face, "uint16"),
                panel_names=self.panel_names,
                garments=self.garments,
            ),
            body=BodyTopology(
                rest_vertices=pack(body.rest_vertices, "float32"),
                faces=pack(body.faces, "uint32"),
                joint_names=body.joint_names,
                parents=pack(body.parents, "int32"),
                rest_joints=pack(body.rest_joints, "float32"),
                skin_joints=pack(body.skin_joints, "uint16"),
                skin_weights=pack(body.skin_weights, "float32"),
            ),
        )

    @staticmethod
    def from_message(message: TopologyMessage) -> Topology:
        """Raises: ProtocolError when an array is malformed or doesn't fit the others."""
        cloth, body = message.cloth, message.body
        faces = unpack_array(cloth.faces, "$.cloth.faces", "uint32", (None, 3))
        vertices = unpack_array(body.rest_vertices, "$.body.rest_vertices", "float32", (None, 3))
        joints = len(body.joint_names)
        skin_joints = unpack_array(body.skin_joints, "$.body.skin_joints", "uint16", (len(vertices), None))
        uv = None if cloth.uv is None else unpack_array(cloth.uv, "$.cloth.uv", "float32", (len(faces), 3, 2))
        panel_of_face = None
        if cloth.panel_of_face is not None:
            panel_of_face = unpack_array(cloth.panel_of_face, "$.cloth.panel_of_face", "uint16", (len(faces),))
        return Topology(
            topology_id=message.topology_id,
            cloth_vertex_count=cloth.vertex_count,
            faces=faces,
            uv=uv,
            panel_of_face=panel_of_face,
            panel_names=cloth.panel_names,
            garments=cloth.garments,
            grid=message.grid,
            body=BodySurface(
                rest_vertices=vertices,
                faces=unpack_array(body.faces, "$.body.faces", "uint32", (None, 3)),
                joint_names=body.joint_names,
                parents=unpack_array(body.parents, "$.body.parents", "int32", (joints,)),
                rest_joints=unpack_array(body.rest_joints, "$.body.rest_joints", "float32", (joints, 3)),
                skin_joints=skin_joints,
                skin_weights=unpack_array(body.skin_weights, "$.body.skin_weights", "float32", skin_joints.shape),
            ),
        )


def _convert(owner: object, name: str, place: str, dtype: type[Any], shape: tuple[int | None, ...]) -> None:
    """Bring a field of a frozen dataclass to its dtype after checking its shape and that nothing is lost."""
    array = np.asarray(getattr(owner, name))
    place = f"{place}.{name}"
    if array.ndim != len(shape) or any(want not in (None, got) for want, got in zip(shape, array.shape)):
        raise _invalid(place, f"The shape is {array.shape}.", f"Give an array of shape {shape}.")
    if np.issubdtype(dtype, np.integer):
        limits = np.iinfo(dtype)
        if not np.issubdtype(array.dtype, np.integer):
            raise _invalid(place, f"The elements are {array.dtype}.", "Give integers.")
        if array.size and (array.min() < limits.min or array.max() > limits.max):
            raise _invalid(place, "A number is out of range.", f"Give numbers from {limits.min} to {limits.max}.")
    elif not np.isfinite(array).all():
        first = np.argwhere(~np.isfinite(array))[0]
        where = "".join(f"[{index}]" for index in first)
        raise _invalid(f"{place}{where}", "The number isn't finite.", "Give finite numbers.")
    object.__setattr__(owner, name, np.ascontiguousarray(array, dtype=dtype))


def _check_indices(array: npt.NDArray[Any], count: int, place: str, noun: str) -> None:
    if array.size and array.max() >= count:
        raise _invalid(place, f"It names {noun} {array.max()} of {count}.", f"Name {noun} 0 to {count - 1}.")


def _invalid(place: str, message: str, remedy: str) -> ProtocolError:
    return ProtocolError("invalid_array", place, message, remedy)
