"""A garment that comes as a mesh: welded along its seams, turned alike, with a rest shape and its open stitches."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from tryon_solver.files.closed import without_thickness
from tryon_solver.files.convention import Convention
from tryon_solver.files.raw_mesh import MeshFileError, RawMesh
from tryon_solver.files.split_seams import with_even_seams
from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.rest_shape import REST_SHAPES, find_rest_shape
from tryon_solver.geometry.seams import merge
from tryon_solver.geometry.surface_repair import (
    crowded_edges,
    gaping,
    hanging_on_none,
    three_corners,
    turned_alike,
    twins,
    usual_gap,
    weld_coincident,
)
from tryon_solver.geometry.uneven_seams import beside_edges

VERTICES_MAX = 50_000
PARTS_NAMED = 8  # in a note
PERSON = re.compile(
    r"(?<![a-zA-Z])(?i:body|avatar|skin|head|face|eyes?|eyeballs?|hair|teeth|person|human|mannequin|character)(?![a-z])"
)  # what exporters call a person's parts: open at the neck, say, they are not known by their shape
TOLD_GAP = 1e-6  # m, vertices that are joined over less are taken as equal
SLIVER = 1e-9  # m^2, a triangle smaller than this has no shape


@dataclass(frozen=True)
class MeshGarment:
    """A mesh garment in metres, Y up, before its stitches are drawn together.

    `x` (V, 3) m where it lies; `garment` its triangles and pattern; `stitches` (S, 2) int32 pairs of vertices to be
    sewn into one; `piece_names` one for each of garment.panel_of_face; `source` the file's mesh, of which
    `source_face` (F,) says which triangle each one was; `notes` what was found and done, for people.
    """

    x: np.ndarray
    garment: Garment
    stitches: np.ndarray
    piece_names: tuple[str, ...]
    source: RawMesh
    source_face: np.ndarray
    notes: tuple[str, ...]

    def places(self, faces: np.ndarray) -> str:
        """Where in the file these triangles of ours are."""
        return self.source.places(self.source_face[faces])

    def sewn(self) -> tuple[Garment, np.ndarray]:
        """The garment with its stitches closed, and the vertex (V,) each one becomes."""
        merged = merge(len(self.x), self.stitches)
        g = self.garment
        return Garment(merged[g.faces], g.uv_corners, g.panel_of_face, int(merged.max()) + 1, None, g.spline_corners), (
            merged
        )


def make_garment(raw: RawMesh, convention: Convention, rest_shape: str | None = None) -> MeshGarment:
    """Prepare a file's mesh, which rests in what `rest_shape` of REST_SHAPES tells; None to find it out.

    Raises MeshFileError naming the triangles that stand in the way.
    """
    if rest_shape not in (None, *REST_SHAPES):
        remedy = f"Say one of {', '.join(REST_SHAPES)} with --rest-shape"
        raise MeshFileError(f"{rest_shape!r} is no rest shape that is known", raw.name, remedy)
    refuse_large(raw)
    placed = convention.apply(raw.vertices)
    raw = with_even_seams(raw, placed)
    used = np.unique(raw.faces)
    notes = [f"units and axes: {convention.describe()}", *raw.notes]
    parts = [repr(raw.part_names[k]) for k in np.unique(raw.part_of_face) if raw.part_names and raw.part_names[k]]
    if len(parts) > 1:
        more = f" and {len(parts) - PARTS_NAMED} more" if len(parts) > PARTS_NAMED else ""
        person = [part for part in parts if PERSON.search(part)]
        notes.append(f"its parts are taken as one garment: {', '.join(parts[:PARTS_NAMED])}{more}")
        if person:
            notes[-1] += f"; where {', '.join(person[:PARTS_NAMED])} is the person, leave that out of the export"
    joined = weld_coincident(placed, raw.faces)
    faces, kept = joined[raw.faces], np.arange(len(raw.faces))
    kept = kept[three_corners(faces)]
    kept = kept[~twins(faces[kept])]
    again = _there_again(placed, raw.faces[kept])
    if again.any():
        told = f"{again.sum()} triangles lie exactly on others: what is there twice is taken once"
        return make_garment(raw.only(kept[~again], f"{told} ({raw.places(kept[again])})"), convention, rest_shape)
    if len(kept) < len(faces):
        notes.append(f"{len(faces) - len(kept)} triangles were doubled or without area and are left out")
    ids, faces = np.unique(faces[kept], return_inverse=True)
    faces = faces.reshape(-1, 3).astype(np.int32)
    count = np.bincount(joined, minlength=joined.max() + 1)
    middles = np.stack([np.bincount(joined, placed[:, k]) / count for k in range(3)], axis=1)
    x = middles[ids]
    if len(ids) < len(used):
        moved = float(np.linalg.norm(middles[joined[used]] - placed[used], axis=1).max())
        by = f", which moves some by up to {1e3 * moved:.2g} mm" if moved > TOLD_GAP else ""
        notes.append(f"{len(used) - len(ids)} vertices that coincide along seams were joined with their twins{by}")
    _refuse_loose(raw, kept, x, faces)
    _refuse_crowded(raw, kept, faces)
    flipped, part, torn = turned_alike(faces)
    if len(torn):
        raise MeshFileError(
            "the surface has one side only: its triangles can't be turned alike", raw.places(kept[torn]), "Cut it there"
        )
    faces[flipped] = faces[flipped][:, ::-1]
    uv = None if raw.uv is None else raw.uv[kept]
    if uv is not None:
        uv = np.where(flipped[:, None, None], uv[:, ::-1], uv)
    _refuse_slivers(raw, kept, x, faces)
    remain, thick = without_thickness(raw, kept, x, faces, part)
    if thick:
        return make_garment(raw.only(kept[remain], thick), convention, rest_shape)
    shape = find_rest_shape(x, faces, uv, convention.unit, convention.metres_per_unit, rest_shape)
    if rest_shape == "pattern" and shape.no_pattern:
        odd = np.concatenate([raw.without_uv, *(kept[doubt.faces] for doubt in shape.doubts)]).astype(np.int64)
        raise MeshFileError(
            f"its texture coordinates are told to be its pattern, but {shape.no_pattern}",
            raw.places(odd) if len(odd) else raw.name,
            "Mend its texture coordinates, or leave out --rest-shape",
        )
    if len(raw.without_uv) and rest_shape is None:
        what = "polygons" if raw.origin_word == "line" else "triangles"
        bare = len(np.unique(raw.origin_of_face[raw.without_uv]))
        notes.append(
            f"rest shape: the shape it comes in, as {bare} of its {what} have no texture coordinates "
            f"({raw.places(raw.without_uv)}); give them some, and the others' may be its pattern"
        )
    else:
        notes.append(f"rest shape: {shape.told}")
        notes += [f"rest shape: {it.told} ({raw.places(kept[it.faces])}); {it.remedy}" for it in shape.doubts]
    place_of = np.full(joined.max() + 1, -1)
    place_of[ids] = np.arange(len(ids))
    stitches = place_of[joined[raw.lines]].reshape(-1, 2)
    if (stitches < 0).any():
        raise MeshFileError(
            "a stitch line ends at a vertex that is in no triangle", raw.name, "Draw l lines between the cloth's own"
        )
    stitches = np.unique(np.sort(stitches[stitches[:, 0] != stitches[:, 1]], axis=1), axis=0).astype(np.int32)
    group = merge(len(x), stitches) if len(stitches) else None
    if group is not None:
        notes.append(f"{len(stitches)} stitch lines are sewn")
        _refuse_folding_stitches(raw, kept, group[faces])
    notes += _left_open(raw, kept, x, faces, group)
    garment = Garment(faces, shape.uv_corners, shape.panel_of_face, len(x), group, shape.spline_corners)
    return MeshGarment(x, garment, stitches, _piece_names(raw, kept, shape.panel_of_face), raw, kept, tuple(notes))


def refuse_large(raw: RawMesh) -> None:
    """Raises MeshFileError for a mesh of too many vertices; those split for shading alone don't count."""
    used = np.unique(raw.faces)
    if len(used) > VERTICES_MAX and len(np.unique(raw.vertices[used], axis=0)) > VERTICES_MAX:
        raise MeshFileError(
            f"it has {len(used)} vertices, more than {VERTICES_MAX}",
            raw.name,
            "Merge vertices that coincide, or decimate it, before exporting it",
        )


def _there_again(placed: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(F,) which triangles lie with their corners on those of an earlier one, whether or not vertices are joined."""
    same = merge(len(placed), cKDTree(placed).query_pairs(TOLD_GAP, output_type="ndarray"))
    corners = same[faces]
    return twins(corners) & three_corners(corners)


def _left_open(
    raw: RawMesh, kept: np.ndarray, x: np.ndarray, faces: np.ndarray, group: np.ndarray | None
) -> list[str]:
    """A note where edges lie so close along each other that they may be meant to be a seam."""
    pairs = gaping(x, faces)
    if group is not None:
        pairs = pairs[group[pairs[:, 0]] != group[pairs[:, 1]]]
    beside, off = beside_edges(x, faces)
    if group is not None:
        alone = np.bincount(group)[group[beside]] == 1
        beside, off = beside[alone], off[alone]
    off = off[~np.isin(beside, pairs)]
    open_ids = np.union1d(pairs, beside)
    if not len(open_ids):
        return []
    gaps = np.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1)
    gap = float(np.concatenate([gaps, off]).max(initial=0.0))
    there = np.flatnonzero(np.isin(faces, open_ids).sum(axis=1) >= 2)
    return [
        f"{len(open_ids)} vertices of open edges lie up to {1e3 * gap:.2g} mm from others along them and are "
        f"left open ({raw.places(kept[there])}); merge them, or sew them with l lines, if they are a seam"
    ]


def _refuse_loose(raw: RawMesh, kept: np.ndarray, x: np.ndarray, faces: np.ndarray) -> None:
    loose = hanging_on_none(faces)
    if 2 * len(loose) > len(faces) > 1:
        raise MeshFileError(
            f"{len(loose)} of its {len(faces)} triangles hang on no other: their corners lie "
            f"{1e3 * usual_gap(x, faces):.2g} mm from the next ones, too far to be one",
            raw.places(kept[loose]),
            "Merge its vertices by distance before exporting it",
        )


def _refuse_crowded(raw: RawMesh, kept: np.ndarray, faces: np.ndarray) -> None:
    crowded = crowded_edges(faces)
    if len(crowded):
        raise MeshFileError(
            f"{len(crowded)} triangles meet at edges that more than two of them share",
            raw.places(kept[crowded]),
            "Cloth is a single sheet: delete the inner faces, or separate layers that are glued together",
        )


def _refuse_slivers(raw: RawMesh, kept: np.ndarray, x: np.ndarray, faces: np.ndarray) -> None:
    a, b, c = (x[faces[:, k]] for k in range(3))
    small = np.flatnonzero(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1) < SLIVER)
    if len(small):
        raise MeshFileError(
            f"{len(small)} triangles have no area", raw.places(kept[small]), "Merge their vertices or remesh them"
        )


def _refuse_folding_stitches(raw: RawMesh, kept: np.ndarray, faces: np.ndarray) -> None:
    folded = np.flatnonzero([len(set(face)) < 3 for face in faces.tolist()])
    bad = np.union1d(folded, crowded_edges(faces)) if not len(folded) else folded
    if len(bad):
        raise MeshFileError(
            "the stitch lines would join corners of one triangle, or more than two triangles at one edge",
            raw.places(kept[bad]),
            "Let each stitch line join one vertex of a seam's one side with one of the other",
        )


def _piece_names(raw: RawMesh, kept: np.ndarray, piece: np.ndarray) -> tuple[str, ...]:
    """A name for every piece: that of the file's object it is most of, counted where several are of one."""
    names: list[str] = []
    for k in range(int(piece.max()) + 1):
        parts = raw.part_of_face[kept[piece == k]]
        name = raw.part_names[int(np.bincount(parts).argmax())] if raw.part_names else ""
        names.append(name or "cloth")
    counted: dict[str, int] = {}
    result = []
    for name in names:
        counted[name] = counted.get(name, 0) + 1
        result.append(name if names.count(name) == 1 else f"{name} {counted[name]}")
    return tuple(result)
