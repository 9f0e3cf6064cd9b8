"""A garment's file, whichever kind it is of: told apart by its content, since an upload has no ending."""

from __future__ import annotations

import re

import numpy as np

from tryon_solver.files.convention import GLTF, Convention, Told
from tryon_solver.files.garment_convention import find_for_garment
from tryon_solver.files.gltf import parse_glb
from tryon_solver.files.mesh_garment import MeshGarment, make_garment, refuse_large
from tryon_solver.files.obj import parse_obj

GLB_MAGIC = b"glTF"
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
    if content.startswith(GLB_MAGIC):
        raw = parse_glb(content, name).raw_mesh()
        if told.unit is None and told.up is None:
            told = GLTF
    else:
        raw = parse_obj(content.decode("utf-8", errors="replace"), name)
    refuse_large(raw)
    convention = find_for_garment(raw.vertices, raw.faces, skin, told, body, raw.name)
    return make_garment(raw, convention, rest_shape)
