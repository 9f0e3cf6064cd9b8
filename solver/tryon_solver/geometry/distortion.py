"""How texture coordinates are stretched against the surface that they are of: a pattern's hardly, a texture's anyhow.

The map from a triangle to its texture coordinates has two singular values: by how much it lengthens one way and
another. Cloth that is worn keeps its lengths, so for a pattern both are near one, the same all over. A texture that is
stretched over an atlas's square lengthens more one way than the other; one whose charts are drawn in sizes of their own
lengthens more here than there; and both lie in a square of side one, which they fill.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

UNEVEN = 1.15, 1.3  # more one way than the other, and more here than there, than cloth is worn
FAR_FROM_EVEN = 1.5, 2.0  # the same, as no cloth is worn
HERE_AND_THERE = (10.0, 90.0)  # per cent of the surface
FILLED = 0.9  # of the unit square's side
OFF_SIZE = 0.1  # what fills the square and misses its size in metres by this share is no pattern
ROUNDING = 1e-3  # by which coordinates may lie outside of the square


@dataclass(frozen=True)
class Distortion:
    """Of texture coordinates, weighted by area: `one_way` the median of how many times more they lengthen one way than
    across it; `here` how many times more the surface's most lengthened parts than its least; `in_square` whether they
    lie in the unit square, or in another square of a grid of such, and `filled` which share of its side they take."""

    one_way: float
    here: float
    in_square: bool
    filled: float

    @property
    def uneven(self) -> bool:
        """More than cloth is worn."""
        return self.one_way > UNEVEN[0] or self.here > UNEVEN[1]

    def is_texture(self, scale: float) -> bool:
        """Whether what has `scale` times the surface's lengths in metres is a texture, no pattern."""
        if self.one_way > FAR_FROM_EVEN[0] or self.here > FAR_FROM_EVEN[1]:
            return True
        return self.in_square and (self.uneven or (self.filled >= FILLED and abs(scale - 1.0) > OFF_SIZE))

    def describe(self) -> str:
        """For people."""
        said = []
        if self.one_way > UNEVEN[0]:
            said.append(f"lengthen it {self.one_way:.2f} times more one way than the other")
        if self.here > UNEVEN[1]:
            said.append(f"lengthen some of it {self.here:.2f} times more than the rest")
        if self.in_square and not said:
            said.append("fill the unit square")
        return " and ".join(said)


def measure(corners: np.ndarray, uv: np.ndarray) -> Distortion:
    """The distortion of texture coordinates uv (F, 3, 2) of triangles `corners` (F, 3, 3), none without area."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    c, d = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    double_area = np.linalg.norm(np.cross(a, b), axis=1)
    aa, bb, ab = (np.einsum("fk,fk->f", p, q) for p, q in ((a, a), (b, b), (a, b)))
    cc, dd, cd = (np.einsum("fk,fk->f", p, q) for p, q in ((c, c), (d, d), (c, d)))
    # for the map J: sum and product of the singular values' squares are the trace of J^T J and det(J)^2
    total = (bb * cc - 2 * ab * cd + aa * dd) / double_area**2
    product = np.abs(c[:, 0] * d[:, 1] - c[:, 1] * d[:, 0]) / double_area
    large = np.sqrt(0.5 * (total + np.sqrt(np.maximum(total**2 - 4 * product**2, 0.0))))
    ratio = large**2 / np.maximum(product, 1e-30)
    low, high = _percentiles(np.sqrt(product), double_area, HERE_AND_THERE)
    least, most = uv.min(axis=(0, 1)), uv.max(axis=(0, 1))
    square = np.floor(least + ROUNDING)
    in_square = bool((square >= 0).all() and (most <= square + 1 + ROUNDING).all())
    one_way = float(_percentiles(ratio, double_area, (50.0,))[0])
    return Distortion(one_way, float(high / max(low, 1e-30)), in_square, float((most - least).max()))


def _percentiles(values: np.ndarray, weights: np.ndarray, shares: tuple[float, ...]) -> np.ndarray:
    order = np.argsort(values)
    reached = np.cumsum(weights[order])
    return values[order[np.searchsorted(reached, np.array(shares) / 100.0 * reached[-1])]]
