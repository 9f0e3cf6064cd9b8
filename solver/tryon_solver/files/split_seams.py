"""A file's triangles cut at seams whose two sides have different vertices, so that both sides have the same."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tryon_solver.files.polygon import cut
from tryon_solver.files.raw_mesh import RawMesh
from tryon_solver.geometry.surface_repair import crowded_edges, hanging_on_none, three_corners, twins, weld_coincident
from tryon_solver.geometry.uneven_seams import on_edges


def with_even_seams(raw: RawMesh, placed: np.ndarray) -> RawMesh:
    """The same surface, its vertices placed (V, 3) m, with triangles cut where vertices of a seam's other side lie on
    their edges, texture coordinates as they are there, and a note that says so."""
    joined = weld_coincident(placed, raw.faces)
    welded = joined[raw.faces]
    single = welded[three_corners(welded)]
    single = single[~twins(single)]
    if len(crowded_edges(single)) or 2 * len(hanging_on_none(single)) > len(single):
        return raw
    vertex_of = np.unique(joined, return_index=True)[1]
    places = on_edges(placed[vertex_of], single)
    if not places:
        return raw
    ends = np.array(list(places))
    touched = np.flatnonzero(np.isin(welded, ends).sum(axis=1) >= 2)
    faces: list[list[int]] = []
    corner_uv: list[np.ndarray] = []
    source: list[int] = []
    for k in touched.tolist():
        ring, weights = _ring(welded[k].tolist(), places)
        if len(ring) == 3:
            continue
        corners = weights @ placed[raw.faces[k]]
        names = [int(vertex_of[v]) for v in ring]
        for end in range(3):
            names[int(np.flatnonzero(weights[:, end] == 1)[0])] = int(raw.faces[k, end])
        for triangle in cut([(p[0], p[1], p[2]) for p in corners.tolist()], names)[0]:
            faces.append([names[c] for c in triangle])
            if raw.uv is not None:
                corner_uv.append(weights[list(triangle)] @ raw.uv[k])
            source.append(k)
    whole = np.setdiff1d(np.arange(len(raw.faces)), source)
    of = np.concatenate([whole, source]).astype(np.int64)
    order = np.argsort(of, kind="stable")
    of = of[order]
    new = np.concatenate([raw.faces[whole], faces])[order].astype(np.int32)
    welded = joined[new]
    welded = welded[three_corners(welded)]
    if len(crowded_edges(welded[~twins(welded)])):
        return raw
    bare = np.isin(of, raw.without_uv)
    count = len({vertex for on in places.values() for _, vertex in on})
    where = raw.places(np.unique(source))
    return replace(
        raw,
        faces=new,
        uv=None if raw.uv is None else np.concatenate([raw.uv[whole], corner_uv])[order],
        part_of_face=raw.part_of_face[of],
        origin_of_face=raw.origin_of_face[of],
        without_uv=np.flatnonzero(bare),
        notes=(
            *raw.notes,
            f"the sides of its seams have different vertices: {count} that lie on edges of the other side are sewn to "
            f"them, for which {len(np.unique(source))} triangles were cut ({where})",
        ),
    )


def _ring(corners: list[int], places: dict[tuple[int, int], list[tuple[float, int]]]) -> tuple[list[int], np.ndarray]:
    """The vertices around a triangle, those on its edges too, and (K, 3) the shares of its corners in each."""
    ring, weights = [], []
    for i in range(3):
        a, b = corners[i], corners[(i + 1) % 3]
        on = [(0.0, a), *places.get((a, b), [(1 - t, v) for t, v in reversed(places.get((b, a), []))])]
        for t, vertex in on:
            share = np.zeros(3)
            share[i], share[(i + 1) % 3] = 1 - t, t
            ring.append(vertex)
            weights.append(share)
    return ring, np.array(weights)
