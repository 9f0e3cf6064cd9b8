"""Pattern coordinates on their way from one value edit to the next, so that the cloth is not kicked.

Every vertex goes straight. Twice the signed area of a triangle is then a quadratic polynomial of the share s of the
way, and so is each side's squared length; so is LARGEST_ASPECT times the one less the other, which is positive exactly
when no side is too long for the triangle's height, in particular none turned over. With the Bernstein coefficients

    q(s) = a (1 - s)^2 + 2 b s (1 - s) + c s^2

q is positive in all of [0, 1] exactly when a > 0, c > 0 and b > -sqrt(a c): for s in between, divide by s (1 - s) and
take the least of a t + 2 b + c / t over t > 0.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tryon_solver.geometry.altitudes import LARGEST_ASPECT, Side, Sides, sides_of
from tryon_solver.geometry.constrained import Points
from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.redesign.remesh import Remesh

ROUNDING = 1e-12  # of sqrt(a c): nearer to its bound b counts as past it


@dataclass(frozen=True)
class Ramp:
    """A way from pattern coordinates `before` (V, 2) m to a mesh's, on which no triangle turns over or is too flat.

    `largest_strain` is the largest logarithm of the ratio of a triangle's side after to before, or before to after.
    """

    before: Points
    after: PanelMesh
    largest_strain: float

    def at(self, share: float) -> PanelMesh:
        """The mesh at this share of the way, 0 to 1; flat pieces lie where they do at its end all the while."""
        return replace(self.after, uv=(1 - share) * self.before + share * self.after.uv)

    def longest_way(self) -> float:
        """How far a vertex goes [m], at most."""
        return float(np.linalg.norm(self.after.uv - self.before, axis=1).max(initial=0.0))


def begin_ramp(before: PanelMesh, after: PanelMesh) -> Ramp | Remesh:
    """The way between two meshes of a drag, or from one of another ramp to one of a drag; else why there is none.

    The thickness of the cloth is not looked at: on the way a triangle may be lower than at both ends. A triangle is
    plainly sound where each of the three coefficients of its areas is over what the square of any side, and the product
    of any two, can be; only the others are looked at side by side.
    """
    one, other = sides_of(before.uv, before.faces), sides_of(after.uv, after.faces)
    a, c = LARGEST_ASPECT * _crossed(one, one), LARGEST_ASPECT * _crossed(other, other)
    b = 0.5 * LARGEST_ASPECT * (_crossed(one, other) + _crossed(other, one))
    longest = max(_longest_squared(one), _longest_squared(other))
    doubtful = np.flatnonzero(~(np.minimum(np.minimum(a, c), b) > longest))
    way = Ramp(before.uv, after, _largest_strain(one, other))
    if not len(doubtful):
        return way
    a, b, c = a[doubtful], b[doubtful], c[doubtful]
    margin = np.full(len(a), np.inf)  # m^2, of the worst side; no way where it is not positive
    for p, q in zip(_of(one, doubtful), _of(other, doubtful)):
        a_side, b_side, c_side = a - _dot(p, p), b - _dot(p, q), c - _dot(q, q)
        ends = np.minimum(a_side, c_side)
        between = b_side + (1 - ROUNDING) * np.sqrt(np.maximum(a_side, 0.0) * np.maximum(c_side, 0.0))
        margin = np.minimum(margin, np.minimum(ends, between))
    worst = int(np.argmin(margin))
    if margin[worst] > 0:
        return way
    name = after.panel_names[int(after.panel_of_face[doubtful[worst]])]
    on_the_way = "on the way its fabric would fold over itself or be almost without width"
    return Remesh(f"{name!r} can't be drawn gradually into its new shape: {on_the_way}", name)


def _largest_strain(before: Sides, after: Sides) -> float:
    """As in Ramp: of the smallest ratio and the largest, which takes fewer logarithms than there are sides."""
    ratios = [_dot(now, now) / _dot(then, then) for then, now in zip(before, after)]
    least, most = min(float(one.min()) for one in ratios), max(float(one.max()) for one in ratios)
    return 0.5 * float(np.abs(np.log([least, most])).max())


def _crossed(one: Sides, other: Sides) -> Points:
    """(F,) m^2: the first sides of one crossed with the second sides of the other; of itself, twice the areas."""
    (x, y), (u, v) = one[0], other[1]
    return x * v - y * u


def _longest_squared(sides: Sides) -> float:
    """m^2, no less than the square of any of them."""
    return max(float(max(x.max(), -x.min())) ** 2 + float(max(y.max(), -y.min())) ** 2 for x, y in sides)


def _of(sides: Sides, faces: NDArray[np.intp]) -> list[Side]:
    """Those of these triangles alone."""
    return [(x[faces], y[faces]) for x, y in sides]


def _dot(one: Side, other: Side) -> Points:
    """(F,) m^2 of two sides of each triangle."""
    return one[0] * other[0] + one[1] * other[1]
