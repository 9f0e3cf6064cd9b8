"""What names of pieces and numbers of edges mean in what is worn: the vertices and edges of its mesh.

A piece of a garment that is worn alone goes by its own name, one of an outfit by its garment's name, a slash and its
own; whoever leaves the garment out means the only one that has such a piece.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tryon_solver.effect_words.fields import EffectError, choose_one_of
from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.lines import chain
from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.geometry.sampled_outline import vertices_along
from tryon_solver.geometry.weld import WeldedMesh

OFF_PIECE = 0.02  # m, by which a spot may miss a piece, besides an edge of the mesh
PatternEdge = Mapping[str, Any]
"""An edge as it is asked for: the name of its `panel`, its number `edge`."""


@dataclass(frozen=True, eq=False)
class Piece:
    """A piece of a garment, by both their names; `edges` the garment's vertices (K + 1,) along each edge that it has in
    the pattern, () of a garment that is a mesh; `clockwise` if its outline is drawn so, and its coordinates mirrored
    (panel_mesh.py). `fabric` is the name of what it is made of, "" where that is not known."""

    garment: str
    name: str
    edges: tuple[NDArray[np.int32], ...] = ()
    clockwise: bool = False
    fabric: str = ""

    @property
    def full_name(self) -> str:
        """With the garment's before it, if that has one."""
        return f"{self.garment}/{self.name}" if self.garment else self.name


@dataclass(frozen=True, eq=False)
class Cut:
    """What is worn: its triangles, its pieces, and where the pattern puts its vertices, (N, 3) m; 0 of those of a
    garment that is a mesh."""

    garment: Garment
    pieces: tuple[Piece, ...]
    placed: NDArray[np.float64] = field(repr=False)

    @staticmethod
    def of_mesh(garment: Garment, piece_names: Sequence[str], name: str = "") -> Cut:
        """A garment of this name that was not made of a pattern."""
        pieces = tuple(Piece(name, piece) for piece in piece_names)
        return Cut(garment, pieces, np.zeros((garment.vertex_count, 3)))

    @staticmethod
    def of_pattern(
        garment: Garment,
        panels: PanelMesh,
        welded: WeldedMesh,
        edge_counts: Sequence[int],
        name: str = "",
        clockwise: Sequence[bool] = (),
    ) -> Cut:
        """A garment of this name that was made of a pattern, whose pieces have so many edges; `clockwise` says which
        are drawn so, () for none."""
        vertex, pieces = welded.welded_of_vertex, []
        start = 0
        for panel, count in enumerate(edge_counts):
            along = vertices_along(panels.segments[start : start + count].tolist())
            first = panels.first_vertex(panel)
            edges = tuple(vertex[ids + first] for ids in along)
            drawn = bool(clockwise) and clockwise[panel]
            pieces.append(Piece(name, panels.panel_names[panel], edges, drawn))
            start += count
        placed = np.zeros((garment.vertex_count, 3))
        placed[vertex] = panels.placed
        return Cut(garment, tuple(pieces), placed)

    def made_of(self, fabric: str) -> Cut:
        """The same, all of its pieces of the fabric of this name."""
        return replace(self, pieces=tuple(replace(piece, fabric=fabric) for piece in self.pieces))

    @staticmethod
    def together(outfit: Garment, each: Sequence[Cut]) -> Cut:
        """The garments of an outfit, each of which has a name; one alone is itself."""
        if len(each) == 1:
            return each[0]
        pieces = [
            replace(piece, edges=tuple(line + np.int32(layer.vertices.start) for line in piece.edges))
            for layer, cut in zip(outfit.layers, each)
            for piece in cut.pieces
        ]
        return Cut(outfit, tuple(pieces), np.vstack([cut.placed for cut in each]))

    @property
    def panel_names(self) -> tuple[str, ...]:
        """The pieces' names, as they are told."""
        several = len({piece.garment for piece in self.pieces}) > 1
        return tuple(piece.full_name if several else piece.name for piece in self.pieces)

    def panel(self, name: str, place: str) -> int:
        """The number of the piece of this name. Raises EffectError."""
        told = self.panel_names
        for names in (told, [piece.full_name for piece in self.pieces], [piece.name for piece in self.pieces]):
            found = [number for number, known in enumerate(names) if known == name]
            if len(found) == 1:
                return found[0]
            if found:
                of = " and ".join(self.pieces[number].garment for number in found)
                remedy = f"Say whose: {' or '.join(told[number] for number in found)}"
                raise EffectError(f"{name!r:.80} is a piece of {of}", place, remedy)
        raise EffectError(f"there is no piece {name!r:.80}", place, choose_one_of(name, told))

    def full_name(self, name: str) -> str:
        """The piece's name with its garment's; what is no piece's name, as it is."""
        try:
            return self.pieces[self.panel(name, "")].full_name
        except EffectError:
            return name

    def line(self, edges: Sequence[PatternEdge], place: str) -> NDArray[np.int32]:
        """(K + 1,) vertices of the garment along these edges of the pattern, one after the other.

        Raises EffectError for an edge that there is not, or that does not go on from the one before.
        """
        way: list[int] = []
        for k, edge in enumerate(edges):
            along = [int(vertex) for vertex in self._edge(edge, f"{place}[{k}]")]
            if not way:
                way = along
                continue
            if len(way) > 1 and k == 1 and way[-1] not in (along[0], along[-1]):
                way.reverse()
            if along[0] != way[-1]:
                along.reverse()
            if along[0] != way[-1]:
                fault = f"edge {edge['edge']} of {edge['panel']} does not begin where the one before ends"
                raise EffectError(fault, f"{place}[{k}]", "List edges in their order, or make two lines of them")
            way += along[1:]
        return np.array([v for v, before in zip(way, [-1, *way]) if v != before], np.int32)

    def mesh_edges(self, edges: Sequence[PatternEdge], place: str) -> NDArray[np.int32]:
        """(K, 2) edges of the mesh along these edges of the pattern, in any order, each once, though both sides of a
        seam be named. Raises EffectError for an edge that there is not."""
        along = [chain(self._edge(edge, f"{place}[{k}]")) for k, edge in enumerate(edges)]
        together = np.vstack(along)
        _, first = np.unique(np.sort(together, axis=1), axis=0, return_index=True)
        return together[np.sort(first)]

    def vertex_at(self, panel: str, spot: tuple[float, float], place: str) -> int:
        """The garment's vertex that is nearest to the spot [m] of the piece of this name, as its pattern is drawn, in
        the size that is worn. Raises EffectError for a spot farther off the piece than OFF_PIECE."""
        number = self.panel(panel, f"{place}.panel")
        corners = self.garment.panel_of_face == number
        drawn = np.array([-1.0 if self.pieces[number].clockwise else 1.0, 1.0])
        uv = self.garment.uv_corners[corners].reshape(-1, 2) * drawn
        off = np.linalg.norm(uv - spot, axis=1)
        nearest = int(np.argmin(off))
        if off[nearest] > OFF_PIECE + self.garment.mean_edge_length():
            (left, low), (right, high) = uv.min(axis=0), uv.max(axis=0)
            remedy = f"Tell x from {left:.3g} to {right:.3g} and y from {low:.3g} to {high:.3g} m, on the piece"
            raise EffectError(f"the spot is {off[nearest]:.2g} m off {panel}", place, remedy)
        return int(self.garment.faces[corners].ravel()[nearest])

    def facing(
        self, first: NDArray[np.int32], second: NDArray[np.int32]
    ) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """Two lines (K,), (L,), the second turned about if so its ends lie nearer to those of the first, where the
        pattern puts its pieces."""
        ends = self.placed[first[[0, -1]]]
        as_is, turned = (
            np.linalg.norm(ends - self.placed[second[list(at)]], axis=1).sum() for at in ((0, -1), (-1, 0))
        )
        return first, second if as_is <= turned else second[::-1]

    def _edge(self, edge: PatternEdge, place: str) -> NDArray[np.int32]:
        piece, number = self.pieces[self.panel(edge["panel"], f"{place}.panel")], edge["edge"]
        if not piece.edges:
            remedy = "Leave it out: a garment that is a mesh has no edges of a pattern"
            raise EffectError("the garment has no pattern", place, remedy)
        if number >= len(piece.edges):
            fault = f"{edge['panel']} has no edge {number}"
            raise EffectError(fault, f"{place}.edge", f"Use 0 to {len(piece.edges) - 1}")
        return piece.edges[number]
