"""Membrane and strain limit by singular values: energies, gradients and Hessians of all triangles at once.

METHOD.md section 3 has the formulas. The Hessian of an isotropic energy psi(s1) + psi(s2) over F (3 x 2) is diagonal in
six modes made of F = U S V^T (after Smith, De Goes and Kim 2019); clamped modes make it positive semidefinite.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tryon_solver.baselines.newton_ipc.discrete import Discrete

SMALLEST_STRETCH = 1e-4  # below this a triangle is a line, and the modes' quotients are taken at this stretch


@dataclass(frozen=True)
class Frames:
    """`f` (F, 3, 2), its singular values `s` (F, 2) and the six modes (F, 6, 3, 2) of isotropic Hessians."""

    f: np.ndarray
    s: np.ndarray
    modes: np.ndarray

    @property
    def root(self) -> np.ndarray:
        """(F, 2, 2) U = (F^T F)^(1/2) = (C + s I)/t, t^2 = tr C + 2 s."""
        c = np.einsum("tda,tdb->tab", self.f, self.f)
        det = self.s.prod(1)
        return (c + det[:, None, None] * np.eye(2)) / np.sqrt((self.s**2).sum(1) + 2 * det)[:, None, None]

    @staticmethod
    def at(discrete: Discrete, x: np.ndarray) -> Frames:
        """At cloth positions x (N, 3) m."""
        f = np.einsum("tid,tia->tda", x[discrete.faces], discrete.corner_gradients)
        c = np.einsum("tda,tdb->tab", f, f)
        angle = 0.5 * np.arctan2(2 * c[:, 0, 1], c[:, 0, 0] - c[:, 1, 1])
        cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
        stretched = cos * f[:, :, 0] + sin * f[:, :, 1], cos * f[:, :, 1] - sin * f[:, :, 0]
        s = np.stack([np.linalg.norm(column, axis=1) for column in stretched], axis=1)
        u1, u2 = (column / np.maximum(s[:, k, None], 1e-300) for k, column in enumerate(stretched))
        n = np.cross(u1, u2)
        v1, v2 = np.hstack([cos, sin]), np.hstack([-sin, cos])
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


def strain_rate(discrete: Discrete, frames: Frames, before: Frames) -> Density:
    """1/2 (k_s |U - U0|^2 + (k_u - k_s)(|f_u| - |f0_u|)^2 + (k_v - k_s)(|f_v| - |f0_v|)^2), U = (F^T F)^(1/2)."""
    cloth, f = discrete.fabric, frames.f
    root = frames.root
    value = 0.5 * cloth.k_shear * ((root - before.root) ** 2).sum((1, 2))
    slope = cloth.k_shear * (f - RootShare.at(f, before.root).slope)
    for a, k in enumerate((cloth.k_warp - cloth.k_shear, cloth.k_weft - cloth.k_shear)):
        length, own = np.linalg.norm(f[:, :, a], axis=1), np.linalg.norm(before.f[:, :, a], axis=1)
        value = value + 0.5 * k * (length - own) ** 2
        slope[:, :, a] += k * (1 - own / length)[:, None] * f[:, :, a]
    return Density(value, slope)


def strain_rate_hessian(discrete: Discrete, frames: Frames, before: Frames, clamped: bool) -> np.ndarray:
    """(F, 3, 2, 3, 2) N/m; `clamped` to its positive semidefinite part, term by term."""
    cloth, f = discrete.fabric, frames.f
    hessian = cloth.k_shear * (np.eye(6) - RootShare.at(f, before.root).hessian)
    if clamped:
        weights, modes = np.linalg.eigh(hessian)
        hessian = (modes * np.maximum(weights, 0.0)[:, None]) @ np.swapaxes(modes, 1, 2)
    hessian = hessian.reshape(-1, 3, 2, 3, 2)
    for a, k in enumerate((cloth.k_warp - cloth.k_shear, cloth.k_weft - cloth.k_shear)):
        length, own = np.linalg.norm(f[:, :, a], axis=1), np.linalg.norm(before.f[:, :, a], axis=1)
        d = f[:, :, a] / length[:, None]
        across = 1 - own / length
        if clamped:
            across = np.maximum(across, 0.0)
        along = d[:, :, None] * d[:, None, :]
        hessian[:, :, a, :, a] += k * (along + across[:, None, None] * (np.eye(3) - along))
    return hessian


@dataclass(frozen=True)
class RootShare:
    """tr(U U0) = (C : U0 + s tr U0)/t of F, where U = (C + s I)/t is the root of C = F^T F, s = sqrt(det C) and t^2 =
    tr C + 2 s: slope (F, 3, 2) and Hessian (F, 6, 6) over F, by the chain rule. It is what |U - U0|^2/2 has beside
    |F|^2/2 and a constant."""

    slope: np.ndarray
    hessian: np.ndarray

    @staticmethod
    def at(f: np.ndarray, root0: np.ndarray) -> RootShare:
        """At F (F, 3, 2), for U0 (F, 2, 2)."""
        u, v = f[:, :, 0], f[:, :, 1]
        a, b, c = (u * u).sum(1)[:, None], (u * v).sum(1)[:, None], (v * v).sum(1)[:, None]
        s = np.sqrt(np.maximum(a * c - b * b, 1e-24))
        det_slope = 2 * np.stack([c * u - b * v, a * v - b * u], axis=2)
        d_s = det_slope / (2 * s[:, :, None])
        eye = np.eye(3)
        det_hessian = np.empty((len(f), 3, 2, 3, 2))
        det_hessian[:, :, 0, :, 0] = 2 * (c[:, :, None] * eye - v[:, :, None] * v[:, None])
        det_hessian[:, :, 1, :, 1] = 2 * (a[:, :, None] * eye - u[:, :, None] * u[:, None])
        mixed = 4 * u[:, :, None] * v[:, None] - 2 * v[:, :, None] * u[:, None] - 2 * b[:, :, None] * eye
        det_hessian[:, :, 0, :, 1] = mixed
        det_hessian[:, :, 1, :, 0] = np.swapaxes(mixed, 1, 2)

        def outer(p: np.ndarray, q: np.ndarray) -> np.ndarray:
            return p.reshape(-1, 6, 1) * q.reshape(-1, 1, 6)

        s, sixes = s[:, :, None], det_hessian.reshape(-1, 6, 6)
        dd_s = (sixes / 2 - outer(d_s, d_s)) / s
        t = np.sqrt(a + c + 2 * s[:, :, 0])[:, :, None]
        d_t = (f + d_s) / t
        dd_t = (np.eye(6) + dd_s - outer(d_t, d_t)) / t
        trace = (root0[:, 0, 0] + root0[:, 1, 1])[:, None, None]
        top = (np.einsum("tda,tdb->tab", f, f) * root0).sum((1, 2))[:, None, None] + s * trace
        d_top = 2 * f @ root0 + trace * d_s
        both = np.einsum("de,tab->tdaeb", eye, root0).reshape(-1, 6, 6)
        dd_top = 2 * both + trace * dd_s
        slope = d_top / t - top * d_t / t**2
        turned = outer(d_top, d_t)
        hessian = dd_top / t - (turned + np.swapaxes(turned, 1, 2)) / t**2
        return RootShare(slope, hessian - top * dd_t / t**2 + 2 * top * outer(d_t, d_t) / t**3)


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
