"""Barrier and friction of METHOD.md sections 5 and 6, over all pairs at once, in float64.

Potential of a pair: e kappa b(d - xi). Lagged, as in the solver: the fade e, of nearly parallel edges and by how much
a stencil counts, and for friction the normal force, the normal and the closest points. What is lagged is made afresh in
every Newton iteration.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tryon_solver.baselines.newton_ipc.discrete import Discrete
from tryon_solver.baselines.newton_ipc.distance import (
    EDGE_EDGE,
    Closest,
    closest,
    distance_gradient,
    distance_hessian,
)
from tryon_solver.baselines.newton_ipc.search import Stencils
from tryon_solver.baselines.newton_ipc.shares import shares


def barrier(g: np.ndarray, g_hat: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """b, b', b'' [m^2, m, -] of gaps g < g_hat [m]."""
    reach, log = g - g_hat, np.log(g / g_hat)
    ratio = reach / g
    return -(reach**2) * log, -2 * reach * log - reach * ratio, -2 * log - 4 * ratio + ratio**2


@dataclass(frozen=True)
class Pairs:
    """Stencils within reach of the barrier. `kappa` (P,) N/m with the fade e in it, gaps `g` and `g_hat` (P,) m."""

    kinds: np.ndarray
    ids: np.ndarray
    at: Closest
    kappa: np.ndarray
    g: np.ndarray
    g_hat: np.ndarray
    mu: np.ndarray
    corners: np.ndarray  # (P, 4, 3) m

    @property
    def energy(self) -> float:
        """J."""
        return float((self.kappa * barrier(self.g, self.g_hat)[0]).sum())

    @property
    def force(self) -> np.ndarray:
        """(P,) N, normal forces: -kappa b'."""
        return -self.kappa * barrier(self.g, self.g_hat)[1]

    def gradient(self) -> np.ndarray:
        """(P, 12) N."""
        return -self.force[:, None] * distance_gradient(self.at)

    def hessian(self, clamped: bool) -> np.ndarray:
        """(P, 12, 12) N/m; `clamped` to its positive semidefinite part pair by pair."""
        slope = distance_gradient(self.at)
        stiff = self.kappa * barrier(self.g, self.g_hat)[2]
        hessian = stiff[:, None, None] * slope[:, :, None] * slope[:, None, :]
        hessian -= self.force[:, None, None] * distance_hessian(self.at, self.corners)
        return positive_part(hessian) if clamped else hessian


def positive_part(hessians: np.ndarray) -> np.ndarray:
    """(P, n, n) with negative eigenvalues set to zero."""
    values, vectors = np.linalg.eigh(hessians)
    return np.einsum("pik,pk,pjk->pij", vectors, np.maximum(values, 0), vectors)


def fades(discrete: Discrete, stencils: Stencils, x: np.ndarray) -> np.ndarray:
    """(S,) e = (2 - c/eps) c/eps below eps, else 1, with c = |e_a x e_b|^2, 1 for a point and a triangle, times how
    much a stencil counts whose closest points lie on an edge or a corner."""
    corner = x[stencils.ids]
    c = (np.cross(corner[:, 1] - corner[:, 0], corner[:, 3] - corner[:, 2]) ** 2).sum(1)
    with_body = (stencils.ids >= discrete.cloth_count).any(1)
    eps = np.where(with_body, discrete.contact.eps_body, discrete.contact.eps_self)
    ratio = np.minimum(c / eps, 1.0)
    fade = np.where(stencils.kinds == EDGE_EDGE, (2 - ratio) * ratio, 1.0)
    return fade * shares(discrete.neighbours, stencils.kinds, stencils.ids, closest(stencils.kinds, corner), x)


def pairs_at(discrete: Discrete, stencils: Stencils, fade: np.ndarray, x: np.ndarray) -> Pairs:
    """The pairs among the stencils at x (A, 3) m; raises ValueError when one is at or under its offset."""
    n, sizes = discrete.cloth_count, discrete.contact
    ids = stencils.ids
    cloth = ids < n
    with_body = ~cloth.all(1)
    xi = np.where(with_body, sizes.xi_body, sizes.xi_self)
    padded_reach = np.append(sizes.reach, np.inf)
    nearest = padded_reach[np.where(cloth, ids, n)].min(1)
    g_hat = np.where(with_body, sizes.d_hat, np.minimum(sizes.d_hat, 0.5 * nearest - xi))
    at = closest(stencils.kinds, x[ids])
    g = at.d - xi
    if (g <= 0).any():
        raise ValueError(f"a pair is {1e6 * -g.min():.3f} micrometres under its offset")
    near = (g < g_hat) & (fade > 0.0)
    area = (np.append(sizes.area, 0.0)[np.where(cloth, ids, n)]).sum(1) / np.maximum(cloth.sum(1), 1)
    kappa = fade * sizes.pressure_stiffness * area / 3.0
    mu = np.where(with_body, discrete.mu_body, discrete.mu_self)
    kept = Closest(at.d[near], at.lam[near], at.normal[near], at.rates[near])
    return Pairs(
        stencils.kinds[near], ids[near], kept, kappa[near], g[near], g_hat[near], mu[near], x[ids[near]]
    )


@dataclass(frozen=True)
class Presliding:
    """How far contacts have given when a step begins: `kinds` (P,), vertices `ids` (P, 4), `given` (P, 3) m."""

    kinds: np.ndarray
    ids: np.ndarray
    given: np.ndarray

    @staticmethod
    def none() -> Presliding:
        """Of no contact."""
        return Presliding(np.zeros(0, np.int64), np.zeros((0, 4), np.int64), np.zeros((0, 3)))

    def of(self, kinds: np.ndarray, ids: np.ndarray) -> np.ndarray:
        """(Q, 3) m of these contacts, (Q,) and (Q, 4); zero of those that are new."""
        names, asked = np.column_stack([self.kinds, self.ids]), np.column_stack([kinds, ids])
        known = {tuple(name): given for name, given in zip(names.tolist(), self.given)}
        return np.array([known.get(tuple(name), np.zeros(3)) for name in asked.tolist()]).reshape(-1, 3)


@dataclass(frozen=True)
class Friction:
    """Lagged friction: `kinds` (P,), `ids` (P, 4), weights `lam` (P, 4), tangential projectors `across` (P, 3, 3),
    Coulomb forces `limit` (P,) N, how far each had `given` (P, 3) m when the step began, and `presliding` s m."""

    kinds: np.ndarray
    ids: np.ndarray
    lam: np.ndarray
    across: np.ndarray
    limit: np.ndarray
    given: np.ndarray
    presliding: float

    @staticmethod
    def at(pairs: Pairs, presliding: float, known: Presliding) -> Friction:
        """Made of the pairs' normal forces."""
        n = pairs.at.normal
        across = np.eye(3) - n[:, :, None] * n[:, None, :]
        given = known.of(pairs.kinds, pairs.ids)
        limit = pairs.mu * pairs.force
        return Friction(pairs.kinds, pairs.ids, pairs.at.lam, across, limit, given, presliding)

    def slip(self, moved: np.ndarray) -> np.ndarray:
        """(P, 3) m for displacements (A, 3) m since the start of the step."""
        return np.einsum("pde,pe->pd", self.across, self.given + np.einsum("pi,pie->pe", self.lam, moved[self.ids]))

    def kept(self, moved: np.ndarray) -> Presliding:
        """How far the contacts have given after the step; what slides, as far as it resists."""
        u = self.slip(moved)
        y = np.linalg.norm(u, axis=1, keepdims=True)
        return Presliding(self.kinds, self.ids, u * np.minimum(1.0, self.presliding / np.maximum(y, 1e-300)))

    def energy(self, moved: np.ndarray) -> float:
        """sum mu N f0(|u|) [J], f0' = f1."""
        s = self.presliding
        y = np.linalg.norm(self.slip(moved), axis=1)
        inside = np.minimum(y, s)
        f0 = inside**2 * (1 - inside / (3 * s)) / s + s / 3 + (y - inside)
        return float((self.limit * f0).sum())

    def gradient(self, moved: np.ndarray) -> np.ndarray:
        """(P, 12) N."""
        u = self.slip(moved)
        y = np.linalg.norm(u, axis=1)
        force = (self.limit * self._secant(y))[:, None] * u
        return np.einsum("pi,pd->pid", self.lam, force).reshape(-1, 12)

    def hessian(self, moved: np.ndarray) -> np.ndarray:
        """(P, 12, 12) N/m: mu N (f1/y (T - t t^T) + f1' t t^T), positive semidefinite as it is."""
        u = self.slip(moved)
        y = np.linalg.norm(u, axis=1)
        t = u / np.maximum(y, 1e-300)[:, None]
        tt = t[:, :, None] * t[:, None, :]
        secant = self._secant(y)
        rise = np.where(y < self.presliding, 2 * (1 - y / self.presliding) / self.presliding, 0.0)
        matrix = secant[:, None, None] * (self.across - tt) + rise[:, None, None] * tt
        matrix *= self.limit[:, None, None]
        return np.einsum("pi,pj,pde->pidje", self.lam, self.lam, matrix).reshape(-1, 12, 12)

    def _secant(self, y: np.ndarray) -> np.ndarray:
        """f1(y)/y [1/m]."""
        s = self.presliding
        return np.where(y < s, (2 - y / s) / s, 1 / np.maximum(y, s))
