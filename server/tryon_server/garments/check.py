"""Checks one pattern file; the body of the child process of an upload. Reads standard input, writes one JSON reply."""

from __future__ import annotations

import math
import os
import sys

import msgspec

from tryon_server.problems import Problem

CHECK_EDGE_LENGTH = 0.03  # [m] triangles coarse enough to be quick, fine enough to meet every seam and dart
CORRECT_IT = "Correct this place in the pattern file and upload it again"


class PatternFacts(msgspec.Struct, frozen=True, kw_only=True):
    """What a pattern that passed is like. ``area`` of fabric in m^2; vertices and triangles of the check's mesh."""

    panel_count: int
    seam_count: int
    vertex_count: int
    triangle_count: int
    area: float


class CheckReply(msgspec.Struct, frozen=True, kw_only=True):
    """Either facts or a problem with the HTTP status that fits."""

    facts: PatternFacts | None = None
    problem: Problem | None = None
    status: int = 200


def check_pattern(content: bytes) -> CheckReply:
    """Parse and mesh a pattern file; never raises on account of its content."""
    from tryon_solver.geometry.pattern import NotJsonError, PatternError, parse_pattern_bytes

    try:
        pattern = parse_pattern_bytes(content)
        # slow to load: only for what is a pattern
        from tryon_solver.geometry.panel_mesh import mesh_pattern
        from tryon_solver.geometry.wearable import check_wearable

        check_wearable(pattern)
        mesh = mesh_pattern(pattern, CHECK_EDGE_LENGTH)
    except NotJsonError as error:
        return _refused("pattern.not_json", error.place, error.message, error.remedy, 400)
    except PatternError as error:
        place = "panels" if error.place == "edge_length" else error.place  # the check's own length is not at fault
        return _refused("pattern.invalid", place, error.message, error.remedy, 422)
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


def _refused(code: str, place: str, message: str, remedy: str, status: int) -> CheckReply:
    return CheckReply(problem=Problem(code=code, place=place, message=message, remedy=remedy), status=status)


def main() -> None:
    """Entry of the child: arguments are the limits in seconds and in bytes."""
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = "1"  # each thread of a BLAS reserves address space
    from tryon_server.garments.limited import apply_limits

    apply_limits(float(sys.argv[1]), int(sys.argv[2]))
    sys.stdout.buffer.write(msgspec.json.encode(check_pattern(sys.stdin.buffer.read())))


if __name__ == "__main__":
    main()
