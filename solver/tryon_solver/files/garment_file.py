"""A garment's file, whichever kind it is of: told apart by its content, since an upload has no ending."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from tryon_solver.files.convention import GLTF, Convention, Told
from tryon_solver.files.garment_convention import find_by_size, find_for_garment
from tryon_solver.files.gltf import parse_glb
from tryon_solver.files.held import held_notes
from tryon_solver.files.mesh_garment import MeshGarment, make_garment, refuse_large
from tryon_solver.files.obj import parse_obj
from tryon_solver.files.raw_mesh import MeshFileError, RawMesh

GLB_MAGIC = b"glTF"
SKIN = 1e-3  # m, a vertex so near one of the body's is the body's own
ALL_SKIN = 0.8  # of the body's vertices that a mesh has where it holds the body itself: a suit leaves head or hands
OBJ_LINE = re.compile(rb"(?m)^[ \t]*v[ \t]+[-+.0-9]")


def is_mesh(content: bytes) -> bool:
    """Whether this is a .glb or an OBJ file rather than a sewing pattern."""
    if content.startswith(GLB_MAGIC):
        return True
    return content.lstrip()[:1] not in (b"{", b"[") and OBJ_LINE.search(content) is not None


def read_garment(
    content: bytes,
    name: str,
    skin: np.ndarray,
    told: Told,
    body: Convention | None = None,
    rest_shape: str | None = None,
) -> MeshGarment:
    """A mesh garment that lies on the body whose vertices `skin` (B, 3) m are.

    `told` what is known of unit and axes; `body` the convention of the body's own file; `rest_shape` as make_garment
    has it. Raises MeshFileError or GarmentError.
    """
    raw, told = _read(content, name, told)
    refuse_large(raw)
    convention = find_for_garment(raw.vertices, raw.faces, skin, told, body, raw.name)
    _refuse_body(raw, convention.apply(raw.vertices), skin)
    garment = make_garment(raw, convention, rest_shape)
    return replace(garment, notes=(*garment.notes, *held_notes(garment, skin)))


def read_without_body(content: bytes, name: str, told: Told, rest_shape: str | None = None) -> MeshGarment | None:
    """The same of a garment that lies on a body which is not there, as far as it can be told; None where not even a
    unit can. Raises MeshFileError or GarmentError."""
    raw, told = _read(content, name, told)
    convention = find_by_size(raw.vertices, raw.faces, told)
    return None if convention is None else make_garment(raw, convention, rest_shape)


def _read(content: bytes, name: str, told: Told) -> tuple[RawMesh, Told]:
    """The file's mesh, and what is known of its unit and axes."""
    if not content.startswith(GLB_MAGIC):
        return parse_obj(content.decode("utf-8", errors="replace"), name), told
    raw = parse_glb(content, name).raw_mesh()
    return raw, GLTF if told.unit is None and told.up is None else told


def _refuse_body(raw: RawMesh, placed: np.ndarray, skin: np.ndarray) -> None:
    """Raises MeshFileError for a mesh whose vertices `placed` (V, 3) m hold those of the body, `skin` (B, 3) m, too."""
    used = np.unique(raw.faces)
    if (cKDTree(placed[used]).query(skin, distance_upper_bound=SKIN)[0] < SKIN).mean() < ALL_SKIN:
        return
    on_skin = cKDTree(skin).query(placed, distance_upper_bound=SKIN)[0] < SKIN
    bodies = [
        name
        for part, name in enumerate(raw.part_names)
        if name and on_skin[raw.faces[raw.part_of_face == part]].mean() > ALL_SKIN
    ]
    raise MeshFileError(
        "it holds the body that it is worn by" + (f": {', '.join(map(repr, bodies))}" if bodies else ""),
        raw.name,
        "Export the garment alone, where and in the pose in which it is worn; the body comes in a file of its own",
    )
