"""The incremental potential of a step, its residual and its Hessian, over cloth and collision surface.

The residual is the solver's balance of forces, with everything at x. It is no gradient: the fade of parallel edges and
the normal force within friction depend on x, too. `Lagged` freezes these at one point; there its gradient is the
residual, and its energy is what a line search may descend. The fabric's damping has a matrix of the step's start.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from tryon_solver.baselines.newton_ipc import elastic
from tryon_solver.baselines.newton_ipc.contact import Friction, Presliding, fades, pairs_at
from tryon_solver.baselines.newton_ipc.discrete import Discrete
from tryon_solver.baselines.newton_ipc.search import Search, Stencils


@dataclass(frozen=True)
class StepProblem:
    """One step: `dt` s; `x_start` (A, 3) m, committed positions; `x_hat` (N, 3) m, inertial prediction; `skin` (B, 3) m
    and `hold` (B,) N, where the collision surface is drawn to and how firmly at most; `known` how far contacts have
    given; `v` (N, 3) m/s, where it starts."""

    discrete: Discrete
    dt: float
    x_start: np.ndarray
    x_hat: np.ndarray
    skin: np.ndarray
    hold: np.ndarray
    known: Presliding
    v: np.ndarray

    @property
    def inertia(self) -> np.ndarray:
        """(N,) N/m."""
        return self.discrete.mass / self.dt**2

    @property
    def drag(self) -> np.ndarray:
        """(N,) N/m."""
        return self.discrete.drag / self.dt * self.discrete.contact.area

    @property
    def damping(self) -> float:
        """Share of the elastic matrix that damps."""
        return self.discrete.damping_time / self.dt

    @cached_property
    def damping_matrix(self) -> np.ndarray:
        """(F, 3, 2, 3, 2) N/m: the membrane's share of the damping, of where triangles turn to."""
        return self.damping * elastic.strain_matrix(self.discrete, elastic.Frames.of(self.turned))

    @cached_property
    def turned(self) -> np.ndarray:
        """(F, 3, 2) the deformation gradients that damping counts from."""
        frames = elastic.Frames.at(self.discrete, self.x_start[: self.discrete.cloth_count])
        return elastic.turned(frames, elastic.gradients_of(self.discrete, self.v), self.dt)


class Lagged:
    """The potential with all that is lagged frozen at x (A, 3) m, its gradient and Hessian there."""

    def __init__(
        self, problem: StepProblem, search: Search, x: np.ndarray, stencils: Stencils | None = None
    ) -> None:
        self.problem, self.search, self.x = problem, search, x
        discrete = problem.discrete
        self.stencils = search.within_reach(x) if stencils is None else stencils
        self.pairs = pairs_at(discrete, self.stencils, fades(discrete, self.stencils, x), x)
        self.friction = Friction.at(self.pairs, discrete.presliding, problem.known)
        self.frames = elastic.Frames.at(discrete, x[: discrete.cloth_count])

    def moved(self, displacement: np.ndarray) -> Lagged:
        """The same, made afresh at x + displacement (A, 3) m."""
        return Lagged(self.problem, self.search, self.x + displacement)

    def probed(self, displacement: np.ndarray) -> Lagged:
        """The same for a displacement so small that no other stencil comes within reach."""
        return Lagged(self.problem, self.search, self.x + displacement, self.stencils)

    def residual(self) -> np.ndarray:
        """(A, 3) N: all forces, with the opposite sign, at x."""
        problem, discrete, x = self.problem, self.problem.discrete, self.x
        n = discrete.cloth_count
        cloth, moved = x[:n], x - problem.x_start
        stress = elastic.membrane(discrete, self.frames).slope + elastic.strain_limit(discrete, self.frames).slope
        stress += elastic.stress_of(problem.damping_matrix, self.frames.f - problem.turned)
        contact = self.pairs.gradient() + self.friction.gradient(moved)
        out = elastic.summed(self.pairs.ids, contact, len(x))
        out[:n] += problem.inertia[:, None] * (cloth - problem.x_hat) + problem.drag[:, None] * moved[:n]
        out[:n] += elastic.corner_gradient(discrete, stress)
        out[:n] += discrete.bending @ (cloth + problem.damping * moved[:n]) + discrete.attached @ cloth
        out[n:] += self._surface_secant()[:, None] * (x[n:] - problem.skin)
        out[discrete.held] = 0.0
        return out

    def _surface_secant(self) -> np.ndarray:
        """(B,) N/m."""
        k = self.problem.discrete.skin_stiffness
        r_sq = ((self.x[self.problem.discrete.cloth_count :] - self.problem.skin) ** 2).sum(1)
        return k / np.sqrt(1 + r_sq * (k / self.problem.hold) ** 2)

    def energy(self, x: np.ndarray) -> float:
        """J at x (A, 3) m, with what is frozen; raises ValueError where x is not free."""
        problem, discrete = self.problem, self.problem.discrete
        n = discrete.cloth_count
        cloth, moved = x[:n], x - problem.x_start
        frames = elastic.Frames.at(discrete, cloth)
        per_area = elastic.membrane(discrete, frames).value + elastic.strain_limit(discrete, frames).value
        total = float((discrete.face_area * per_area).sum())
        total += 0.5 * float((problem.inertia[:, None] * (cloth - problem.x_hat) ** 2).sum())
        total += 0.5 * float((problem.drag[:, None] * moved[:n] ** 2).sum())
        bent = (discrete.bending + discrete.attached) @ cloth
        total += 0.5 * float((cloth * bent).sum())
        total += 0.5 * problem.damping * float((moved[:n] * (discrete.bending @ moved[:n])).sum())
        change = frames.f - problem.turned
        damped = elastic.stress_of(problem.damping_matrix, change)
        total += 0.5 * float((discrete.face_area[:, None, None] * change * damped).sum())
        k, hold = discrete.skin_stiffness, problem.hold
        give = hold / k
        r_sq = ((x[n:] - problem.skin) ** 2).sum(1)
        total += float((k * give**2 * (np.sqrt(1 + r_sq / give**2) - 1)).sum())
        stencils = self.search.within_reach(x)
        total += pairs_at(discrete, stencils, fades(discrete, stencils, self.x), x).energy
        return total + self.friction.energy(moved)

    def hessian(self, clamped: bool) -> sp.csc_matrix:
        """(3A, 3A) N/m, exact or with each term `clamped` to its positive semidefinite part; held vertices have rows
        and columns of the identity."""
        problem, discrete = self.problem, self.problem.discrete
        n, count = discrete.cloth_count, len(self.x)
        hessian = elastic.membrane_hessian(discrete, self.frames, clamped) + problem.damping_matrix
        hessian += elastic.strain_limit_hessian(discrete, self.frames, clamped)
        blocks = elastic.corner_blocks(discrete, hessian)
        parts = [scatter(discrete.faces, blocks.reshape(-1, 9, 9), count)]
        parts.append(scatter(self.pairs.ids, self.pairs.hessian(clamped), count))
        parts.append(scatter(self.pairs.ids, self.friction.hessian(self.x - problem.x_start), count))
        constant = (1 + problem.damping) * discrete.bending + discrete.attached
        constant = sp.block_diag([constant, sp.csr_matrix((count - n, count - n))]) if count > n else constant
        diagonal = np.concatenate([problem.inertia + problem.drag, self._surface_secant()])
        parts.append(sp.kron(constant + sp.diags(diagonal), sp.eye(3)))
        total = sp.csc_matrix(sum(parts))
        if not len(discrete.held):
            return total
        free = np.ones(count)
        free[discrete.held] = 0.0
        keep = sp.diags(np.repeat(free, 3))
        return sp.csc_matrix(keep @ total @ keep + sp.diags(np.repeat(1 - free, 3)))


def scatter(ids: np.ndarray, blocks: np.ndarray, count: int) -> sp.csr_matrix:
    """(3 count, 3 count) sum of blocks (P, 3k, 3k) over vertices ids (P, k)."""
    places = (3 * ids[:, :, None] + np.arange(3)).reshape(len(ids), 3 * ids.shape[1])
    width = places.shape[1]
    rows, columns = np.repeat(places, width, axis=1).ravel(), np.tile(places, (1, width)).ravel()
    return sp.csr_matrix((blocks.ravel(), (rows, columns)), shape=(3 * count, 3 * count))

