"""XPBD with small steps: the solver's materials as compliant constraints, contacts as rigid ones with friction.

Source: Macklin, Müller, Chentanez 2016 (XPBD), and Macklin et al. 2019 (small steps: one iteration of many sub-steps
is better than many iterations of one). An energy k C^2/2 is a constraint C of compliance 1/k; one projection moves
vertex i by w_i grad_i C dl, dl = -C/(sum w |grad C|^2 + 1/(k h^2)). Constraints go one after the other (Gauss-Seidel),
by colours.

    warp, weft: C = |f_u| - 1, k = A (k_u - k_s)       strain limit: C = max(s1 - limit, 0), k = A k_limit
    shear: C = |F - R|, k = A k_s                      bending: C = |sum_i K_i x_i|, k = k_b/(A0 + A1)
    contact: rigid, with friction (positional_contact.py)

These are the energies of METHOD.md section 3. The surface moves with the skin and does not yield; fabric damping is not
there, and neither is a guarantee: what passes through in one sub-step stays there.
"""

from __future__ import annotations

import numpy as np

from tryon_solver.baselines.hinge_rows import hinge_rows
from tryon_solver.baselines.newton_ipc.discrete import Discrete
from tryon_solver.baselines.newton_ipc.march import Motion, Reference
from tryon_solver.baselines.newton_ipc.search import Search
from tryon_solver.baselines.positional_contact import project_contacts
from tryon_solver.baselines.xpbd.colours import colours
from tryon_solver.body.pose import Pose
from tryon_solver.scene import Scene
from tryon_solver.settings import Settings


class Xpbd:
    """A scene solved by XPBD. `held` (K,) cloth vertices stand still; `substeps` of every step."""

    def __init__(
        self, scene: Scene, settings: Settings | None = None, held: np.ndarray | None = None, substeps: int = 20
    ) -> None:
        if substeps < 1:
            raise ValueError(f"substeps must be at least 1, not {substeps}")
        self.scene, self.substeps = scene, substeps
        self.discrete = Discrete.build(scene, settings or Settings(), held)
        self.search = Search(self.discrete)
        self.data = Reference(scene, settings, held)  # its start and its skin, nothing else
        d = self.discrete
        self.weight = 1 / d.mass
        self.weight[d.held] = 0.0
        self.triangles = colours(d.faces, d.cloth_count)
        self.hinge_ids, self.hinge_rows, area = hinge_rows(scene.garment)
        self.hinge_stiffness = d.fabric.k_bend / area
        self.hinges = colours(self.hinge_ids, d.cloth_count) if d.fabric.k_bend else []

    def start(self, pose: Pose | None = None) -> Motion:
        """The scene at rest in its start position."""
        return self.data.start(pose)

    def step(self, motion: Motion, pose: Pose | None, dt: float) -> Motion:
        """Advance by dt [s] to `pose`."""
        d, h = self.discrete, dt / self.substeps
        n = d.cloth_count
        before, after = motion.x[n:], self.data.skin(pose)
        x, v = motion.x.copy(), motion.v.copy()
        free = (self.weight > 0)[:, None]
        for k in range(1, self.substeps + 1):
            start = x.copy()
            v = (v + h * d.acceleration) / (1 + h * d.drag * d.contact.area / d.mass)[:, None]
            x[:n] += h * v * free
            x[n:] = before + k / self.substeps * (after - before)
            for group in self.triangles:
                self._project_triangles(x, group, h)
            for group in self.hinges:
                self._project_hinges(x, group, h)
            project_contacts(d, self.search, self.weight, x, start)
            v = (x[:n] - start[:n]) / h
        return Motion(x, v, pose)

    def _move(self, x: np.ndarray, ids: np.ndarray, slope: np.ndarray, c: np.ndarray, stiffness: np.ndarray) -> None:
        """Project constraints of value c (P,) and slope (P, k, 3), which share no vertex; stiffness times h^2 (P,)."""
        w = self.weight[ids]
        length = (w * (slope**2).sum(2)).sum(1) + 1 / stiffness
        x[ids] -= (w * (c / length)[:, None])[:, :, None] * slope

    def _project_triangles(self, x: np.ndarray, group: np.ndarray, h: float) -> None:
        d, cloth = self.discrete, self.discrete.fabric
        ids, g, area = d.faces[group], d.corner_gradients[group], d.face_area[group]
        for axis, k in enumerate((cloth.k_warp - cloth.k_shear, cloth.k_weft - cloth.k_shear)):
            if k > 0:
                f = np.einsum("tid,ti->td", x[ids], g[:, :, axis])
                length = np.linalg.norm(f, axis=1)
                slope = g[:, :, axis, None] * (f / length[:, None])[:, None, :]
                self._move(x, ids, slope, length - 1, h * h * k * area)
        if cloth.k_shear > 0:
            u, s, vt = _svd(x, ids, g)
            c = np.sqrt(((s - 1) ** 2).sum(1))
            p = np.einsum("tdk,tk,tka->tda", u, (s - 1) / np.maximum(c, 1e-12)[:, None], vt)
            self._move(x, ids, np.einsum("tda,tia->tid", p, g), c, h * h * cloth.k_shear * area)
        if d.limit_stiffness > 0:
            u, s, vt = _svd(x, ids, g)
            c = np.maximum(s[:, 0] - cloth.strain_limit, 0)
            over = c > 0
            p = np.einsum("td,ta->tda", u[over, :, 0], vt[over, 0])
            slope = np.einsum("tda,tia->tid", p, g[over])
            self._move(x, ids[over], slope, c[over], h * h * d.limit_stiffness * area[over])

    def _project_hinges(self, x: np.ndarray, group: np.ndarray, h: float) -> None:
        ids, rows = self.hinge_ids[group], self.hinge_rows[group]
        bent = np.einsum("hid,hi->hd", x[ids], rows)
        c = np.linalg.norm(bent, axis=1)
        slope = rows[:, :, None] * (bent / np.maximum(c, 1e-12)[:, None])[:, None, :]
        self._move(x, ids, slope, c, h * h * self.hinge_stiffness[group])


def _svd(x: np.ndarray, ids: np.ndarray, g: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of the deformation gradients (T, 3, 2): the larger stretch first."""
    return np.linalg.svd(np.einsum("tid,tia->tda", x[ids], g), full_matrices=False)
