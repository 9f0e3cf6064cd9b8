"""Membrane and strain limit by singular values: energies, gradients and Hessians of all triangles at once.

METHOD.md section 3 has the formulas. The Hessian of an isotropic energy psi(s1) + psi(s2) over F (3 x 2) is diagonal in
six modes made of F = U S V^T (after Smith, De Goes and Kim 2019); clamped modes make it positive semidefinite.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from tryon_solver.baselines.newton_ipc.discrete import Discrete

SMALLEST_STRETCH = 1e-4  # below this a triangle is a line, and the modes' quotients are taken at this stretch
LEAST_TURNED = 0.05  # below this a direction in its plane does not tell how a triangle turns


def gradients_of(discrete: Discrete, x: np.ndarray) -> np.ndarray:
    """(F, 3, 2) deformation gradients at cloth positions x (N, 3) m; rates of them of velocities."""
    return np.einsum("tid,tia->tda", x[discrete.faces], discrete.corner_gradients)


def stretched_along(f: np.ndarray) -> np.ndarray:
    """(F, 2) the direction in the pattern that is stretched most."""
    c = np.einsum("tda,tdb->tab", f, f)
    angle = 0.5 * np.arctan2(2 * c[:, 0, 1], c[:, 0, 0] - c[:, 1, 1])
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


@dataclass(frozen=True)
class Frames:
    """`f` (F, 3, 2), its singular values `s` (F, 2) and the six modes (F, 6, 3, 2) of isotropic Hessians."""

    f: np.ndarray
    s: np.ndarray
    modes: np.ndarray

    @staticmethod
    def at(discrete: Discrete, x: np.ndarray) -> Frames:
        """At cloth positions x (N, 3) m."""
        return Frames.of(gradients_of(discrete, x))

    @staticmethod
    def of(f: np.ndarray) -> Frames:
        """Of deformation gradients (F, 3, 2)."""
        v1 = stretched_along(f)
        cos, sin = v1[:, :1], v1[:, 1:]
        stretched = cos * f[:, :, 0] + sin * f[:, :, 1], cos * f[:, :, 1] - sin * f[:, :, 0]
        s = np.stack([np.linalg.norm(column, axis=1) for column in stretched], axis=1)
        u1, u2 = (column / np.maximum(s[:, k, None], 1e-300) for k, column in enumerate(stretched))
        n = np.cross(u1, u2)
        v2 = np.hstack([-sin, cos])
        a, b = u2[:, :, None] * v1[:, None, :], u1[:, :, None] * v2[:, None, :]
        modes = np.empty((len(f), 6, 3, 2))
        modes[:, 0], modes[:, 1] = u1[:, :, None] * v1[:, None, :], u2[:, :, None] * v2[:, None, :]
        modes[:, 2], modes[:, 3] = (a - b) / np.sqrt(2), (a + b) / np.sqrt(2)
        modes[:, 4], modes[:, 5] = n[:, :, None] * v1[:, None, :], n[:, :, None] * v2[:, None, :]
        return Frames(f, s, modes)


def isotropic_hessian(frames: Frames, slope: np.ndarray, curvature: np.ndarray, clamped: bool) -> np.ndarray:
    """(F, 3, 2, 3, 2) of psi(s1) + psi(s2) with slopes psi' and curvatures psi'' (F, 2)."""
    s1, s2 = frames.s.T
    p1, p2 = slope.T
    apart = s1 - s2
    equal = apart < 1e-9
    flip = np.where(equal, curvature[:, 0], (p1 - p2) / np.where(equal, 1.0, apart))
    out1, out2 = p1 / np.maximum(s1, SMALLEST_STRETCH), p2 / np.maximum(s2, SMALLEST_STRETCH)
    twist = (p1 + p2) / np.maximum(s1 + s2, SMALLEST_STRETCH)
    weights = np.stack([curvature[:, 0], curvature[:, 1], twist, flip, out1, out2], axis=1)
    if clamped:
        weights = np.maximum(weights, 0.0)
    flat = frames.modes.reshape(-1, 6, 6)
    return (np.swapaxes(weights[:, :, None] * flat, 1, 2) @ flat).reshape(-1, 3, 2, 3, 2)


@dataclass(frozen=True)
class Density:
    """Energy per rest area of every triangle [N/m]: value (F,) and slope over F (F, 3, 2)."""

    value: np.ndarray
    slope: np.ndarray


def membrane(discrete: Discrete, frames: Frames) -> Density:
    """1/2 (k_s |F - R|^2 + (k_u - k_s)(|f_u| - 1)^2 + (k_v - k_s)(|f_v| - 1)^2)."""
    cloth, f, s = discrete.fabric, frames.f, frames.s
    rotation = frames.modes[:, 0] + frames.modes[:, 1]
    value = 0.5 * cloth.k_shear * ((s - 1) ** 2).sum(1)
    slope = cloth.k_shear * (f - rotation)
    for a, k in enumerate((cloth.k_warp - cloth.k_shear, cloth.k_weft - cloth.k_shear)):
        length = np.linalg.norm(f[:, :, a], axis=1)
        value = value + 0.5 * k * (length - 1) ** 2
        slope[:, :, a] += k * (1 - 1 / length)[:, None] * f[:, :, a]
    return Density(value, slope)


def membrane_hessian(discrete: Discrete, frames: Frames, clamped: bool) -> np.ndarray:
    """(F, 3, 2, 3, 2) N/m; `clamped` to its positive semidefinite part, term by term."""
    cloth, f, s = discrete.fabric, frames.f, frames.s
    hessian = cloth.k_shear * isotropic_hessian(frames, s - 1, np.ones_like(s), clamped)
    for a, k in enumerate((cloth.k_warp - cloth.k_shear, cloth.k_weft - cloth.k_shear)):
        length = np.linalg.norm(f[:, :, a], axis=1)
        d = f[:, :, a] / length[:, None]
        across = 1 - 1 / length
        if clamped:
            across = np.maximum(across, 0.0)
        along = d[:, :, None] * d[:, None, :]
        hessian[:, :, a, :, a] += k * (along + across[:, None, None] * (np.eye(3) - along))
    return hessian


def strain_matrix(discrete: Discrete, frames: Frames) -> np.ndarray:
    """(F, 3, 2, 3, 2) N/m: the Gauss-Newton matrix, which resists a change of strain and not turning.

    The rate of (F^T F)^(1/2) is that of twist and flip in the shares that leave turning out.
    """
    cloth, f, s = discrete.fabric, frames.f, frames.s
    apart = ((s[:, 1] - s[:, 0]) / s.sum(1))[:, None, None]
    sheared = frames.modes[:, 3] + apart * frames.modes[:, 2]
    strains = np.stack([frames.modes[:, 0], frames.modes[:, 1], sheared], axis=1).reshape(-1, 3, 6)
    matrix = cloth.k_shear * (np.swapaxes(strains, 1, 2) @ strains).reshape(-1, 3, 2, 3, 2)
    for a, k in enumerate((cloth.k_warp - cloth.k_shear, cloth.k_weft - cloth.k_shear)):
        d = f[:, :, a] / np.linalg.norm(f[:, :, a], axis=1)[:, None]
        matrix[:, :, a, :, a] += k * d[:, :, None] * d[:, None, :]
    return matrix


def turned(frames: Frames, rates: np.ndarray, dt: float) -> np.ndarray:
    """(F, 3, 2) R F, where each triangle turns to in dt [s] at the rates (F, 3, 2) 1/s of its gradient."""
    s, modes = frames.s, frames.modes
    v1 = stretched_along(frames.f)
    v2 = np.stack([-v1[:, 1], v1[:, 0]], axis=1)
    u1, u2 = (np.einsum("tda,ta->td", modes[:, k], v) for k, v in enumerate((v1, v2)))
    n = np.cross(u1, u2)
    g1, g2 = (np.einsum("tda,ta->td", rates, v) for v in (v1, v2))
    least = np.maximum(s, LEAST_TURNED)
    a, b = (g2 * n).sum(1) / least[:, 1], -(g1 * n).sum(1) / least[:, 0]
    c = (s[:, 0] * (g1 * u2).sum(1) - s[:, 1] * (g2 * u1).sum(1)) / np.maximum((s**2).sum(1), LEAST_TURNED**2)
    way = dt * (a[:, None] * u1 + b[:, None] * u2 + c[:, None] * n)
    return np.einsum("tde,tea->tda", Rotation.from_rotvec(way).as_matrix(), frames.f)


def strain_limit(discrete: Discrete, frames: Frames) -> Density:
    """1/2 k sum_k max(s_k - limit, 0)^2."""
    over = np.maximum(frames.s - discrete.fabric.strain_limit, 0)
    k = discrete.limit_stiffness
    return Density(0.5 * k * (over**2).sum(1), k * (over[:, :, None, None] * frames.modes[:, :2]).sum(1))


def strain_limit_hessian(discrete: Discrete, frames: Frames, clamped: bool) -> np.ndarray:
    """(F, 3, 2, 3, 2) N/m."""
    over = np.maximum(frames.s - discrete.fabric.strain_limit, 0)
    return discrete.limit_stiffness * isotropic_hessian(frames, over, (over > 0).astype(float), clamped)


def corner_gradient(discrete: Discrete, slope: np.ndarray) -> np.ndarray:
    """(N, 3) N from the densities' slopes."""
    corner = np.einsum("tda,tia->tid", discrete.face_area[:, None, None] * slope, discrete.corner_gradients)
    return summed(discrete.faces, corner, discrete.cloth_count)


def summed(ids: np.ndarray, parts: np.ndarray, count: int) -> np.ndarray:
    """(count, 3): parts (P, k, 3) added up over the vertices ids (P, k)."""
    flat, parts = ids.ravel(), parts.reshape(-1, 3)
    return np.stack([np.bincount(flat, parts[:, d], count).astype(float) for d in range(3)], axis=1)


def corner_blocks(discrete: Discrete, hessian: np.ndarray) -> np.ndarray:
    """(F, 3, 3, 3, 3) N/m: [triangle, corner i, axis, corner j, axis]."""
    g = discrete.corner_gradients
    half = np.einsum("tia,tdaeb->tideb", discrete.face_area[:, None, None] * g, hessian)
    return np.einsum("tideb,tjb->tidje", half, g)


def stress_of(hessian: np.ndarray, change: np.ndarray) -> np.ndarray:
    """(F, 3, 2) N/m: the Hessian (F, 3, 2, 3, 2) times a change of F (F, 3, 2)."""
    return (hessian.reshape(-1, 6, 6) @ change.reshape(-1, 6, 1)).reshape(-1, 3, 2)
