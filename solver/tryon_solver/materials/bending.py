"""Isometric bending of an initially flat fabric: exactly quadratic, no local step.

    Psi = 1/2 sum_e x^T (Q_e (x) I3) x,   Q_e = k_b/(A0 + A1) K^T K,
    K = (c03 + c04, c01 + c02, -c01 - c03, -c02 - c04)

over the hinge's edge ends v0 v1 and opposite vertices v2 v3, with cij the cotangents of the angles at v0 and v1 in the
two triangles. Source: Bergou et al. 2006, "A quadratic bending model for inextensible surfaces", section 3.

Their coefficient is 3 k_b. It spreads the mean curvature over all edges, which suits a sphere. Cloth bends to
developable shapes: a panel on a cylinder of radius r costs 1/2 k_b A/r^2 for the flexural rigidity k_b exactly when the
coefficient is 1, in every direction of a well-shaped mesh (tests/solver/derivatives), so that k_bend is the number a
bending test of fabric gives.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from tryon_solver.geometry.garment import Garment


def hinge_rows(garment: Garment, hinges: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Ids (H, 4) of v0 v1 v2 v3, rows K (H, 4) and rest areas A0 + A1 (H,) m^2, from the pattern of each side.

    Each triangle is measured in its own panel, so a hinge across a seam is flat at rest as sewn fabric is. `hinges` are
    the garment's, for who has them.
    """
    hinges = garment.hinges() if hinges is None else hinges
    area = garment.signed_areas()
    ids = hinges[:, :4]
    cot = np.empty((len(hinges), 2, 2))  # [hinge, side, end]: cotangent at the edge's end within that side's triangle
    for side in range(2):
        face = hinges[:, 4 + side]
        corner_of = {
            name: np.argmax(garment.faces[face] == ids[:, column, None], axis=1)
            for name, column in (("v0", 0), ("v1", 1), ("opposite", 2 + side))
        }
        p = {name: garment.uv_corners[face, corner] for name, corner in corner_of.items()}
        for end, (here, there) in enumerate((("v0", "v1"), ("v1", "v0"))):
            a, b = p[there] - p[here], p["opposite"] - p[here]
            cot[:, side, end] = (a * b).sum(1) / np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    # K applied to the corners vanishes for a flat hinge: the weights of v0 carry the cotangents at v1 and vice versa
    k = np.column_stack(
        [
            cot[:, 0, 1] + cot[:, 1, 1],
            cot[:, 0, 0] + cot[:, 1, 0],
            -cot[:, 0, 0] - cot[:, 0, 1],
            -cot[:, 1, 0] - cot[:, 1, 1],
        ]
    )
    return ids, k, area[hinges[:, 4]] + area[hinges[:, 5]]


def matrix(garment: Garment, k_bend: np.ndarray) -> sp.csr_matrix:
    """(N, N) float64 N/m: the constant bending matrix; `k_bend` (F,) N m per face, at a hinge the mean of its two."""
    hinges = garment.hinges()
    ids, k, area = hinge_rows(garment, hinges)
    stiffness = 0.5 * (k_bend[hinges[:, 4]] + k_bend[hinges[:, 5]])
    blocks = (stiffness / area)[:, None, None] * k[:, :, None] * k[:, None, :]
    rows = np.repeat(ids, 4, axis=1).ravel()
    columns = np.tile(ids, (1, 4)).ravel()
    n = garment.vertex_count
    return sp.coo_matrix((blocks.ravel(), (rows, columns)), shape=(n, n)).tocsr()
