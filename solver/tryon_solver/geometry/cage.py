"""A piece's mesh moved by its outline: what the inside does when the outline's vertices go elsewhere.

Every inner vertex is the mean of its neighbours with the mean value weights of the mesh at rest (M. S. Floater, "Mean
value coordinates", Comput. Aided Geom. Design 20, 2003), and its displacement stays that mean of theirs. The weights
are positive in every triangulation, so that no displacement leaves the range of the outline's, and they reproduce
linear functions, so that an affine map of the outline is one of the whole piece. On a convex outline no triangle turns
over (Floater, "One-to-one piecewise linear mappings over triangulations", Math. Comp. 72, 2003); on others one may:
whoever moves a cage looks at the triangles. Inner vertices may be told to stay, as those that a pocket is sewn to do:
the others then go between them and the outline.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array, eye_array
from scipy.sparse.linalg import SuperLU, splu

from tryon_solver.geometry.constrained import Faces, Points


@dataclass(frozen=True)
class Cage:
    """A piece at rest, its `outline_count` (B) first vertices the outline, and the equations of the `free` (I,) ones of
    its inner vertices, which follow the outline.

    `points` (V, 2) m; `outline_weights` (I, B) fraction, by which they follow directly; `inner` the factor of the
    identity minus the weights among them, None where there are none.
    """

    points: Points
    outline_count: int
    free: NDArray[np.int64]
    outline_weights: csr_array
    inner: SuperLU | None

    def moved(self, outline: Points) -> Points:
        """The piece's points (V, 2) m when its outline is at (B, 2) m; at rest exactly as they were."""
        points = np.vstack([outline, self.points[self.outline_count :]])
        by = outline - self.points[: self.outline_count]
        if self.inner is not None and np.any(by):
            points[self.free] += self.inner.solve(self.outline_weights @ by)
        return points


def build_cage(points: Points, faces: Faces, outline_count: int, still: Sequence[int] | NDArray[np.int32] = ()) -> Cage:
    """The cage of a piece at rest: points (V, 2) m, the outline first, faces (F, 3) counter-clockwise, none flat, and
    which of the inner vertices stay where they are."""
    free = np.setdiff1d(np.arange(outline_count, len(points)), still)
    weights = mean_value_weights(points, faces)[free]
    weights = csr_array(weights / weights.sum(axis=1)[:, None])
    outline, inner = weights[:, :outline_count], weights[:, free]
    if not len(free):
        return Cage(points, outline_count, free, outline, None)
    # Each row's diagonal is no less than the rest of it together: elimination needs no pivots, and so keeps its order.
    matrix = (eye_array(inner.shape[0]) - inner).tocsc()
    factor = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    return Cage(points, outline_count, free, outline, factor)


def mean_value_weights(points: Points, faces: Faces) -> csr_array:
    """Weights (V, V) 1/m of vertices j around i: of the two triangles at the edge ij, tan(angle at i / 2) / |ij|.

    Rows of outline vertices lack the triangles outside.
    """
    rows, columns, values = [], [], []
    for k in range(3):
        at, one, other = faces[:, k], faces[:, (k + 1) % 3], faces[:, (k + 2) % 3]
        a, b = points[one] - points[at], points[other] - points[at]
        a_length, b_length = np.hypot(*a.T), np.hypot(*b.T)
        # tan(angle / 2) = sin / (1 + cos)
        tangent = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / (a_length * b_length + (a * b).sum(axis=1))
        rows += [at, at]
        columns += [one, other]
        values += [tangent / a_length, tangent / b_length]
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return coo_array(entries, shape=(len(points), len(points))).tocsr()
