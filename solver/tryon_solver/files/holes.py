"""Holes of a body's surface are filled, so that no cloth slips in."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from tryon_solver.geometry.boundary_loops import boundary_loops
from tryon_solver.geometry.distinct import ascending, distinct
from tryon_solver.geometry.seams import face_edges
from tryon_solver.geometry.surface_repair import crowded_edges

LISTED = 4  # places of edges that are said


def fill_holes(
    weights: sp.csr_matrix, faces: np.ndarray, x: np.ndarray
) -> tuple[sp.csr_matrix, np.ndarray, list[str]]:
    """Each hole filled with a fan around the mean of its rim, but for those at edges of more than two triangles.

    `weights` (B, V) of the file's vertices, `faces` (F, 3); `x` (B, 3) m says which holes are points, and where things
    are. Returns both with the fans, and what there is to say.
    """
    crowded = crowded_edges(faces)
    whole = np.setdiff1d(np.arange(len(faces)), crowded)
    open_loops = [loop for loop in boundary_loops(faces[whole]) if np.ptp(x[loop], axis=0).max() > 0]
    at_crowded = np.unique(faces[crowded])  # beside them what is left out looks like a hole
    loops = [loop for loop in open_loops if not np.isin(loop, at_crowded).any()]
    rows, fans = [weights], [faces]
    for k, loop in enumerate(loops):
        centre = weights.shape[0] + k
        rows.append(sp.csr_matrix(weights[loop].mean(axis=0)))
        around = np.roll(loop, -1)
        fans.append(np.stack([around, loop, np.full(len(loop), centre)], axis=1))
    closed = np.vstack(fans).astype(np.int32)
    notes = []
    if loops:
        notes.append(f"it is not closed: {len(loops)} holes are filled, so that no cloth slips in")
    if len(crowded):
        notes.append(_of_crowded(closed, x))
    return sp.vstack(rows).tocsr(), closed, notes


def _of_crowded(faces: np.ndarray, x: np.ndarray) -> str:
    """What there is to say of edges with more than two triangles, and of those that are still open."""
    edges, _, _, counts = distinct(ascending(face_edges(faces)))
    middles = x[edges[counts > 2]].mean(axis=1)
    where = "; ".join(", ".join(f"{c:.2f}" for c in middle) for middle in middles[:LISTED])
    more = " and elsewhere" if len(middles) > LISTED else ""
    said = f"more than two triangles meet at {len(middles)} of its edges (at {where} m{more})"
    still = int((counts == 1).sum())
    return f"{said}; {still} open edges beside them are not filled, cloth may slip in" if still else said
