"""Contact and friction by moving positions: for XPBD and for Chebyshev-Jacobi projective dynamics.

C = d - xi >= 0, rigid: a stencil nearer than its offset is pushed apart along its normal by what is missing, split by
inverse masses; then the slip since the start of the sub-step is taken back, by at most mu times that push (Coulomb).
After Müller et al. 2007 and Macklin et al. 2014. Nothing is promised: what passes through in one sub-step stays there.
"""

from __future__ import annotations

import numpy as np

from tryon_solver.baselines.newton_ipc.discrete import Discrete
from tryon_solver.baselines.newton_ipc.distance import closest
from tryon_solver.baselines.newton_ipc.elastic import summed
from tryon_solver.baselines.newton_ipc.search import Search


def project_contacts(discrete: Discrete, search: Search, weight: np.ndarray, x: np.ndarray, start: np.ndarray) -> None:
    """Move x (A, 3) m out of contact, all stencils at once: a vertex takes the mean of what they want.

    `weight` (N,) 1/kg inverse masses of the cloth, the body has none; `start` (A, 3) m, where the sub-step began.
    """
    n = discrete.cloth_count
    stencils = search.within_reach(x)
    at = closest(stencils.kinds, x[stencils.ids])
    with_body: np.ndarray = np.asarray((stencils.ids >= n).any(1))
    missing = np.where(with_body, discrete.contact.xi_body, discrete.contact.xi_self) - at.d
    inside: np.ndarray = np.asarray(missing > 0)
    if not inside.any():
        return
    ids, lam, normal, missing = stencils.ids[inside], at.lam[inside], at.normal[inside], missing[inside]
    w = np.append(weight, np.zeros(len(x) - n))[ids]
    share = w * lam / np.maximum((w * lam**2).sum(1), 1e-300)[:, None]
    slip = np.einsum("pi,pid->pd", lam, (x - start)[ids])
    slip -= (slip * normal).sum(1)[:, None] * normal
    length = np.linalg.norm(slip, axis=1)
    mu = np.where(with_body[inside], discrete.mu_body, discrete.mu_self)
    back = np.minimum(1, mu * missing / np.maximum(length, 1e-300))
    moves = share[:, :, None] * (missing[:, None] * normal - back[:, None] * slip)[:, None, :]
    touched = np.bincount(ids.ravel(), (share != 0).ravel(), len(x))
    x += summed(ids, moves, len(x)) / np.maximum(touched, 1)[:, None]
