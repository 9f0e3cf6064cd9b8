"""XPBD with small steps: the solver's materials as compliant constraints, contacts as rigid ones with friction.

Source: Macklin, Müller, Chentanez 2016 (XPBD), and Macklin et al. 2019 (small steps: one iteration of many sub-steps
is better than many iterations of one). An energy k C^2/2 is a constraint C of compliance 1/k; one projection moves
vertex i by w_i grad_i C dl, dl = -(C + l/(k h^2))/(sum w |grad C|^2 + 1/(k h^2)), l the sum of the sub-step's dl so
far. Constraints go one after the other (Gauss-Seidel), by colours.

    warp, weft: C = |f_u| - 1, k = A (k_u - k_s)       strain limit: C = max(s1 - limit, 0), k = A k_limit
    shear: C = |F - R|, k = A k_s                      bending: C = |sum_i K_i x_i|, k = k_b/(A0 + A1)
    sewn onto other cloth: C = |x_v - sum_j w_j x_j|     contact: rigid, with friction (positional_contact.py)

These are the energies of METHOD.md section 3. The surface moves with the skin and does not yield; fabric damping is not
there, and neither is a guarantee: what passes through in one sub-step stays there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tryon_solver.baselines.hinge_rows import hinge_rows
from tryon_solver.baselines.newton_ipc.discrete import Discrete, attached_rows
from tryon_solver.baselines.newton_ipc.march import Motion, Reference
from tryon_solver.baselines.newton_ipc.search import Search
from tryon_solver.baselines.positional_contact import project_contacts
from tryon_solver.baselines.xpbd.colours import colours
from tryon_solver.body.pose import Pose
from tryon_solver.scene import Scene
from tryon_solver.settings import Settings


class Xpbd:
    """A scene solved by XPBD. `held` (K,) cloth vertices stand still; `substeps` of a step, `iterations` of each."""

    def __init__(
        self,
        scene: Scene,
        settings: Settings | None = None,
        held: np.ndarray | None = None,
        substeps: int = 20,
        iterations: int = 1,
    ) -> None:
        for name, count in (("substeps", substeps), ("iterations", iterations)):
            if count < 1:
                raise ValueError(f"{name} must be at least 1, not {count}")
        self.scene, self.substeps, self.iterations = scene, substeps, iterations
        self.discrete = Discrete.build(scene, settings or Settings(), held)
        self.search = Search(self.discrete)
        self.data = Reference(scene, settings, held)  # its start and its skin, nothing else
        d = self.discrete
        self.weight = np.zeros(d.cloth_count)  # 1/kg, of the sub-step at hand
        self.triangles = colours(d.faces, d.cloth_count)
        ids, rows, area = hinge_rows(scene.garment)
        hinges = Rows(ids, rows, d.fabric.k_bend / area, colours(ids, d.cloth_count) if d.fabric.k_bend else [])
        sewn_on = attached_rows(scene)
        self.rows = (hinges, Rows(*sewn_on, colours(sewn_on[0], d.cloth_count)))

    def start(self, pose: Pose | None = None) -> Motion:
        """The scene at rest in its start position."""
        return self.data.start(pose)

    def step(self, motion: Motion, pose: Pose | None, dt: float) -> Motion:
        """Advance by dt [s] to `pose`."""
        d, h = self.discrete, dt / self.substeps
        n = d.cloth_count
        before, after = motion.x[n:], self.data.skin(pose)
        x, v = motion.x.copy(), motion.v.copy()
        # drag at a sub-step's end resists as more mass does: (M/h^2 + D/h)(x - x~) with x~ where drag alone leads
        self.weight = 1 / (d.mass + h * d.drag * d.contact.area)
        self.weight[d.held] = 0.0
        free = (self.weight > 0)[:, None]
        for k in range(1, self.substeps + 1):
            start = x.copy()
            v = (v + h * d.acceleration) / (1 + h * d.drag * d.contact.area / d.mass)[:, None]
            x[:n] += h * v * free
            x[n:] = before + k / self.substeps * (after - before)
            pulls = Pulls.none(len(d.faces), [len(rows.ids) for rows in self.rows])
            for _ in range(self.iterations):
                for group in self.triangles:
                    self._project_triangles(x, group, h, pulls)
                for rows, pull in zip(self.rows, pulls.of_rows):
                    for group in rows.groups:
                        self._project_rows(x, rows, group, h, pull)
                project_contacts(d, self.search, self.weight, x, start)
            v = (x[:n] - start[:n]) / h
        return Motion(x, v, pose)

    def _move(
        self,
        x: np.ndarray,
        ids: np.ndarray,
        slope: np.ndarray,
        c: np.ndarray,
        stiffness: np.ndarray,
        pull: np.ndarray,
        which: np.ndarray,
        one_sided: bool = False,
    ) -> None:
        """Project constraints of value c (P,) and slope (P, k, 3), which share no vertex; stiffness times h^2 (P,), and
        `pull[which]` (P,) is the sum of their moves in the sub-step so far. One-sided ones never push."""
        w = self.weight[ids]
        moved = (c + pull[which] / stiffness) / ((w * (slope**2).sum(2)).sum(1) + 1 / stiffness)
        if one_sided:
            moved = np.maximum(moved, pull[which])
        pull[which] -= moved
        x[ids] -= (w * moved[:, None])[:, :, None] * slope

    def _project_triangles(self, x: np.ndarray, group: np.ndarray, h: float, pulls: Pulls) -> None:
        d, cloth = self.discrete, self.discrete.fabric
        ids, g, area = d.faces[group], d.corner_gradients[group], d.face_area[group]
        for axis, k in enumerate((cloth.k_warp - cloth.k_shear, cloth.k_weft - cloth.k_shear)):
            if k > 0:
                f = np.einsum("tid,ti->td", x[ids], g[:, :, axis])
                length = np.linalg.norm(f, axis=1)
                slope = g[:, :, axis, None] * (f / length[:, None])[:, None, :]
                self._move(x, ids, slope, length - 1, h * h * k * area, pulls.of_axes[axis], group)
        if cloth.k_shear > 0:
            u, s, vt = _svd(x, ids, g)
            c = np.sqrt(((s - 1) ** 2).sum(1))
            p = np.einsum("tdk,tk,tka->tda", u, (s - 1) / np.maximum(c, 1e-12)[:, None], vt)
            slope = np.einsum("tda,tia->tid", p, g)
            self._move(x, ids, slope, c, h * h * cloth.k_shear * area, pulls.shear, group)
        if d.limit_stiffness > 0:
            u, s, vt = _svd(x, ids, g)
            c = s[:, 0] - cloth.strain_limit
            over = (c > 0) | (pulls.limit[group] < 0)
            p = np.einsum("td,ta->tda", u[over, :, 0], vt[over, 0])
            slope = np.einsum("tda,tia->tid", p, g[over])
            limit = h * h * d.limit_stiffness * area[over]
            self._move(x, ids[over], slope, c[over], limit, pulls.limit, group[over], one_sided=True)

    def _project_rows(self, x: np.ndarray, rows: Rows, group: np.ndarray, h: float, pull: np.ndarray) -> None:
        ids, weights = rows.ids[group], rows.weights[group]
        sums = np.einsum("hid,hi->hd", x[ids], weights)
        c = np.linalg.norm(sums, axis=1)
        slope = weights[:, :, None] * (sums / np.maximum(c, 1e-12)[:, None])[:, None, :]
        self._move(x, ids, slope, c, h * h * rows.stiffness[group], pull, group)


@dataclass(frozen=True)
class Rows:
    """Constraints C = |sum_i weights_i x_i|: `ids` (P, 4), `weights` (P, 4), `stiffness` (P,); `groups` share none."""

    ids: np.ndarray
    weights: np.ndarray
    stiffness: np.ndarray
    groups: list[np.ndarray]


@dataclass(frozen=True)
class Pulls:
    """Lagrange multipliers times h^2 of one sub-step so far: of warp and weft, shear and strain limit (F,) each, and of
    each `Rows` (P,)."""

    of_axes: tuple[np.ndarray, np.ndarray]
    shear: np.ndarray
    limit: np.ndarray
    of_rows: list[np.ndarray]

    @staticmethod
    def none(faces: int, rows: list[int]) -> Pulls:
        """As a sub-step begins."""
        zero = np.zeros
        return Pulls((zero(faces), zero(faces)), zero(faces), zero(faces), [zero(count) for count in rows])


def _svd(x: np.ndarray, ids: np.ndarray, g: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of the deformation gradients (T, 3, 2): the larger stretch first."""
    return np.linalg.svd(np.einsum("tid,tia->tda", x[ids], g), full_matrices=False)
