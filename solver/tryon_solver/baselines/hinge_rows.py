"""Bending of single hinges, for solvers that work hinge by hinge; the energy is that of materials/bending.py."""

from __future__ import annotations

import numpy as np

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
