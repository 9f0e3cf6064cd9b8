"""Damping within the fabric, proportional to its stiffness.

Force -beta H v with H the Hessian of membrane and bending at the end of the step, made positive semidefinite, and v =
(x - x_start)/dt: stiffness-proportional (Rayleigh) damping. The strain limit has no part in H. A mode of frequency f
is damped by the ratio pi f beta of critical. Turning the garment as a whole costs nothing, since H leaves rigid
motions of unstretched cloth alone; that would not hold for projective dynamics' constant matrix. It acts in the
correction (stepping/newton.py), where H is at hand.
"""

from __future__ import annotations

from tryon_solver.effects.base import BuildContext
from tryon_solver.plan import Contribution
from tryon_solver.scene import FabricDamping


def bind(spec: FabricDamping, context: BuildContext) -> Contribution | None:
    """None when the damping time is zero."""
    if spec.time == 0:
        return None
    return Contribution("fabric_damping", damping_time=spec.time)
