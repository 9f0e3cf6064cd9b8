"""Does an opening of a garment go around a part of the body: a limb, the trunk, the head?

The body is its skin's vertices, without a skeleton: what a limb is need not be known to see that it goes through.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

OPENINGS = 24  # the longest loops are looked at, the others are holes in a garment
CORNERS = 256  # of a loop
BEYOND = 0.01  # m, so far at least a limb comes out of an opening on both of its sides


def within(points: np.ndarray, loop: np.ndarray) -> np.ndarray:
    """(P,) which points lie within a loop (L, 3), seen along the loop's area vector: by the parity of the crossings of
    a ray with it (Shimrat, Algorithm 112, CACM 5 (1962) 434)."""
    middle = loop.mean(axis=0)
    size = max(float(np.abs(loop - middle).max()), np.finfo(float).tiny)
    spokes = (loop - middle) / size
    normal = _area_vector(spokes)
    along = np.linalg.svd(np.outer(normal, normal))[0][:, 1:]
    (x, y), (a, b) = ((points - middle) / size @ along).T, (spokes @ along).T
    c, d = np.roll(a, -1), np.roll(b, -1)
    over = (b[None] > y[:, None]) != (d[None] > y[:, None])
    run = np.where(b == d, 1.0, d - b)
    beyond = x[:, None] < a + (y[:, None] - b) * (c - a) / run
    return (over & beyond).sum(axis=1) % 2 == 1


def longest(loops: Sequence[np.ndarray], vertices: np.ndarray) -> list[np.ndarray]:
    """The OPENINGS longest of these loops of ids of vertices (V, 3), the longest first."""
    lengths = [float(np.linalg.norm(vertices[ids] - vertices[np.roll(ids, 1)], axis=1).sum()) for ids in loops]
    return [loops[k] for k in np.argsort(lengths)[::-1][:OPENINGS]]


def goes_through(skin: np.ndarray, loop: np.ndarray) -> bool:
    """Whether the body whose vertices `skin` (B, 3) m are passes through the loop (L, 3) m: within it there is skin on
    both of its sides, no further from it than it is wide."""
    loop = loop[np.linspace(0, len(loop) - 1, min(len(loop), CORNERS)).astype(int)]
    middle = loop.mean(axis=0)
    spokes = loop - middle
    normal = _area_vector(spokes)
    size, length = float(np.linalg.norm(spokes, axis=1).max()), float(np.linalg.norm(normal))
    if length == 0:
        return False
    offset = skin - middle
    height = offset @ (normal / length)
    near = (np.abs(height) <= size) & (np.linalg.norm(offset, axis=1) <= np.hypot(size, size))
    height = height[near][within(skin[near], loop)]
    return bool((height > BEYOND).any() and (height < -BEYOND).any())


def _area_vector(spokes: np.ndarray) -> np.ndarray:
    """(3,) normal to a loop about the origin, as long as twice its area."""
    total: np.ndarray = np.cross(spokes, np.roll(spokes, -1, axis=0)).sum(axis=0)
    return total
