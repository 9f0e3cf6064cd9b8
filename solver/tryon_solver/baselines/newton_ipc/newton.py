"""Newton on a step's balance of forces: sparse direct solves, moves bounded by collision detection, down to 1e-8 m.

First Newton on the potential with its lagged parts frozen, which are made afresh in every iteration, with a line
search on its energy (Li et al. 2020, algorithm 1): by the exact Hessian where that is positive definite, else by a
mixture with the Hessian clamped term by term. That comes near, or goes round in circles of a millimetre: it knows
nothing of how the lagged parts follow x. Then Newton on the residual itself: its derivative is a central difference
along each direction that GMRES asks for, the direct solve is the preconditioner, and a step counts when it lowers the
preconditioned residual (Deuflhard's natural monotonicity test).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import LinearOperator, SuperLU, gmres, splu

from tryon_solver.baselines.newton_ipc.contact import Presliding
from tryon_solver.baselines.newton_ipc.potential import Lagged, StepProblem
from tryon_solver.baselines.newton_ipc.search import Search

MOST_ITERATIONS = 200
MOST_HALVINGS = 30
TRIED_HALVINGS = 6  # of a Newton-Krylov step, before the projected one is taken
NEAR = 3e-4  # m: moves below it are those of a Newton on the residual
MOST_IN_VAIN = 30  # steps of a Newton on the residual that are found not to lower it, once iterations go in circles
PATIENCE = 15  # iterations without a much smaller move, after which the lagged potential is no guide
CLAMPED_SHARES = (0.0, 0.2, 0.4, 0.6, 0.8, 0.9, 1.0)  # of the clamped Hessian in the mixture, tried in turn
PROBE = 3e-8  # m: largest displacement of the differences
ROUNDING = 1e-13  # of the energy: a change below it is none


@dataclass(frozen=True)
class Solved:
    """`x` (A, 3) m, where the last Newton step was `last_move` m at its largest, after `iterations`.

    `convex`: the potential with its lagged parts frozen has a minimum there, not just a point of balance. `known`: how
    far contacts have given there.
    """

    x: np.ndarray
    iterations: int
    last_move: float
    convex: bool
    known: Presliding


class NotConvergedError(RuntimeError):
    """Newton ran out of iterations, or went on in circles; the message says how far it was, `nearest` where."""

    def __init__(self, message: str, nearest: Solved) -> None:
        super().__init__(message)
        self.nearest = nearest


def solve(problem: StepProblem, search: Search, x: np.ndarray, tolerance: float) -> Solved:
    """From a free x (A, 3) m to where a whole Newton step moves nothing by more than `tolerance` m. Raises
    NotConvergedError."""
    moves: list[float] = []
    least, improved, in_vain = np.inf, 0, 0
    lagged = Lagged(problem, search, x)
    for iteration in range(1, MOST_ITERATIONS + 1):
        factor, convex = factorised(lagged)
        direction = solved(factor, -lagged.residual())
        moves.append(largest(direction))
        if moves[-1] < 0.7 * least:
            least, improved = moves[-1], iteration
        there = None
        circling = iteration - improved > PATIENCE
        if circling or (moves[-1] < NEAR and convex):
            full = newton_direction(lagged, factor)
            moves[-1] = max(moves[-1], largest(full))
            there = towards_balance(lagged, factor, full, largest_norm(direction))
            in_vain += circling and there is None
        here = left_at(lagged, iteration, moves[-1], convex)
        if moves[-1] <= tolerance:
            return here
        if in_vain == MOST_IN_VAIN:
            break
        lagged = descend(lagged, direction, here) if there is None else there
    said = f"the last Newton step is still {moves[-1]:.1e} m; the ones before it {moves[-6:-1]}"
    raise NotConvergedError(said, here)


def left_at(lagged: Lagged, iterations: int = 0, last_move: float = np.inf, convex: bool = False) -> Solved:
    """What is known where the iterations end."""
    known = lagged.friction.kept(lagged.x - lagged.problem.x_start)
    return Solved(lagged.x, iterations, last_move, convex, known)


def largest(vectors: np.ndarray) -> float:
    """Largest length among vectors (A, 3) m."""
    return float(np.sqrt((vectors**2).sum(1).max()))


def largest_norm(vectors: np.ndarray) -> float:
    """Root of the sum of squares of (A, 3) m."""
    return float(np.sqrt((vectors**2).sum()))


def factorised(lagged: Lagged) -> tuple[SuperLU, bool]:
    """The factor of the exact Hessian if it is positive definite, which is said, else of its first mixture with the
    clamped one that is."""
    exact, clamped = lagged.hessian(clamped=False), None
    for share in CLAMPED_SHARES:
        if share > 0 and clamped is None:
            clamped = lagged.hessian(clamped=True)
        factor = definite_factor(exact if clamped is None else (1 - share) * exact + share * clamped)
        if factor is not None:
            return factor, share == 0
    raise NotConvergedError("the clamped Hessian is not positive definite", left_at(lagged))


def definite_factor(matrix: sp.csc_matrix) -> SuperLU | None:
    """Its factor, None unless positive definite: the pivots on the diagonal have the signs of the eigenvalues."""
    symmetric = {"SymmetricMode": True}
    factor = splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=symmetric)
    definite = (factor.U.diagonal() > 0).all() and (factor.perm_r == factor.perm_c).all()
    return factor if definite else None


def solved(factor: SuperLU, force: np.ndarray) -> np.ndarray:
    """(A, 3) m for forces (A, 3) N."""
    return factor.solve(force.ravel()).reshape(-1, 3)


def newton_direction(lagged: Lagged, factor: SuperLU) -> np.ndarray:
    """(A, 3) m: J d = -F with J the derivative of the residual F, everything that is lagged included."""
    size = lagged.x.size

    def product(p: np.ndarray) -> np.ndarray:
        step = PROBE / max(largest(p.reshape(-1, 3)), 1e-300) * p.reshape(-1, 3)
        ahead, behind = lagged.probed(step).residual(), lagged.probed(-step).residual()
        return (ahead - behind).ravel() * (0.5 * largest(p.reshape(-1, 3)) / PROBE)

    derivative = LinearOperator((size, size), matvec=product)
    inverse = LinearOperator((size, size), matvec=factor.solve)
    direction, _ = gmres(derivative, -lagged.residual().ravel(), M=inverse, rtol=1e-2, restart=40, maxiter=2)
    return direction.reshape(-1, 3)


def towards_balance(lagged: Lagged, factor: SuperLU, direction: np.ndarray, norm: float) -> Lagged | None:
    """Along the direction as far as the preconditioned residual falls from `norm` m; None if it doesn't."""
    share = lagged.search.free_share(lagged.x, direction)
    for _ in range(TRIED_HALVINGS):
        there = lagged.moved(share * direction)
        if largest_norm(solved(factor, there.residual())) <= (1 - 0.25 * share) * norm:
            return there
        share *= 0.5
    return None


def descend(lagged: Lagged, direction: np.ndarray, here: Solved) -> Lagged:
    """Along the direction as far as that is free and lowers the lagged energy. Raises NotConvergedError."""
    share = lagged.search.free_share(lagged.x, direction)
    energy = lagged.energy(lagged.x)
    for _ in range(MOST_HALVINGS):
        if lagged.energy(lagged.x + share * direction) <= energy + ROUNDING * abs(energy):
            return lagged.moved(share * direction)
        share *= 0.5
    raise NotConvergedError("no step along a Newton direction lowers the energy", here)
