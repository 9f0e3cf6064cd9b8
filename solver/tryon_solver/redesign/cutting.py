"""Cutting a piece in two along a straight line."""

from __future__ import annotations

from copy import deepcopy
from itertools import pairwise

import numpy as np
import scipy  # loads its optimize, which takes 0.2 s, when that is first asked for

from tryon_solver.geometry import curves, outline
from tryon_solver.geometry.curves import Points
from tryon_solver.geometry.pattern import rotation_from_euler
from tryon_solver.redesign.dividing import divide
from tryon_solver.redesign.draft import Draft, Edge, Piece, Vertex
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.edits import Cut
from tryon_solver.redesign.patching import hosts_no_more, refuse_patch

SNAP = 2e-3  # m; a cut that comes nearer to a vertex goes through it: no cutter leaves so short an edge
OPEN_GAP = 0.02  # m between the parts of an open cut where the pattern places them: unsewn edges may not start in touch
SAMPLES = 64  # parts of a curve each of which the line crosses once at most
ROUNDING = 1e-12  # m from the line; what is nearer is on it
OUTSIDE = "Draw a straight line from outside of the piece across it to outside"
TWICE = "Draw it so that it enters the piece once and leaves it once, through its inside and not along its outline"


def cut(draft: Draft, edit: Cut) -> None:
    """Edits Cut."""
    piece = draft.piece(edit.panel)
    line = np.array(edit.line)
    if np.hypot(*(line[1] - line[0])) < SNAP:
        raise EditError("the two points of the line are one", "line", OUTSIDE)
    refuse_patch(piece, "it can't be cut")
    first, second = _points(draft, piece, line)
    a, b = (_vertex_at(draft, piece, line, point) for point in (first, second))
    start = next(i for i, edge in enumerate(piece.edges) if edge.start is a)
    around = piece.edges[start:] + piece.edges[:start]
    middle = next(i for i, edge in enumerate(around) if edge.start is b)
    pair = _part(piece, around[:middle]), _part(piece, around[middle:])
    sewn = [any(draft.seam_at(edge) for edge in part.edges) for part in pair]
    areas = [round(abs(outline.signed_area(draft.outline(part))), 6) for part in pair]  # of equals always the same
    kept, new = pair if (sewn[0], areas[0]) >= (sewn[1], areas[1]) else pair[::-1]
    new.name = draft.free_name(piece.name)
    if edit.sewn:
        draft.sew(kept.edges[-1], new.edges[-1])
    else:
        _move_away(draft, new)
    falls = not edit.sewn and sewn[0] != sewn[1]
    parts = (kept,) if falls else (kept, new)
    draft.pieces = {each.name: each for old in draft.pieces.values() for each in (parts if old is piece else (old,))}
    hosts_no_more(draft, piece, parts)
    what = "the other part is sewn to nothing and is taken away" if falls else f"the other part is now {new.name!r}"
    draft.notes.append(f"{piece.name!r} is cut: {what}")


def crosses(draft: Draft, edit: Cut) -> bool:
    """Whether the cut's line crosses its piece, once, as a cut must."""
    try:
        _points(draft, draft.piece(edit.panel), np.array(edit.line))
    except EditError:
        return False
    return True


def _points(draft: Draft, piece: Piece, line: Points) -> list[Points]:
    """The two points (2,) m where the line (2, 2) m crosses the outline; raises EditError when it does not cut once."""
    points: list[Points] = []
    crossings = _crossings(draft, piece, line)
    for (edge, _, _), (next_edge, _, _) in pairwise(crossings):
        if edge is next_edge and curves.is_straight(draft.curve(edge)):  # two lines that meet twice are one
            raise EditError(f"the line runs along {draft.said(edge)}", "line", TWICE)
    for _, _, point in crossings:
        vertex = _near_vertex(piece, point)
        point = point if vertex is None else vertex.position
        if all(np.hypot(*(point - other)) > SNAP for other in points):
            points.append(point)
    if len(points) != 2:
        times = {0: "does not cross", 1: "crosses only once"}.get(len(points), f"crosses {len(points)} times")
        remedy = OUTSIDE if len(points) < 2 else TWICE
        raise EditError(f"the line {times} the outline of {piece.name!r}", "line", remedy)
    if not outline.contains(draft.outline(piece), np.array([(points[0] + points[1]) / 2]))[0]:
        raise EditError(f"the line runs outside of {piece.name!r} from one crossing to the other", "line", OUTSIDE)
    return points


def _crossings(draft: Draft, piece: Piece, line: Points) -> list[tuple[Edge, float, Points]]:
    """Edge, parameter and point (2,) m of every crossing of the outline with the line (2, 2) m, between its ends."""
    length = float(np.hypot(*(line[1] - line[0])))
    along = (line[1] - line[0]) / length
    across = np.array([-along[1], along[0]])
    found = []
    for edge in piece.edges:
        curve = draft.curve(edge)

        def side(t: float, curve: curves.Curve = curve) -> float:
            return float((curve.points([t])[0] - line[0]) @ across)

        t = np.linspace(0, 1, SAMPLES + 1)
        sides = (curve.points(t) - line[0]) @ across
        sides[np.abs(sides) < ROUNDING] = 0
        for k in range(SAMPLES):
            if sides[k] == 0 or sides[k] * sides[k + 1] < 0:
                at = t[k] if sides[k] == 0 else scipy.optimize.brentq(side, t[k], t[k + 1], xtol=1e-14)
                point = curve.points([at])[0]
                if -SNAP <= (point - line[0]) @ along <= length + SNAP:
                    found.append((edge, float(at), point))
    return found


def _near_vertex(piece: Piece, point: Points) -> Vertex | None:
    nearest = min(piece.vertices, key=lambda vertex: float(np.hypot(*(vertex.position - point))))
    return nearest if np.hypot(*(nearest.position - point)) <= SNAP else None


def _vertex_at(draft: Draft, piece: Piece, line: Points, point: Points) -> Vertex:
    """The piece's vertex at the crossing at this point (2,) m; its edge is divided there when there is none."""
    vertex = _near_vertex(piece, point)
    if vertex is not None:
        return vertex
    crossings = _crossings(draft, piece, line)
    edge, t, _ = min(crossings, key=lambda crossing: float(np.hypot(*(crossing[2] - point))))
    return divide(draft, edge, curves.share_at(draft.curve(edge), t))


def _part(piece: Piece, edges: list[Edge]) -> Piece:
    """A piece of these edges in a row and the cut from the last's end to the first's start, in vertices of its own."""
    own = {vertex: Vertex(vertex.position, vertex.read) for edge in edges for vertex in (edge.start, edge.end)}
    for edge in edges:
        edge.start, edge.end = own[edge.start], own[edge.end]
    closing = Edge(edges[-1].end, edges[0].start, {})
    order = [own[vertex] for vertex in piece.vertices if vertex in own]
    return Piece(piece.name, order, [*edges, closing], deepcopy(piece.fields))


def _move_away(draft: Draft, new: Piece) -> None:
    """Place the new part so far away from the other that they don't touch."""
    edge = new.edges[-1]
    along = edge.end.position - edge.start.position
    outward = draft.turns(new) * np.array([along[1], -along[0]]) / np.hypot(*along)
    rotation = rotation_from_euler(np.radians(new.fields.get("rotation", [0, 0, 0])))
    shift = rotation[:, :2] @ (-OPEN_GAP * outward) * draft.units_in_meter
    new.fields["translation"] = (np.array(new.fields.get("translation", [0, 0, 0])) + shift).tolist()
