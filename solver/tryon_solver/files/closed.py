"""What is closed is no cloth: a person among the garment's parts, or cloth that was given a thickness.

Nobody gets into a surface without an opening. One that encloses room is a person, or a garment whose openings were
filled; one that encloses next to none is two shells of one cloth, an inner and an outer, joined at their rims: the
outer one is the cloth.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from tryon_solver.files.raw_mesh import MeshFileError, RawMesh
from tryon_solver.geometry.surface_repair import connected_faces, neighbours, open_edges

LARGEST_HOLE = 0.3  # m around: nobody gets in by eyes, mouth or nostrils
ROOM = 0.01, 0.04  # m^3, and m of volume over half the area: what holds more in both has room for somebody
THICK = 0.03  # m: no cloth is thicker
SAME_THICKNESS = 0.5  # share of the thickness by which a vertex's counterpart may miss its place
NEARLY_ALL = 0.8  # of the vertices have a counterpart; those at the rims have none
LOOKED_AT = 4  # vertices nearest to where the counterpart should be
ALIKE = 0.7  # of the outer shell's area that the inner one has
FACING_AWAY = -0.5  # cosine between two normals
TALL = 0.5  # m, a person is larger
A_PANEL = 0.02  # m^2, what is smaller may be a button


def without_thickness(
    raw: RawMesh, kept: np.ndarray, x: np.ndarray, faces: np.ndarray, part: np.ndarray
) -> tuple[np.ndarray, str]:
    """(F,) bool, which triangles remain of a surface x (V, 3) m, faces (F, 3) turned alike, whose closed parts have an
    outer shell and an inner one: not the inner ones and not the rims; and a note that says so, empty where all remain.

    `part` (F,) the part each triangle is of, `kept` (F,) which one of the file's it is. Raises MeshFileError for a
    closed part that holds somebody, or whose shells can't be told apart.
    """
    remain, told = np.ones(len(faces), bool), []
    for k in np.flatnonzero(_widest_holes(x, faces, part) < LARGEST_HOLE):
        mine = np.flatnonzero(part == k)
        corners = x[faces[mine]]
        across = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        area = float(np.linalg.norm(across, axis=1).sum())
        volume = float(np.einsum("fd,fd->", corners.mean(axis=1) - corners.mean(axis=(0, 1)), across)) / 3
        thickness = 2 * abs(volume) / area
        extent = float(np.ptp(corners.reshape(-1, 3), axis=0).max())
        if abs(volume) > ROOM[0] and thickness > ROOM[1] and extent > TALL:
            raise MeshFileError(
                f"{_named(raw, kept[mine])} has no opening that anybody could get in by and encloses "
                f"{1e3 * abs(volume):.0f} litres: a person, or a garment whose openings are filled",
                raw.places(kept[mine]),
                "Export the garment alone, the body comes in a file of its own; delete polygons that close an opening",
            )
        if area < A_PANEL or not 0 < thickness < THICK:
            continue
        shells = _Shells(x, faces[mine], across, float(np.sign(volume)) * thickness)
        if not shells.two:
            continue
        what = f"{_named(raw, kept[mine])} has a thickness of about {1e3 * thickness:.2g} mm"
        outer = shells.outer()
        if outer is None:
            raise MeshFileError(
                f"{what}: an inner and an outer surface, joined at their rims",
                raw.places(kept[mine]),
                "Export it as a single surface: remove the Solidify or thickness modifier, or delete the inner surface "
                "and the rims; how thick it is its fabric says",
            )
        remain[mine] = outer
        told.append(what)
    if not told:
        return remain, ""
    return remain, (
        f"{'; '.join(told)}: only the outer surface is taken, without the inner one and the rims, "
        f"{(~remain).sum()} triangles, as of a Solidify or thickness modifier; how thick it is its fabric says"
    )


def _widest_holes(x: np.ndarray, faces: np.ndarray, part: np.ndarray) -> np.ndarray:
    """(P,) m, the length of the longest connected boundary of each part."""
    edges, owner = open_edges(faces)
    widest = np.zeros(part.max() + 1)
    if len(edges):
        size = len(x)
        label = connected_components(coo_array((np.ones(len(edges)), edges.T), shape=(size, size)), directed=False)[1]
        lengths = np.linalg.norm(x[edges[:, 1]] - x[edges[:, 0]], axis=1)
        around = np.bincount(label[edges[:, 0]], lengths, minlength=label.max() + 1)
        np.maximum.at(widest, part[owner], around[label[edges[:, 0]]])
    return widest


class _Shells:
    """An inner and an outer surface of a closed part x (V, 3) m, faces (F, 3), which is `thickness` m thick: negative
    where its triangles, of vector areas `across` (F, 3), face inwards."""

    def __init__(self, x: np.ndarray, faces: np.ndarray, across: np.ndarray, thickness: float) -> None:
        ids, corners = np.unique(faces, return_inverse=True)
        self.x, self.faces, self.thickness = x[ids], corners.reshape(-1, 3), thickness
        self.areas = np.linalg.norm(across, axis=1)
        self.across = across / np.maximum(self.areas, 1e-30)[:, None]
        normal = np.stack([np.bincount(corners.ravel(), across[:, k].repeat(3)) for k in range(3)], axis=1)
        self.normal = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
        self.near = cKDTree(self.x)

    @property
    def two(self) -> bool:
        """Whether nearly all vertices have one of the other shell behind them."""
        return bool(self._backed(self.x, self.normal).mean() > NEARLY_ALL)

    def outer(self) -> np.ndarray | None:
        """(F,) bool, the triangles of the larger shell; None where there are not two that only rims join."""
        at_corners = [self._backed(self.x[ids], self.across) for ids in self.faces.T]
        backed = at_corners[0] & at_corners[1] & at_corners[2]
        pairs = neighbours(self.faces)[:, :2]
        label = connected_faces(len(self.faces), pairs[backed[pairs].all(axis=1)])
        size = np.bincount(label, np.where(backed, self.areas, 0.0))
        if len(size) < 2:
            return None
        one, other = np.argsort(size)[::-1][:2]
        if size[other] < ALIKE * size[one] or size[one] + size[other] < NEARLY_ALL * self.areas.sum():
            return None
        # what has nothing behind it is a rim where it lies between the shells, else a fold of one of them
        corners_in = [np.isin(self.faces, self.faces[label == k]).all(axis=1) for k in (one, other)]
        for k, mine, others in ((one, *corners_in), (other, *corners_in[::-1])):
            label[mine & ~others] = k
        shell = np.isin(label, (one, other))
        loose = connected_faces(len(self.faces), pairs[~shell[pairs].any(axis=1)])
        touching = {int(k): set[int]() for k in np.unique(loose[~shell])}
        for a, b in np.vstack([pairs, pairs[:, ::-1]]).tolist():
            if shell[a] and not shell[b]:
                touching[int(loose[b])].add(int(label[a]))
        folds = [k for k, labels in touching.items() if labels == {int(one)}]
        return (label == one) | (~shell & np.isin(loose, folds))

    def _backed(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """(P,) whether a vertex that faces the other way lies behind each point (P, 3), the thickness away."""
        distance, found = self.near.query(points - self.thickness * normals, k=min(LOOKED_AT, len(self.x)))
        opposite = np.einsum("vd,vkd->vk", normals, self.normal[found]) < FACING_AWAY
        return ((distance < SAME_THICKNESS * abs(self.thickness)) & opposite).any(axis=1)


def _named(raw: RawMesh, faces: np.ndarray) -> str:
    """What the file calls these triangles."""
    names = [raw.part_names[k] for k in np.unique(raw.part_of_face[faces])] if raw.part_names else []
    named = ", ".join(repr(name) for name in names if name)
    return f"its part {named}" if named else "it"
