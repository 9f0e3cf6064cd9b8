"""What holds a garment: each of its connected pieces has to go around a part of the body, or it falls."""

from __future__ import annotations

import numpy as np

from tryon_solver.files.around import goes_through, longest
from tryon_solver.files.mesh_garment import MeshGarment
from tryon_solver.geometry.boundary_loops import boundary_loops
from tryon_solver.geometry.surface_repair import connected_faces, neighbours

CAP = 1.8  # of its one opening's area: a piece with less, like a sheet or half a tube, is around nothing; a hat has 2
NAMED = 4  # pieces in a note
GOES_AROUND_NOTHING = (
    "none of its openings goes around the trunk, the head or a limb: nothing but friction holds it, and it falls where "
    "it does not lie on the body"
)


def held_notes(garment: MeshGarment, skin: np.ndarray) -> tuple[str, ...]:
    """For people: a note where the garment, or connected pieces of it, go around no part of the body whose vertices
    are `skin` (B, 3) m."""
    sewn, merged = garment.sewn()
    count = np.bincount(merged)
    x = np.stack([np.bincount(merged, garment.x[:, k]) / count for k in range(3)], axis=1)
    piece = connected_faces(len(sewn.faces), neighbours(sewn.faces)[:, :2])
    pieces = int(piece.max()) + 1
    loose = [k for k in range(pieces) if not _held(x, sewn.faces[piece == k], skin)]
    if not loose:
        return ()
    named = "; ".join(_named(garment, np.flatnonzero(piece == k)) for k in loose[:NAMED])
    more = f"; and {len(loose) - NAMED} more" if len(loose) > NAMED else ""
    if len(loose) == pieces:
        apart = f"; it is {pieces} pieces that nothing joins ({named}{more}): sew them with l lines, or merge them"
        return (GOES_AROUND_NOTHING + (apart if pieces > 1 else ""),)
    return (
        f"{len(loose)} of the {pieces} pieces it consists of are joined to no other and go around nothing "
        f"({named}{more}): they fall where they do not lie on the body; sew them with l lines, merge them with what "
        "they belong to, or leave them out",
    )


def _named(garment: MeshGarment, faces: np.ndarray) -> str:
    """What the file calls a piece, where that is all it calls so, and where it is."""
    source, mine = garment.source, garment.source_face[faces]
    parts, all_parts = np.unique(source.part_of_face[mine]), source.part_of_face[garment.source_face]
    own = len(parts) == 1 and int((all_parts == parts[0]).sum()) == len(faces)
    name = source.part_names[int(parts[0])] if own and source.part_names else ""
    return (f"{name!r}, " if name else "") + source.places(mine, 2)


def _held(x: np.ndarray, faces: np.ndarray, skin: np.ndarray) -> bool:
    """Whether the body goes through a piece's openings, faces (F, 3): one of a cap, or two."""
    through = [loop for loop in longest(boundary_loops(faces), x) if goes_through(skin, x[loop])]
    if len(through) != 1:
        return bool(through)
    corners, rim = x[faces], x[through[0]] - x[through[0]].mean(axis=0)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    opening = np.linalg.norm(np.cross(rim, np.roll(rim, -1, axis=0)).sum(axis=0))
    return bool(np.linalg.norm(across, axis=1).sum() >= CAP * opening)
