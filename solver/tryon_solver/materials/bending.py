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


def hinge_rows(garment: Garment) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Ids (H, 4) of v0 v1 v2 v3, rows K (H, 4) and rest areas A0 + A1 (H,) m^2, from the pattern of each side.

    Each triangle is measured in its own panel, so a hinge across a seam is flat at rest as sewn fabric is.
    """
    hinges, corners = garment.hinges(), garment.connectivity.hinge_corners
    area = garment.signed_areas()
    u, v = np.ascontiguousarray(garment.uv_corners.reshape(-1, 2).T)
    cot = []  # [side][end]: cotangents at the edge's ends within that side's triangle
    for side in range(2):
        v0, v1, opposite = (np.array([u[corner], v[corner]]) for corner in corners[side])
        cot.append([cotangent(v1 - v0, opposite - v0), cotangent(v0 - v1, opposite - v1)])
    # K applied to the corners vanishes for a flat hinge: the weights of v0 carry the cotangents at v1 and vice versa
    k = np.column_stack([cot[0][1] + cot[1][1], cot[0][0] + cot[1][0], -cot[0][0] - cot[0][1], -cot[1][0] - cot[1][1]])
    return hinges[:, :4], k, area[hinges[:, 4]] + area[hinges[:, 5]]


def cotangent(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(H,) of the angles between a and b, (2, H) each."""
    return (a[0] * b[0] + a[1] * b[1]) / np.abs(a[0] * b[1] - a[1] * b[0])


def matrix(garment: Garment, k_bend: np.ndarray) -> sp.csr_matrix:
    """(N, N) float64 N/m: the constant bending matrix; `k_bend` (F,) N m per face, at a hinge the mean of its two."""
    _, k, area = hinge_rows(garment)
    sides = garment.hinges()[:, 4:]
    stiffness = 0.5 * (k_bend[sides[:, 0]] + k_bend[sides[:, 1]])
    entries = ((stiffness / area)[:, None] * k)[:, :, None] * k[:, None, :]
    return garment.connectivity.hinge_sum.matrix(entries)
