"""A specification taken apart so that it can be changed: pieces, edges and seams that know each other, in metres.

Vertices and edges are objects, not indices, so that dividing an edge leaves all seams right. What no edit touched is
written back as it was read, to the digit and with whatever else the file holds.
"""

from __future__ import annotations

import pickle
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tryon_solver.geometry import curves, outline
from tryon_solver.geometry.curves import Points
from tryon_solver.geometry.pattern import PatternError, edge_curve
from tryon_solver.geometry.seam_numbers import SEAM_NUMBER, number_of
from tryon_solver.redesign.edit_error import EditError, choose_one_of

OUTLINE_SEGMENTS = 32  # straight pieces that stand for a curved edge in an outline


@dataclass(eq=False)
class Vertex:
    """A corner of a piece."""

    position: Points  # (2,) m
    read: tuple[Points, Any] | None = None  # where it was (2,) m, and how the file wrote that


@dataclass(eq=False)
class Edge:
    """An edge from one vertex to the next along the outline."""

    start: Vertex
    end: Vertex
    fields: dict[str, Any]  # all that the file says of it but the end points

    @property
    def curvature(self) -> Any:
        """As in the file, relative to the edge; None for a straight line."""
        return self.fields.get("curvature")

    def curved(self, curvature: Any) -> dict[str, Any]:
        """Its fields with another curvature."""
        kept = {name: value for name, value in self.fields.items() if name != "curvature"}
        return kept if curvature is None else {**kept, "curvature": curvature}


@dataclass(eq=False)
class Piece:
    """A piece of fabric: its vertices in the file's order, its edges around the outline."""

    name: str
    vertices: list[Vertex]
    edges: list[Edge]
    fields: dict[str, Any]  # all that the file says of it but vertices and edges

    def before(self, edge: Edge) -> Edge:
        """The edge that ends where this one starts."""
        return self.edges[self.edges.index(edge) - 1]

    def after(self, edge: Edge) -> Edge:
        """The edge that starts where this one ends."""
        return self.edges[(self.edges.index(edge) + 1) % len(self.edges)]


@dataclass(eq=False)
class Seam:
    """Two edges sewn together."""

    first: Edge
    second: Edge
    flags: list[str]
    ratio: float  # of the first's length to the second's, as they are meant to be
    number: int  # by which people know it, from 1: it stays, whichever seams come and go

    def other(self, edge: Edge) -> Edge:
        """The edge that this one is sewn to."""
        return self.second if edge is self.first else self.first

    @property
    def reversed(self) -> bool:
        """The start of one comes to the end of the other."""
        return "right_wrong" not in self.flags

    def ends(self) -> list[tuple[Vertex, Vertex]]:
        """The two pairs of vertices that the seam makes one each, that of the first edge first."""
        pair = (self.second.end, self.second.start) if self.reversed else (self.second.start, self.second.end)
        return [(self.first.start, pair[0]), (self.first.end, pair[1])]


@dataclass
class Draft:
    """A pattern under change."""

    rest: dict[str, Any]  # the specification without panels, stitches and their order
    pieces: dict[str, Piece]
    seams: list[Seam]
    units_in_meter: float
    notes: list[str] = field(default_factory=list)  # what happened besides, for the designer

    def piece(self, name: str, place: str = "panel") -> Piece:
        """The piece of that name. Raises EditError naming the closest when there is none."""
        if name not in self.pieces:
            raise EditError(f"there is no piece {name!r}", place, choose_one_of(name, self.pieces))
        return self.pieces[name]

    def edge(self, name: str, index: int, panel: str = "panel", place: str = "edge") -> Edge:
        """The edge of that index of the piece. Raises EditError when there is none."""
        edges = self.piece(name, panel).edges
        if index >= len(edges):
            raise EditError(f"piece {name!r} has no edge {index}", place, f"Use 0 to {len(edges) - 1}")
        return edges[index]

    def vertex(self, name: str, index: int) -> Vertex:
        """The vertex of that index of the piece. Raises EditError when there is none."""
        vertices = self.piece(name).vertices
        if index >= len(vertices):
            raise EditError(f"piece {name!r} has no vertex {index}", "vertex", f"Use 0 to {len(vertices) - 1}")
        return vertices[index]

    def piece_of(self, edge: Edge) -> Piece:
        """The piece that the edge belongs to."""
        return next(piece for piece in self.pieces.values() if edge in piece.edges)

    def seam_at(self, edge: Edge) -> Seam | None:
        """The seam that the edge is sewn in; None for an open edge."""
        return next((seam for seam in self.seams if edge in (seam.first, seam.second)), None)

    def seam(self, name: str, index: int) -> Seam:
        """The seam of that edge. Raises EditError when it is not sewn."""
        found = self.seam_at(self.edge(name, index))
        if found is None:
            remedy = "Choose an edge that is sewn, or close a seam there first"
            raise EditError(f"edge {index} of {name!r} is not sewn to anything", "edge", remedy)
        return found

    def sew(self, first: Edge, second: Edge, flags: Sequence[str] = (), ratio: float = 1.0) -> None:
        """A seam that was not there before, with a number that none has."""
        self.seams.append(Seam(first, second, [*flags], ratio, self.free_number()))

    def free_number(self) -> int:
        """Higher than those of all seams."""
        return 1 + max((seam.number for seam in self.seams), default=0)

    def curve(self, edge: Edge) -> curves.Curve:
        """The edge's curve in its piece, m. Raises EditError when the edge has come to have none."""
        if np.hypot(*(edge.end.position - edge.start.position)) == 0:
            raise EditError(f"{self.said(edge)} loses its length", "edge", "Keep its two ends apart")
        scale = 1 / self.units_in_meter
        try:
            return edge_curve(edge.curvature, edge.start.position, edge.end.position, "edge", scale)
        except PatternError as error:
            raise EditError(f"{self.said(edge)} can't be bent so: {error.message}", "edge", error.remedy) from error

    def length(self, edge: Edge) -> float:
        """m"""
        return curves.length(self.curve(edge))

    def outline(self, piece: Piece) -> Points:
        """The piece's outline as a polygon (n, 2) m."""
        return np.vstack([self._sampled(edge)[:-1] for edge in piece.edges])

    def covers(self, piece: Piece, points: Points) -> bool:
        """Do these points (K, 2) m of the piece's plane lie on it?"""
        return bool(outline.contains(self.outline(piece), points).all())

    def free_name(self, name: str) -> str:
        """The name, or with a number where a piece has it."""
        number, free = 1, name
        while free in self.pieces:
            number, free = number + 1, f"{name}_{number + 1}"
        return free

    def _sampled(self, edge: Edge) -> Points:
        curve = self.curve(edge)
        return curves.sample_by_arc_length(curve, 1 if curves.is_straight(curve) else OUTLINE_SEGMENTS)

    def turns(self, piece: Piece) -> float:
        """1 when the outline turns counter-clockwise, -1 when clockwise."""
        return float(np.sign(outline.signed_area(self.outline(piece))))

    def said(self, edge: Edge) -> str:
        """The edge in words."""
        piece = self.piece_of(edge)
        return f"edge {piece.edges.index(edge)} of {piece.name!r}"

    def written(self) -> dict[str, Any]:
        """The specification as it is now."""
        place: dict[Edge, dict[str, Any]] = {}
        panels: dict[str, Any] = {}
        for name, piece in self.pieces.items():
            index = {vertex: i for i, vertex in enumerate(piece.vertices)}
            ends = [[index[edge.start], index[edge.end]] for edge in piece.edges]
            panels[name] = {
                **piece.fields,
                "vertices": [self._vertex(vertex) for vertex in piece.vertices],
                "edges": [{"endpoints": pair, **edge.fields} for pair, edge in zip(ends, piece.edges)],
            }
            place |= {edge: {"panel": name, "edge": i} for i, edge in enumerate(piece.edges)}
        stitches = [
            [{**place[seam.first], **_numbered(seam, at)}, dict(place[seam.second]), *seam.flags]
            for at, seam in enumerate(self.seams)
        ]
        order = {"panel_order": list(panels)} if "panel_order" in self.rest["pattern"] else {}
        body = {**self.rest["pattern"], "panels": panels, "stitches": stitches, **order}
        return {**self.rest, "pattern": body}

    def _vertex(self, vertex: Vertex) -> Any:
        if vertex.read is not None and np.array_equal(vertex.read[0], vertex.position):
            return vertex.read[1]
        return (vertex.position * self.units_in_meter).tolist()


def read_draft(specification: Mapping[str, Any]) -> Draft:
    """A draft of a specification that parse_pattern has passed; it shares nothing with the draft."""
    spec = pickle.loads(pickle.dumps(dict(specification)))  # of plain values the quicker way to a deep copy
    units = float(spec["properties"]["units_in_meter"])
    body = spec["pattern"]
    panels = body["panels"]
    pieces = {name: _piece(name, panels[name], units) for name in body.get("panel_order") or panels}
    draft = Draft(spec, pieces, [], units)
    for at, entry in enumerate(body.get("stitches", [])):
        first, second = (pieces[side["panel"]].edges[side["edge"]] for side in entry[:2])
        ratio = draft.length(first) / draft.length(second)
        draft.seams.append(Seam(first, second, entry[2:], ratio, number_of(entry[0], at)))
    return draft


def _numbered(seam: Seam, at: int) -> dict[str, int]:
    """What a file says of its number beside its first edge: nothing where it is that of its place, counted from 0."""
    return {} if seam.number == at + 1 else {SEAM_NUMBER: seam.number}


def _piece(name: str, panel: Mapping[str, Any], units: float) -> Piece:
    positions = [np.array(given, dtype=np.float64) / units for given in panel["vertices"]]
    vertices = [Vertex(at, (at.copy(), given)) for at, given in zip(positions, panel["vertices"])]
    edges = []
    for given in panel["edges"]:
        start, end = given["endpoints"]
        edges.append(Edge(vertices[start], vertices[end], {k: v for k, v in given.items() if k != "endpoints"}))
    return Piece(name, vertices, edges, {k: v for k, v in panel.items() if k not in ("vertices", "edges")})
