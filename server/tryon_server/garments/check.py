"""Checks one garment file; the body of the child process of an upload. Reads standard input, writes one JSON reply."""

from __future__ import annotations

import math
import os
import re
import sys
import traceback
from collections.abc import Mapping
from typing import TYPE_CHECKING

import msgspec

from tryon_server.garments.limited import apply_limits, run_child, unforeseen
from tryon_server.problems import Problem
from tryon_server.unused import note_unused
from tryon_server.wording import as_parameters

if TYPE_CHECKING:
    from tryon_solver.geometry.panel_mesh import PanelMesh
    from tryon_solver.geometry.pattern import Pattern

CHECK_EDGE_LENGTH = 0.03  # [m] triangles coarse enough to be quick, fine enough to meet every seam and dart
FINER_EDGE_LENGTH = 0.0085  # [m] as the preset live has it
AN_EDGE_LENGTH = re.compile(r"Use a (smaller|larger) edge length(, or | or )|, or use a smaller edge length than \S+ m")
OTHER_FILES = (  # what is likely to be sent here by mistake: how it begins, what it is and what to do with it
    (b"HIERARCHY", ("a motion (BVH)", "Upload it as a motion")),
    (b"PK\x03\x04", ("an archive (.zip, .npz)", "Upload a body as a body; unpack a garment and upload its file")),
    (b"Kaydara FBX", ("an .fbx file", "Export it as .obj or .glb and upload that")),
    (b"solid", ("an .stl file", "Export it as .obj or .glb and upload that")),
    (b"ply", ("a .ply file", "Export it as .obj or .glb and upload that")),
    (b"<", ("a drawing or a page (XML)", "Upload the specification JSON that belongs to it")),
)
A_MESH = (
    "Upload a pattern's specification JSON, a .glb, or an .obj: text with lines 'v x y z' of its vertices and "
    "'f 1 2 3' of its polygons"
)
ON_DEFAULT_BODY = "it was read as it lies on the default body: a session with another body reads it anew, by that"
ON_ANOTHER_BODY = "It is kept for a body of your own that it lies on: a session with that reads it anew, by that"
CORRECT_IT = "Correct this place in the pattern file and upload it again"


class PatternFacts(msgspec.Struct, frozen=True, kw_only=True):
    """What a garment that passed is like. ``area`` of fabric in m^2; vertices and triangles of the check's mesh.

    ``notes``: what had to be found out about a mesh: units, axes, rest shape.
    """

    panel_count: int
    seam_count: int
    vertex_count: int
    triangle_count: int
    area: float
    notes: tuple[str, ...] = ()


class CheckReply(msgspec.Struct, frozen=True, kw_only=True):
    """Either facts or a problem with the HTTP status that fits; ``trace`` is the traceback of one nobody thought of."""

    facts: PatternFacts | None = None
    problem: Problem | None = None
    status: int = 200
    trace: str = ""


def check_garment(
    content: bytes, units: str | None, up: str | None, rest_shape: str | None = None
) -> CheckReply:
    """Read a pattern or a mesh, which is of ``units``, has ``up`` upwards and rests in ``rest_shape`` where that is
    told.

    Never raises on account of the content, MemoryError excepted.
    """
    from tryon_solver.files.garment_file import is_mesh

    try:
        if is_mesh(content):
            return check_mesh(content, units, up, rest_shape)
        return _noted(check_pattern(content), {"units": units, "up": up, "rest_shape": rest_shape})
    except MemoryError:
        raise  # told by the parent as what it is
    except Exception as error:
        fault = unforeseen("checking the garment", f"{type(error).__name__}: {error}")
        return CheckReply(problem=fault.problem, status=fault.status, trace=traceback.format_exc())


def _noted(reply: CheckReply, told: Mapping[str, str | None]) -> CheckReply:
    """The reply to a pattern with a note of what was told that only a mesh has a use for."""
    if reply.facts is None:
        return reply
    notes = (*reply.facts.notes, *map(as_parameters, note_unused("garment", "pattern", told)))
    return msgspec.structs.replace(reply, facts=msgspec.structs.replace(reply.facts, notes=notes))


def check_mesh(content: bytes, units: str | None, up: str | None, rest_shape: str | None = None) -> CheckReply:
    """Read a mesh garment as it lies on the default body, or else as it may lie on another; what is wrong with it is
    told."""
    from tryon_solver.body.model import BodyError, default_body
    from tryon_solver.files.convention import Told
    from tryon_solver.files.garment_convention import NotOnBodyError
    from tryon_solver.files.garment_file import read_garment, read_without_body
    from tryon_solver.files.raw_mesh import MeshFileError
    from tryon_solver.files.self_crossing import crossing_notes
    from tryon_solver.geometry.garment import GarmentError

    try:
        skin = default_body().rest_vertices
        told = Told(units, up)
        try:
            garment, where = read_garment(content, "the mesh", skin, told, None, rest_shape), ON_DEFAULT_BODY
        except NotOnBodyError as error:
            alone = read_without_body(content, "the mesh", told, rest_shape)
            if alone is None:
                raise
            garment, where = alone, f"on the default body it can't be worn: {error.message}. {ON_ANOTHER_BODY}"
        sewn, _ = garment.sewn()
        hinges = sewn.hinges()
        notes = (*garment.notes, *crossing_notes(garment), where)
    except MeshFileError as error:
        return _refused("garment.mesh", error.place, as_parameters(error.message), as_parameters(error.remedy), 422)
    except GarmentError as error:
        return _refused("garment.mesh", "the mesh", str(error), "Mend it and upload it again", 422)
    except BodyError as error:
        return _refused("body.unusable", "body", str(error), "Then upload it again", 503)
    sides = sewn.panel_of_face[hinges[:, 4:]]
    seams = {tuple(sorted(pair)) for pair in sides[sides[:, 0] != sides[:, 1]].tolist()}
    facts = PatternFacts(
        panel_count=len(garment.piece_names),
        seam_count=len(seams),
        vertex_count=sewn.vertex_count,
        triangle_count=len(sewn.faces),
        area=float(sewn.signed_areas().sum()),
        notes=tuple(as_parameters(note) for note in notes),
    )
    return CheckReply(facts=facts)


def check_pattern(content: bytes) -> CheckReply:
    """Parse and mesh a pattern file; what is wrong with it is told."""
    from tryon_solver.geometry.pattern import NotJsonError, PatternError, parse_pattern_bytes

    try:
        pattern = parse_pattern_bytes(content)
        # slow to load: only for what is a pattern
        from tryon_solver.geometry.wearable import check_wearable

        check_wearable(pattern)
        mesh = _meshed(pattern)
    except NotJsonError as error:
        kind = next((told for begins, told in OTHER_FILES if content.lstrip().startswith(begins)), None)
        if kind is not None:
            return _refused("pattern.not_json", "garment", f"it is {kind[0]}, not a garment", kind[1], 400)
        if content.lstrip()[:1] not in (b"{", b"["):
            what = "is empty" if not content.strip() else "is neither JSON nor OBJ nor GLB"
            message = f"the file {what}: no garment, as JSON or a mesh"
            return _refused("pattern.not_json", "garment", message, A_MESH, 400)
        return _refused("pattern.not_json", error.place, error.message, error.remedy, 400)
    except PatternError as error:
        place = "panels" if error.place == "edge_length" else error.place  # the check's own length is not at fault
        remedy = AN_EDGE_LENGTH.sub("", error.remedy)
        return _refused("pattern.invalid", place, error.message, remedy[:1].upper() + remedy[1:], 422)
    corners = mesh.uv[mesh.faces]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = float(abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]).sum() / 2)
    if not math.isfinite(area):
        return _refused("pattern.invalid", "panels", "the panels' area is not a number", CORRECT_IT, 422)
    facts = PatternFacts(
        panel_count=len(mesh.panel_names),
        seam_count=len(set(mesh.seam_of_stitch.tolist())),
        vertex_count=len(mesh.uv),
        triangle_count=len(mesh.faces),
        area=area,
    )
    return CheckReply(facts=facts)


def _meshed(pattern: Pattern) -> PanelMesh:
    """With coarse triangles; what is too narrow for them, with those of a session. Raises PatternError."""
    from tryon_solver.geometry.panel_mesh import mesh_pattern
    from tryon_solver.geometry.pattern import PatternError

    try:
        return mesh_pattern(pattern, CHECK_EDGE_LENGTH)
    except PatternError as coarse:
        try:
            return mesh_pattern(pattern, FINER_EDGE_LENGTH)
        except PatternError as fine:
            raise coarse if fine.place == "edge_length" else fine from None  # too large to be meshed so finely


def _refused(code: str, place: str, message: str, remedy: str, status: int) -> CheckReply:
    return CheckReply(problem=Problem(code=code, place=place, message=message, remedy=remedy), status=status)


def main() -> None:
    """Entry of the child: arguments are the limits in seconds and in bytes, then unit, axis and rest shape, each empty
    where it is not told."""
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = "1"  # each thread of a BLAS reserves address space
    os.environ["CUDA_VISIBLE_DEVICES"] = ""  # so does each device
    apply_limits(float(sys.argv[1]), int(sys.argv[2]))
    units, up, rest_shape = (told or None for told in sys.argv[3:6])
    output, sys.stdout = sys.stdout, sys.stderr  # Warp says hello where it can
    reply = check_garment(sys.stdin.buffer.read(), units, up, rest_shape)
    output.buffer.write(msgspec.json.encode(reply))


if __name__ == "__main__":
    run_child(main)
