"""The solver's energies once more, in numpy float64 and as written in their sources, and finite differences of them.

Positions may carry leading batch axes: (..., N, 3). Energies are in J, one per batch entry.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tryon_solver.geometry.garment import Garment
from tryon_solver.materials.fabric import Fabric

Energy = Callable[[np.ndarray], np.ndarray]


def deformation_gradients(x: np.ndarray, garment: Garment) -> np.ndarray:
    """(..., F, 3, 2): F = Ds Dm^-1 with the rest edges Dm taken from the pattern."""
    uv = garment.uv_corners
    rest = np.stack([uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]], axis=-1)
    corner = x[..., garment.faces, :]
    posed = np.stack([corner[..., 1, :] - corner[..., 0, :], corner[..., 2, :] - corner[..., 0, :]], axis=-1)
    return posed @ np.linalg.inv(rest)


def membrane(garment: Garment, fabric: Fabric) -> Energy:
    """A/2 (k_s |F - R|^2 + (k_u - k_s)(|f_u| - 1)^2 + (k_v - k_s)(|f_v| - 1)^2), R = U V^T of the thin SVD."""

    def energy(x: np.ndarray) -> np.ndarray:
        f = deformation_gradients(x, garment)
        u, _, vt = np.linalg.svd(f, full_matrices=False)
        shear = ((f - u @ vt) ** 2).sum((-1, -2))
        stretch = np.linalg.norm(f, axis=-2) - 1
        k_u, k_v, k_s = fabric.k_warp, fabric.k_weft, fabric.k_shear
        density = k_s * shear + (k_u - k_s) * stretch[..., 0] ** 2 + (k_v - k_s) * stretch[..., 1] ** 2
        return (0.5 * garment.signed_areas() * density).sum(-1)

    return energy


def strain_limit(garment: Garment, stiffness: float, limit: float) -> Energy:
    """A k/2 |F - T|^2 with T = U min(S, limit) V^T."""

    def energy(x: np.ndarray) -> np.ndarray:
        s = np.linalg.svd(deformation_gradients(x, garment), compute_uv=False)
        return (0.5 * garment.signed_areas() * stiffness * (np.maximum(s - limit, 0) ** 2).sum(-1)).sum(-1)

    return energy


def hinge_laplacians(garment: Garment) -> tuple[np.ndarray, np.ndarray]:
    """Rows (H, N) of the edge-based Laplacian of every interior edge, and the areas (H,) m^2 of its two triangles.

    The edge's hat function is 1 - 2 lambda_opposite per triangle: the row is -2 A grad lambda_opposite . grad.
    """
    g, area = garment.corner_gradients(), garment.signed_areas()
    hinges = garment.hinges()
    rows = np.zeros((len(hinges), garment.vertex_count))
    for row, (*_, v2, v3, f0, f1) in zip(rows, hinges):
        for face, opposite in ((f0, v2), (f1, v3)):
            apex = int(np.flatnonzero(garment.faces[face] == opposite)[0])
            np.add.at(row, garment.faces[face], -2 * area[face] * (g[face] @ g[face, apex]))
    return rows, area[hinges[:, 4]] + area[hinges[:, 5]]


def bending(garment: Garment, stiffness: float) -> Energy:
    """1/2 k sum_e |L_e x|^2/(A0 + A1), k the flexural rigidity [N m]."""
    rows, area = hinge_laplacians(garment)

    def energy(x: np.ndarray) -> np.ndarray:
        return 0.5 * stiffness * ((rows @ x) ** 2 / area[:, None]).sum((-2, -1))

    return energy


def fabric_damping(
    garment: Garment, fabric: Fabric, rate: float, x_start: np.ndarray, turns: np.ndarray | None = None
) -> Energy:
    """rate/2 of the strains' squares times the stiffnesses, plus bending's of what moved; rate is beta/dt [-]. They are
    counted from where `turns` (F, 3, 3) take the triangles, if any are given.

    The strains are the changes to first order of U = (F^T F)^(1/2) and of the columns' lengths: U dU + dU U = dC, which
    for 2 x 2 matrices is solved in a basis in which U is diagonal.
    """
    before = deformation_gradients(x_start, garment)
    before = before if turns is None else turns @ before
    _, s, vt = np.linalg.svd(before, full_matrices=False)
    sums = s[:, :, None] + s[:, None, :]
    direction = before / np.linalg.norm(before, axis=-2, keepdims=True)
    bent = bending(garment, fabric.k_bend)

    def energy(x: np.ndarray) -> np.ndarray:
        change = deformation_gradients(x, garment) - before
        half = np.swapaxes(before, -1, -2) @ change
        squared = vt @ (half + np.swapaxes(half, -1, -2)) @ np.swapaxes(vt, -1, -2)
        shear = ((squared / sums) ** 2).sum((-1, -2))
        along = (direction * change).sum(-2)
        k_u, k_v, k_s = fabric.k_warp, fabric.k_weft, fabric.k_shear
        density = k_s * shear + (k_u - k_s) * along[..., 0] ** 2 + (k_v - k_s) * along[..., 1] ** 2
        return rate * ((0.5 * garment.signed_areas() * density).sum(-1) + bent(x - x_start))

    return energy


def gradient(energy: Energy, x: np.ndarray, step: float) -> np.ndarray:
    """(N, 3) N by central differences of `step` m."""
    shifts = step * np.eye(x.size).reshape(-1, *x.shape)
    return ((energy(x + shifts) - energy(x - shifts)) / (2 * step)).reshape(x.shape)


def hessian(energy: Energy, x: np.ndarray, step: float) -> np.ndarray:
    """(3N, 3N) N/m by central differences of `step` m, symmetric by construction."""
    size = x.size
    shifts = step * np.eye(size).reshape(-1, *x.shape)
    out = np.empty((size, size))
    for i in range(size):
        plus, minus = shifts[i:] + shifts[i], shifts[i:] - shifts[i]
        mixed = energy(x + plus) - energy(x + minus) - energy(x - minus) + energy(x - plus)
        out[i, i:] = out[i:, i] = mixed / (4 * step * step)
    return out
