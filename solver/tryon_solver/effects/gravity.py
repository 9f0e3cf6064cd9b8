"""Uniform gravity: an acceleration in the inertial prediction, the contribution's value "acceleration"."""

from __future__ import annotations

import warp as wp

from tryon_solver.effects.base import BuildContext
from tryon_solver.linalg.launch import launch
from tryon_solver.plan import Contribution
from tryon_solver.scene import Gravity

wp.set_module_options({"enable_backward": False})


@wp.kernel
def add_uniform_kernel(acceleration: wp.array(dtype=wp.vec3), out: wp.array(dtype=wp.vec3)):
    i = wp.tid()
    out[i] = out[i] + acceleration[0]


def bind(spec: Gravity, context: BuildContext) -> Contribution | None:
    """Always something to do: a spec of 0 is idle."""
    acceleration: wp.array = wp.array([spec.acceleration], dtype=wp.vec3, device=context.device)

    def add_acceleration(out: wp.array) -> None:
        launch(add_uniform_kernel, len(out), [acceleration], [out], device=context.device)

    values = {"acceleration": acceleration}
    return Contribution("gravity", add_acceleration=add_acceleration, values=values)
