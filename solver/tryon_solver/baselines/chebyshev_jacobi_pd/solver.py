"""Projective dynamics by Jacobi iterations with Chebyshev weights, and contacts by moving positions.

Source: Wang 2015, "A Chebyshev semi-iterative approach for accelerating projective and position-based dynamics". One
iteration projects every triangle afresh, q' = q_k - D^-1 dE/dx with D the diagonal of H = M/h^2 + K, and

    q_{k+1} = w_{k+1} (gamma (q' - q_k) + q_k - q_{k-1}) + q_{k-1},
    w_1 .. w_S = 1,   w_{S+1} = 2/(2 - rho^2),   w_{k+1} = 4/(4 - rho^2 w_k)

He finds gamma and rho by trying; here they are what is best for the constant matrix (Saad 2003, section 12.3): with a
and b the ends of the spectrum of D^-1 H, gamma = 2/(a + b) and rho = (b - a)/(b + a). A strain limit stands in H, for
its projection is one of the iteration's; that slows the iteration where it is silent, too. Contacts and friction follow
each sub-step's iterations (positional_contact.py), as in his dress.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import eigsh

from tryon_solver.baselines.newton_ipc import elastic
from tryon_solver.baselines.newton_ipc.discrete import Discrete
from tryon_solver.baselines.newton_ipc.march import Motion, Reference
from tryon_solver.baselines.newton_ipc.search import Search
from tryon_solver.baselines.positional_contact import project_contacts
from tryon_solver.body.pose import Pose
from tryon_solver.scene import Scene
from tryon_solver.settings import Settings

DELAY = 10  # iterations before the weights set in: his S
MARGIN = 1.02  # on the upper end of the spectrum, which Lanczos finds from below


class ChebyshevJacobi:
    """A scene solved so. `held` (K,) cloth vertices stand still; `substeps` of every step, `iterations` of each."""

    def __init__(
        self,
        scene: Scene,
        settings: Settings | None = None,
        held: np.ndarray | None = None,
        substeps: int = 8,
        iterations: int = 40,
    ) -> None:
        for name, count in (("substeps", substeps), ("iterations", iterations)):
            if count < 1:
                raise ValueError(f"{name} must be at least 1, not {count}")
        self.scene, self.substeps, self.iterations = scene, substeps, iterations
        self.discrete = Discrete.build(scene, settings or Settings(), held)
        self.search = Search(self.discrete)
        self.data = Reference(scene, settings, held)  # its start and its skin, nothing else
        self.weight = 1 / self.discrete.mass
        self.weight[self.discrete.held] = 0.0
        self.stiffness = stiffness_matrix(self.discrete)
        self._tuned: dict[float, tuple[np.ndarray, float, float]] = {}

    def start(self, pose: Pose | None = None) -> Motion:
        """The scene at rest in its start position."""
        return self.data.start(pose)

    def tuned(self, h: float) -> tuple[np.ndarray, float, float]:
        """(D^-1 (N,) m/N, gamma, rho) for sub-steps of h [s]; held vertices have no D^-1."""
        if h not in self._tuned:
            d = self.discrete
            system = self.stiffness + sp.diags(d.mass / h**2 + d.drag / h * d.contact.area)
            free = np.flatnonzero(self.weight > 0)
            diagonal = system.diagonal()
            scale = sp.diags(1 / np.sqrt(diagonal[free]))
            scaled = sp.csc_matrix(scale @ system[free][:, free] @ scale)
            low = float(eigsh(scaled, k=1, sigma=0.0, which="LM", return_eigenvectors=False)[0])
            high = MARGIN * float(eigsh(scaled, k=1, which="LA", return_eigenvectors=False)[0])
            inverse = np.where(self.weight > 0, 1 / diagonal, 0.0)
            self._tuned[h] = inverse, 2 / (low + high), (high - low) / (high + low)
        return self._tuned[h]

    def step(self, motion: Motion, pose: Pose | None, dt: float) -> Motion:
        """Advance by dt [s] to `pose`."""
        d, h = self.discrete, dt / self.substeps
        n = d.cloth_count
        before, after = motion.x[n:], self.data.skin(pose)
        x, v = motion.x.copy(), motion.v.copy()
        for k in range(1, self.substeps + 1):
            start = x.copy()
            x[:n] = self._solved(start[:n], v, h)
            x[n:] = before + k / self.substeps * (after - before)
            project_contacts(d, self.search, self.weight, x, start)
            v = (x[:n] - start[:n]) / h
        return Motion(x, v, pose)

    def _solved(self, start: np.ndarray, v: np.ndarray, h: float) -> np.ndarray:
        """(N, 3) m after the iterations of one sub-step without contact."""
        d = self.discrete
        inverse, gamma, rho = self.tuned(h)
        x_hat = start + h * v + h * h * d.acceleration
        q = np.where((self.weight > 0)[:, None], x_hat, start)
        previous, w = q, 1.0
        for k in range(1, self.iterations + 1):
            if k == DELAY + 1:
                w = 2 / (2 - rho**2)
            elif k > DELAY:
                w = 4 / (4 - rho**2 * w)
            frames = elastic.Frames.at(d, q)
            stress = elastic.membrane(d, frames).slope + elastic.strain_limit(d, frames).slope
            gradient = elastic.corner_gradient(d, stress) + d.bending @ q + d.attached @ q
            gradient += (d.mass / h**2)[:, None] * (q - x_hat) + (d.drag / h * d.contact.area)[:, None] * (q - start)
            moved = q - gamma * inverse[:, None] * gradient
            q, previous = w * (moved - previous) + previous, q
        return q


def stiffness_matrix(discrete: Discrete) -> sp.csr_matrix:
    """(N, N) N/m: projective dynamics' constant K, membrane with strain limit, bending, and what is sewn on."""
    cloth, g = discrete.fabric, discrete.corner_gradients
    k = np.array([cloth.k_warp, cloth.k_weft]) + discrete.limit_stiffness
    blocks = np.einsum("t,tia,a,tja->tij", discrete.face_area, g, k, g)
    rows, columns = np.repeat(discrete.faces, 3, axis=1).ravel(), np.tile(discrete.faces, (1, 3)).ravel()
    n = discrete.cloth_count
    return sp.csr_matrix((blocks.ravel(), (rows, columns)), shape=(n, n)) + discrete.bending + discrete.attached
