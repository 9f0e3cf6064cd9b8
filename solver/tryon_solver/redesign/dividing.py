"""Dividing edges: a seam is divided on both of its sides, at the same share of its length."""

from __future__ import annotations

from tryon_solver.geometry import curves
from tryon_solver.redesign.draft import Draft, Edge, Seam, Vertex
from tryon_solver.redesign.edge_shapes import halves


def divide(draft: Draft, edge: Edge, share: float) -> Vertex:
    """Divide the edge at this share of its length, and what it is sewn to likewise. The new vertex of the edge."""
    seam = draft.seam_at(edge)
    first, second = divide_side(draft, edge, share)
    if seam is not None:
        sew_parts(draft, seam, edge, (first, second), share)
    return first.end


def divide_side(draft: Draft, edge: Edge, share: float) -> tuple[Edge, Edge]:
    """Divide the edge alone; seams that it is in are to be mended by sew_parts."""
    piece = draft.piece_of(edge)
    position, before, after = halves(draft, edge, curves.parameter_at(draft.curve(edge), share))
    vertex = Vertex(position)
    parts = Edge(edge.start, vertex, edge.curved(before)), Edge(vertex, edge.end, edge.curved(after))
    place = piece.edges.index(edge)
    piece.edges[place : place + 1] = parts
    piece.vertices.append(vertex)
    return parts


def sew_parts(draft: Draft, seam: Seam, edge: Edge, parts: tuple[Edge, Edge], share: float) -> None:
    """Replace the seam of an edge that was divided by those of its parts, the other side divided at this share."""
    other = seam.other(edge)
    one, two = divide_side(draft, other, 1 - share if seam.reversed else share)
    names = draft.piece_of(one).name, draft.piece_of(parts[0]).name
    draft.notes.append(f"{names[0]!r} is divided, too, where it is sewn to {names[1]!r}")
    pairs = zip(parts, (two, one) if seam.reversed else (one, two))
    sewn = [(mine, its) if edge is seam.first else (its, mine) for mine, its in pairs]
    place = draft.seams.index(seam)
    numbers = seam.number, draft.free_number()
    draft.seams[place : place + 1] = [
        Seam(*sides, list(seam.flags), seam.ratio, number) for sides, number in zip(sewn, numbers)
    ]
