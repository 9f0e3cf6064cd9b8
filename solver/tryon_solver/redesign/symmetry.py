"""Symmetric pieces: which piece is another's mirror image on the body, left for right, and what of it is where."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tryon_solver.geometry import curves
from tryon_solver.geometry.curves import Points
from tryon_solver.geometry.pattern import rotation_from_euler
from tryon_solver.redesign.draft import Draft, Piece

TOLERANCE = 0.01  # m that a piece's corners and the middles of its edges may miss their mirror images
MIRROR = np.array([-1.0, 1.0, 1.0])  # across x = 0, the body's middle


@dataclass(frozen=True)
class Image:
    """A piece's mirror image: the piece it is, and the vertices, edges and points of that by those of the first."""

    piece: Piece
    vertex: dict[int, int]
    edge: dict[int, int]
    turned: bool  # the edges run the other way
    linear: Points  # (2, 2), orthogonal
    offset: Points  # (2,) m

    def direction(self, by: tuple[float, float]) -> tuple[float, float]:
        """A move of the piece as one of its image, m."""
        return _pair(self.linear @ np.array(by))

    def point(self, at: tuple[float, float]) -> tuple[float, float]:
        """A point of the piece's plane as one of its image's, m."""
        return _pair(self.linear @ np.array(at) + self.offset)


def _pair(values: Points) -> tuple[float, float]:
    """Without the rounding of the map, as the edit goes into a history that people read."""
    x, y = values.round(12).tolist()
    return x, y


def find_image(draft: Draft, piece: Piece) -> Image | None:
    """The piece that is this one's mirror image, which may be itself; None when there is none within TOLERANCE.

    What lies on another piece has no place of its own by which to tell it.
    """
    if piece.fields.get("on") is not None:
        return None
    flat = _marks(draft, piece)
    wanted = _placed(draft, piece, flat) * MIRROR
    best, least = None, TOLERANCE
    for other in draft.pieces.values():
        if len(other.edges) != len(piece.edges) or other.fields.get("on") is not None:
            continue
        marks = _marks(draft, other)
        placed = _placed(draft, other, marks)
        for turned in (True, False):
            order = _order(wanted, placed, turned)
            missed = float(np.linalg.norm(placed[order] - wanted, axis=1).max())
            if missed < least:
                least = missed
                best = _image(piece, other, order, turned, flat, marks[order])
    return best


def _marks(draft: Draft, piece: Piece) -> Points:
    """Corners and middles of the edges in turn along the outline, (2 E, 2) m."""
    return np.vstack([curves.sample_by_arc_length(draft.curve(edge), 2)[:2] for edge in piece.edges])


def _placed(draft: Draft, piece: Piece, points: Points) -> Points:
    """Points (K, 2) m of the piece's plane where the pattern places them, (K, 3) m."""
    rotation = rotation_from_euler(np.radians(piece.fields.get("rotation", [0, 0, 0])))
    return points @ rotation[:, :2].T + np.array(piece.fields.get("translation", [0, 0, 0])) / draft.units_in_meter


def _order(wanted: Points, placed: Points, turned: bool) -> np.ndarray:
    """For every mark wanted (2 E, 3) m, which of those placed is it, going around from the one nearest to the first."""
    count = len(wanted)
    first = int(np.argmin(np.linalg.norm(placed[::2] - wanted[0], axis=1))) * 2
    return (first + (-1 if turned else 1) * np.arange(count)) % count


def _image(piece: Piece, other: Piece, order: np.ndarray, turned: bool, flat: Points, image: Points) -> Image:
    # The orthogonal map that fits best: Schoenemann 1966, reflections allowed.
    u, _, vt = np.linalg.svd((image - image.mean(axis=0)).T @ (flat - flat.mean(axis=0)))
    linear = u @ vt
    edge = {k: int(order[2 * k + 1]) // 2 for k in range(len(piece.edges))}
    vertex = {
        piece.vertices.index(mine.start): other.vertices.index(other.edges[int(order[2 * k]) // 2].start)
        for k, mine in enumerate(piece.edges)
    }
    return Image(other, vertex, edge, turned, linear, image.mean(axis=0) - linear @ flat.mean(axis=0))
