"""The energy of the cloth, and the work that pins and moving bodies do on it, in float64.

    E = 1/2 v^T M v - M a . x + Psi(x) + B(x) + G + pins,      W = sum over steps of dE/dc . dc + dE/dp . dp

G is what contacts that stick hold like springs, c the collision surface as it moves, p the pins' places, derivatives
at the end of the step. Sliding, drag and damping only take energy: with an implicit step E - W can't grow where the
potential is convex, by E(x1) - E(x0) <= dE/dx(x1) . (x1 - x0), and no more than that convexity is missed by where it is
not.

The fabric's own energies are computed here from the formulas of METHOD.md section 3; those of contact are the solver's
pairs, which the oracles' tests hold to their own formulas, at gaps in float64.
"""

from __future__ import annotations

import numpy as np
from contact_state import contact_gradient

from tryon_solver.baselines.hinge_rows import hinge_rows
from tryon_solver.contact import pairs
from tryon_solver.scene import Friction, Gravity, Pins, StrainLimit
from tryon_solver.simulation import Simulation
from tryon_solver.stepping.search import search_around


class EnergyMeter:
    """Prepared for one simulation."""

    def __init__(self, sim: Simulation) -> None:
        garment, fabrics = sim.scene.garment, sim.scene.fabric_of_face()
        effects = {type(effect): effect for effect in sim.scene.effects}
        gravity, limit, pins = effects.get(Gravity), effects.get(StrainLimit), effects.get(Pins)
        self.sim = sim
        self.mass = sim.mass
        self.acceleration = np.array(gravity.acceleration) if isinstance(gravity, Gravity) else np.zeros(3)
        self.limit_stiffness = limit.stiffness if isinstance(limit, StrainLimit) else 0.0
        self.pins = pins if isinstance(pins, Pins) else None
        friction = effects.get(Friction)
        self.friction = friction if isinstance(friction, Friction) else None
        self.hinges, self.hinge_rows, around = hinge_rows(garment)
        k_bend = np.array([fabric.k_bend for fabric in fabrics])
        self.bending = k_bend[garment.hinges()[:, 4:]].mean(axis=1) / around
        self.stiffness = np.array([(f.k_warp, f.k_weft, f.k_shear) for f in fabrics]).T
        self.limits = np.array([[f.strain_limit] for f in fabrics])
        self.gradients, self.area = garment.corner_gradients(), garment.signed_areas()
        self.places = self._places()
        self.surface = sim.body_positions().astype(np.float64)
        self.origin = sim.cloth_positions().astype(np.float64).mean(0)

    def kinetic(self, v: np.ndarray) -> float:
        """J at velocities (N, 3) m/s."""
        return 0.5 * float(self.mass @ (v * v).sum(1))

    def elastic(self, x: np.ndarray) -> float:
        """J of membrane, strain limit and bending at x (N, 3) m."""
        k_u, k_v, k_s = self.stiffness
        f = np.einsum("tia,tid->tad", x[self.sim.scene.garment.faces], self.gradients)
        c = np.einsum("tad,tae->tde", f, f)
        half, radius = 0.5 * (c[:, 0, 0] + c[:, 1, 1]), np.hypot(0.5 * (c[:, 0, 0] - c[:, 1, 1]), c[:, 0, 1])
        s = np.sqrt(np.maximum(np.column_stack([half - radius, half + radius]), 0))
        stretch = np.sqrt(np.column_stack([c[:, 0, 0], c[:, 1, 1]])) - 1
        along = np.column_stack([k_u - k_s, k_v - k_s])
        density = k_s * ((s - 1) ** 2).sum(1) + (along * stretch**2).sum(1)
        density += self.limit_stiffness * (np.maximum(s - self.limits, 0) ** 2).sum(1)
        bent = np.einsum("hk,hkd->hd", self.hinge_rows, x[self.hinges] - x[self.hinges[:, :1]])
        return 0.5 * float(self.area @ density) + 0.5 * float(self.bending @ (bent * bent).sum(1))

    def contact(self) -> float:
        """J of the barrier, and of what sticks, at the solver's state."""
        sim = self.sim
        if not sim.touching:
            return 0.0
        if not sim.listed:  # before the first step
            sim.work.direction.zero_()
            search_around(sim, sim.state.x, sim.work.direction)
        pairs.collect(sim.pairs, sim.candidates, sim.contact, sim.state.x)
        told, slope, gap, ids, lam = (
            array.numpy()[: sim.pairs.size].astype(np.float64)
            for array in (sim.pairs.energy, sim.pairs.slope, sim.pairs.gap, sim.pairs.ids, sim.pairs.lam)
        )
        # a tight garment presses with hundreds of newtons: gaps that are rounded make microjoules come and go
        ids = ids.astype(int)
        x = sim.state.x.numpy().astype(np.float64)
        sizes = sim.contact.sizes
        offset = np.where((ids >= sim.cloth_count).any(1), sizes.xi_body, sizes.xi_self)
        exact = np.linalg.norm(np.einsum("ck,ckd->cd", lam, x[ids]), axis=1) - offset
        return float((told + slope * (exact - gap[:, 0])).sum()) + self.given(ids, -slope)

    def given(self, ids: np.ndarray, pressed: np.ndarray) -> float:
        """J that contacts which stick hold like springs (METHOD.md section 6), for pairs `ids` (P, 4) under
        `pressed` (P,) N."""
        sim = self.sim
        if self.friction is None or not sim.stages.contact:
            return 0.0
        (term,) = sim.stages.contact
        known, slips = term.kept()
        slip = dict(zip(map(tuple, known.tolist()), np.linalg.norm(slips, axis=1)))
        y = np.array([slip.get(vertices, 0.0) for vertices in map(tuple, ids.tolist())])
        fabric, e = sim.scene.fabric, self.friction.presliding
        mu = np.where((ids >= sim.cloth_count).any(1), fabric.mu_body, fabric.mu_self)
        return float((mu * pressed * (y**2 / e - y**3 / (3 * e**2))).sum())

    def pinned(self, x: np.ndarray) -> float:
        """J of the pins' springs at x (N, 3) m."""
        if self.pins is None:
            return 0.0
        apart = x[self.pins.vertices] - self._places()
        return 0.5 * self.pins.stiffness * float((apart * apart).sum())

    def energies(self) -> tuple[float, float, float]:
        """Kinetic, stored (elastic, contact, what sticks, pins), and potential in gravity [J] at the solver's state."""
        x = self.sim.cloth_positions().astype(np.float64)
        v = self.sim.state.v.numpy().astype(np.float64)
        fall = -float(self.mass @ ((x - self.origin) @ self.acceleration))
        return self.kinetic(v), self.elastic(x) + self.contact() + self.pinned(x), fall

    def work(self) -> float:
        """J that was done on the cloth since the last call, with the forces of the pairs as collected now."""
        done = 0.0
        surface = self.sim.body_positions().astype(np.float64)
        if len(surface) and self.sim.touching and self.sim.pairs.size:
            force = contact_gradient(self.sim, friction=True)[self.sim.cloth_count :]
            done += float((force * (surface - self.surface)).sum())
        if self.pins is not None:
            places = self._places()
            x = self.sim.cloth_positions().astype(np.float64)[self.pins.vertices]
            done += self.pins.stiffness * float(((places - x) * (places - self.places)).sum())
            self.places = places
        self.surface = surface
        return done

    def _places(self) -> np.ndarray:
        """(K, 3) m of the pins now."""
        held = next((c for c in self.sim.plan.contributions if c.name == "pins"), None)
        return np.zeros((0, 3)) if held is None else held.values["places"].numpy().astype(np.float64)
