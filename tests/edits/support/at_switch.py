"""How far cloth jumps when another mesh takes its place: each of its vertices against the cloth that was there, at the
same place of the pattern."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import LinearNDInterpolator
from scipy.spatial import QhullError, cKDTree
from speeds import Seen

from tryon_protocol import Topology

THERE = 0.01  # m in the pattern: farther from all corners of the piece that was, no cloth was there


def jump_at_switch(before: Seen, was: Topology, after: Seen, now: Topology) -> np.ndarray:
    """(N,) m from where the old mesh's cloth was at the pattern coordinates of the new one's vertices, taken along with
    the point of the body that was nearest, to where they are; NaN where it had none, as of a piece that is new."""
    from_there = np.full((now.cloth_vertex_count, 3), np.nan)
    for name in now.panel_names:
        if name in was.panel_names:
            places, vertices = corners(was, name)
            new_places, new_vertices = corners(now, name)
            from_there[new_vertices] = carried_over(places, before.cloth[vertices], new_places)
    result = np.full(len(from_there), np.nan)
    found = np.flatnonzero(np.isfinite(from_there[:, 0]))
    if len(found):
        _, nearest = cKDTree(before.body).query(from_there[found])
        way, of_body = after.cloth[found] - from_there[found], (after.body - before.body)[nearest]
        result[found] = np.linalg.norm(way - of_body, axis=1)
    return result


def corners(topology: Topology, panel: str) -> tuple[np.ndarray, np.ndarray]:
    """Pattern coordinates (C, 2) m of a piece's corners, each once, and the vertices (C,) there."""
    assert topology.uv is not None
    assert topology.panel_of_face is not None
    of_it = topology.panel_of_face == topology.panel_names.index(panel)
    places, vertices = topology.uv[of_it].reshape(-1, 2), topology.faces[of_it].ravel()
    _, first = np.unique(vertices, return_index=True)
    return places[first], vertices[first].astype(int)


def carried_over(places: np.ndarray, cloth: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """(W, 3) m: cloth (C, 3) with the pattern coordinates `places` (C, 2), at those `wanted` (W, 2); NaN at places far
    from all of it."""
    try:
        at = LinearNDInterpolator(places, cloth)(wanted)
    except QhullError:  # of a piece of one triangle, or none
        return np.full((len(wanted), 3), np.nan)
    apart, nearest = cKDTree(places).query(wanted)
    same = apart < 1e-6
    at[same] = cloth[nearest[same]]
    at[apart > THERE] = np.nan
    return np.asarray(at)
