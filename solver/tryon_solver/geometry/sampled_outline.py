"""Where the vertices along a piece's outline lie: every edge of the pattern cut into equal arc lengths."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tryon_solver.geometry import curves
from tryon_solver.geometry.curves import Points
from tryon_solver.geometry.pattern import Panel, PatternEdge


def sample_outline(panel: Panel, segments: Sequence[int]) -> Points:
    """The piece's outline (n, 2) m seen from the right side, n the sum of `segments`, into which its edges are cut."""
    return joined_outline([sample_edge(edge, n) for edge, n in zip(panel.edges, segments)], panel.clockwise)


def sample_edge(edge: PatternEdge, segments: int) -> Points:
    """Points (segments + 1, 2) m along an edge, both ends included; of one that becomes a vertex, its start (1, 2)."""
    return curves.sample_by_arc_length(edge.curve, max(segments, 1))[: segments + 1]


def joined_outline(edges: Sequence[Points], clockwise: bool) -> Points:
    """The outline (n, 2) m, seen from the right side, of a piece whose edges were sampled, points (K, 2) m each.

    A vertex that edges became lies in the mean of the corners that they joined.
    """
    segments = [len(points) - 1 for points in edges]
    boundary = np.zeros((sum(segments), 2))
    corners: list[list[Points]] = [[] for _ in boundary]
    for points, ids in zip(edges, vertices_along(segments)):
        boundary[ids[1:-1]] = points[1:-1]
        corners[ids[0]].append(points[0])
    for corner, points_there in enumerate(corners):
        if points_there:
            boundary[corner] = np.mean(points_there, axis=0)
    return boundary * (-1.0 if clockwise else 1.0, 1.0)


def vertices_along(segments: Sequence[int]) -> list[NDArray[np.int32]]:
    """Ids of the outline's vertices along each edge that is cut into so many segments, both ends included."""
    starts = np.concatenate([[0], np.cumsum(segments)[:-1]])
    count = max(sum(segments), 1)
    return [((start + np.arange(n + 1)) % count).astype(np.int32) for start, n in zip(starts, segments)]
