"""Triangle meshes of all pieces of a pattern, with vertices matched one to one along sewn edges.

Every edge of a piece is cut into equal arc lengths; sewn edges into the same number, after their mean length, so that
ease and gathers are spread evenly. Sewn edges too short for the mesh become a single vertex. Where the sewn surface
would not be an edge-manifold (corners and narrow pieces of a coarse mesh), pieces are cut finer until it is.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tryon_solver.geometry import outline, seams
from tryon_solver.geometry.constrained import TriangulationError
from tryon_solver.geometry.locate import locate
from tryon_solver.geometry.patch import Laid
from tryon_solver.geometry.pattern import Panel, Pattern, PatternError, Stitch, StitchSide
from tryon_solver.geometry.piece_meshes import PIECES_KEPT, triangulated
from tryon_solver.geometry.sampled_outline import sample_outline, vertices_along
from tryon_solver.geometry.triangulate import split_edges

# A sewn edge shorter than this share of the edge length becomes one vertex: its triangles would be too flat.
VERTEX_BELOW = 0.4
# An edge is never cut finer than this share of the edge length to keep the surface sound; the pattern is at fault then.
FINEST = 1 / 8
REPAIR_ROUNDS = 12
CONTACT_TOLERANCE = 1e-6  # m, between two parts of an outline
VERTICES_MAX = 2_000_000
LIFT = 5e-3  # m off its host that a patch is placed, so that places tell which of the two is meant
MOST_AT_ONCE = 8  # pieces


@dataclass(frozen=True)
class PanelMesh:
    """The meshed, unsewn pieces. Vertices of one piece are consecutive, its outline first.

    A piece whose edges turn clockwise shows its wrong side when drawn; its `uv` is mirrored (u = -x), so that every
    face is counter-clockwise in `uv` and its normal in `placed` points out of the right side of the fabric.
    """

    uv: NDArray[np.float64]  # (V, 2) m, pattern coordinates seen from the right side
    panel_of_vertex: NDArray[np.int32]  # (V,)
    panel_names: tuple[str, ...]
    panel_labels: tuple[str, ...]  # "" where the pattern gives none
    faces: NDArray[np.int32]  # (F, 3), counter-clockwise in uv
    placed: NDArray[np.float64]  # (V, 3) m, the flat pieces where the pattern puts them
    stitches: NDArray[np.int32]  # (S, 2), pairs of different vertices to be sewn into one, in order along each seam
    seam_of_stitch: NDArray[np.int32]  # (S,), index into the pattern's stitches
    sewn_edges: NDArray[np.int32]  # (P, 2, 2), pairs of outline edges that a seam makes one
    segments: NDArray[np.int32]  # (E,), into how many outline edges each edge of the pattern is cut, piece after piece
    laid: Laid = field(default_factory=Laid.nothing)  # where pieces that lie on others do so

    @property
    def panel_of_face(self) -> NDArray[np.int32]:
        """(F,)"""
        return self.panel_of_vertex[self.faces[:, 0]]

    def first_vertex(self, panel: int) -> int:
        """The first vertex of the piece with this index."""
        return int(np.searchsorted(self.panel_of_vertex, panel))

    def vertices_of(self, panel: int) -> slice:
        """Those of the piece with this index."""
        return slice(self.first_vertex(panel), self.first_vertex(panel + 1))


def mesh_pattern(pattern: Pattern, edge_length: float) -> PanelMesh:
    """Mesh all pieces with triangles of about edge_length [m].

    Raises PatternError when the pattern cannot be meshed at that size, naming the piece, and for a bad edge length.
    """
    _check_edge_length(pattern, edge_length)
    plan = _Plan(pattern, edge_length)
    for _ in range(REPAIR_ROUNDS):
        _mesh_side_by_side(plan)
        mesh = _assemble(plan, [_mesh_piece(plan, index) for index in range(len(pattern.panels))])
        merged = seams.merge(len(mesh.uv), mesh.stitches)
        with ThreadPoolExecutor(1) as other:  # numpy lets go of Python while it sorts
            pinched = other.submit(seams.pinched, merged[mesh.faces], int(merged.max()) + 1)
            faults = seams.sewing_faults(mesh.faces, merged, mesh.sewn_edges)
        troubled = np.union1d(merged[faults.vertices], pinched.result())
        if plan.restore_short_edges(mesh, merged, troubled):
            continue
        if not faults:
            return mesh
        plan.cut(mesh, faults)
    names = [pattern.panels[index].name for index in np.unique(mesh.panel_of_vertex[faults.vertices])]
    raise PatternError(
        "the sewn pieces would coincide with each other",
        f"panels.{names[0]}",
        f"Check the stitches of {', '.join(names)}, or use a smaller edge length than {edge_length:g} m",
    )


def piece_frame(panel: Panel, uv: NDArray[np.float64]) -> NDArray[np.float64]:
    """World positions (K, 3) m of points (K, 2) m seen from the right side, flat where the pattern puts them."""
    x = -uv[:, 0] if panel.clockwise else uv[:, 0]
    return np.stack([x, uv[:, 1], np.zeros(len(uv))], axis=1) @ panel.rotation.T + panel.translation


@dataclass
class _Piece:
    """One meshed piece: points (V, 2), its outline first; faces; the vertices along each edge, ends included."""

    points: NDArray[np.float64]
    faces: NDArray[np.int32]
    along: list[NDArray[np.int32]]


@dataclass
class _Plan:
    """How finely each edge is cut, and which pieces are done already."""

    pattern: Pattern
    edge_length: float
    segments: dict[StitchSide, int] = field(init=False)
    partner: dict[StitchSide, StitchSide] = field(init=False)
    done: dict[int, _Piece] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.partner = {}
        for stitch in self.pattern.stitches:
            self.partner[stitch.first], self.partner[stitch.second] = stitch.second, stitch.first
        self.segments = {}
        for index, panel in enumerate(self.pattern.panels):
            for edge in range(len(panel.edges)):
                side = StitchSide(index, edge)
                sewn = self.partner.get(side)
                length = self._length(side) if sewn is None else (self._length(side) + self._length(sewn)) / 2
                short = sewn is not None and length < VERTEX_BELOW * self.edge_length
                self.segments[side] = 0 if short else max(1, round(length / self.edge_length))

    def restore_short_edges(
        self, mesh: PanelMesh, merged: NDArray[np.int32], troubled: NDArray[np.int32]
    ) -> list[StitchSide]:
        """Keep those short sewn edges as edges that became a vertex where the sewn surface is unsound; returns them.

        troubled: (K,) ids among the merged vertices.
        """
        sides = []
        for side, count in self.segments.items():
            along = self.done[side.panel].along[side.edge] + mesh.first_vertex(side.panel)
            if count == 0 and np.isin(merged[along], troubled).any():
                sides.append(side)
        for side in sides:
            self.segments[side] = 1
            self.done.pop(side.panel, None)
        return sides

    def finer(self, sides: Iterable[StitchSide]) -> None:
        """Cut each of the edges, and the edge sewn to it, into one segment more and half as many again."""
        for side in {min(side, self.partner.get(side, side), key=lambda s: (s.panel, s.edge)) for side in sides}:
            count = self.segments[side] + max(1, self.segments[side] // 2)
            if count > 1 and self._length(side) / count < FINEST * self.edge_length:
                panel = self.pattern.panels[side.panel]
                raise PatternError(
                    f"the piece is too narrow at edge {side.edge} for an edge length of {self.edge_length:g} m",
                    f"panels.{panel.name}.edges[{side.edge}]",
                    "Use a smaller edge length, or widen the piece",
                )
            for changed in {side, self.partner.get(side, side)}:
                self.segments[changed] = count
                self.done.pop(changed.panel, None)

    def cut(self, mesh: PanelMesh, faults: seams.SewingFaults) -> None:
        """Cut the faulty edges: inner ones by a vertex, outline edges by sampling their pattern edge more finely."""
        inner_owner = mesh.panel_of_vertex[faults.inner[:, 0]]
        for index in np.unique(inner_owner).tolist():
            piece = self.done[index]
            mine = faults.inner[inner_owner == index] - mesh.first_vertex(index)
            fixed = len({int(v) for along in piece.along for v in along})
            piece.points, piece.faces = split_edges(piece.points, piece.faces, mine, fixed)
        owners = mesh.panel_of_vertex[faults.outline[:, 0]].tolist()
        pairs = zip(owners, faults.outline)
        self.finer([self._side_of(index, edge - mesh.first_vertex(index)) for index, edge in pairs])

    def segments_of(self, index: int) -> list[int]:
        """Into how many segments each edge of the piece is cut."""
        return [self.segments[StitchSide(index, edge)] for edge in range(len(self.pattern.panels[index].edges))]

    def _length(self, side: StitchSide) -> float:
        return self.pattern.panels[side.panel].edges[side.edge].length

    def _side_of(self, index: int, edge: NDArray[np.int32]) -> StitchSide:
        """The pattern edge that an outline edge (2,) of the piece's mesh belongs to."""
        for number, along in enumerate(self.done[index].along):
            if np.isin(edge, along).all() and len(along) > 1:
                return StitchSide(index, number)
        raise AssertionError(f"outline edge {edge} of piece {index} belongs to no pattern edge")


def _check_edge_length(pattern: Pattern, edge_length: float) -> None:
    area = sum(abs(outline.signed_area(panel.corners)) for panel in pattern.panels)
    if not np.isfinite(edge_length) or edge_length <= 0:
        raise PatternError(f"{edge_length} m is not an edge length", "edge_length", "Give a positive length in metres")
    expected = area / (edge_length**2 * np.sqrt(3) / 2)
    if expected > VERTICES_MAX:
        message = (
            f"{area:.3g} m^2 of fabric makes about {expected:.3g} vertices at an edge length of {edge_length:g} m, "
            f"over {VERTICES_MAX}"
        )
        remedy = "Use a larger edge length, or check properties.units_in_meter and the number of panels"
        raise PatternError(message, "edge_length", remedy)


def _mesh_side_by_side(plan: _Plan) -> None:
    """Have the meshes kept that `_mesh_piece` will ask for; what can't be meshed it finds out and tells itself."""
    wanted = [index for index in range(len(plan.pattern.panels)) if index not in plan.done]
    if not 1 < len(wanted) <= PIECES_KEPT:
        return
    outlines = {sample_outline(plan.pattern.panels[k], plan.segments_of(k)).tobytes() for k in wanted}

    def mesh(boundary: bytes) -> None:
        with suppress(TriangulationError):
            if _is_outline(np.frombuffer(boundary).reshape(-1, 2)):
                triangulated(boundary, plan.edge_length)

    with ThreadPoolExecutor(min(MOST_AT_ONCE, os.cpu_count() or 1)) as threads:  # Qhull lets go of Python meanwhile
        list(threads.map(mesh, sorted(outlines, key=len, reverse=True)))


def _is_outline(boundary: NDArray[np.float64]) -> bool:
    """Whether the points (n, 2) m go around something once, counter-clockwise, without touching each other."""
    if len(boundary) < 3 or outline.signed_area(boundary) <= 0:
        return False
    return outline.self_contact(boundary, CONTACT_TOLERANCE) is None


def _mesh_piece(plan: _Plan, index: int) -> _Piece:
    """The piece's mesh; made once, and again whenever its edges were cut finer."""
    while index not in plan.done:
        panel = plan.pattern.panels[index]
        segments = plan.segments_of(index)
        boundary = sample_outline(panel, segments)
        contact = outline.self_contact(boundary, CONTACT_TOLERANCE) if len(boundary) > 2 else (0, 0)
        if contact is not None or outline.signed_area(boundary) <= 0:
            owner = np.repeat(np.arange(len(segments)), segments).tolist()
            plan.finer(StitchSide(index, owner[i]) for i in contact or range(len(owner)))
            continue
        try:
            points, faces = triangulated(boundary.tobytes(), plan.edge_length)
        except TriangulationError as error:
            remedy = "Use a smaller edge length, or widen the piece"
            raise PatternError(str(error), f"panels.{panel.name}", remedy) from error
        plan.done[index] = _Piece(points, faces, vertices_along(segments))
    return plan.done[index]


def _assemble(plan: _Plan, pieces: Sequence[_Piece]) -> PanelMesh:
    """All pieces in one mesh, with the sewn vertices."""
    pattern = plan.pattern
    counts = [len(piece.points) for piece in pieces]
    first = np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.int32)
    stitches, seam_of_stitch, sewn_edges = [], [], []
    for number, stitch in enumerate(pattern.stitches):
        pairs = _pairs(number, stitch, pieces, first)
        sewn_edges.append(np.stack([pairs[:-1], pairs[1:]], axis=2))
        pairs = pairs[pairs[:, 0] != pairs[:, 1]]
        stitches.append(pairs)
        seam_of_stitch.append(np.full(len(pairs), number, dtype=np.int32))
    faces = np.vstack([piece.faces + offset for piece, offset in zip(pieces, first)]).astype(np.int32)
    placed = np.vstack([piece_frame(panel, piece.points) for panel, piece in zip(pattern.panels, pieces)])
    laid = _lay(pattern, pieces, first)
    placed[laid.vertices] = laid.on(placed, faces, LIFT)
    return PanelMesh(
        uv=np.vstack([piece.points for piece in pieces]),
        panel_of_vertex=np.repeat(np.arange(len(pieces), dtype=np.int32), counts),
        panel_names=pattern.panel_names,
        panel_labels=tuple(panel.label for panel in pattern.panels),
        faces=faces,
        placed=placed,
        stitches=np.vstack([np.empty((0, 2), np.int32), *stitches]),
        seam_of_stitch=np.concatenate([np.empty(0, np.int32), *seam_of_stitch]),
        sewn_edges=np.vstack([np.empty((0, 2, 2), np.int32), *sewn_edges]),
        segments=np.concatenate([plan.segments_of(index) for index in range(len(pieces))]).astype(np.int32),
        laid=laid,
    )


def _lay(pattern: Pattern, pieces: Sequence[_Piece], first: NDArray[np.int32]) -> Laid:
    """Where the patches' vertices lie on the pieces beneath."""
    found = []
    for patch in pattern.patches:
        piece, host = pieces[patch.panel], pieces[patch.host]
        seen = np.array([-1.0, 1.0]) if pattern.panels[patch.host].clockwise else np.ones(2)  # from the right side
        face, weights = locate(patch.on_host(piece.points * seen) * seen, host.points[host.faces])
        sewn = [piece.along[edge] for edge in range(len(piece.along)) if edge not in patch.open]
        on_rim = np.isin(np.arange(len(piece.points)), np.concatenate(sewn))
        vertices = (np.arange(len(piece.points)) + first[patch.panel]).astype(np.int32)
        found.append(Laid(vertices, host.faces[face] + first[patch.host], weights, on_rim))
    return Laid.together(found)


def _pairs(number: int, stitch: Stitch, pieces: Sequence[_Piece], first: NDArray[np.int32]) -> NDArray[np.int32]:
    """Vertex pairs (n + 1, 2) along a seam, in the order of its first edge."""
    one, other = (pieces[side.panel].along[side.edge] + first[side.panel] for side in (stitch.first, stitch.second))
    if len(one) != len(other):
        raise PatternError(
            f"its sides come to {len(one)} and {len(other)} vertices, which can't be sewn to each other",
            f"stitches[{number}]",
            "Use a smaller edge length, or more vertices",
        )
    return np.stack([one, other[::-1] if stitch.reversed else other], axis=1)
