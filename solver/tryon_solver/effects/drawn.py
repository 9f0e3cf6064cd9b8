"""Vertices drawn to places that are other ones from frame to frame (drawn.py): pins under a name of their own, so that
what a tailor's pins hold meanwhile stays held.

A frame may be cut into several steps. In each the value "places" (K,) vec3 m goes as much of what is left of the way to
the value "wanted" (K,) vec3 m as the step has of the time that is left to be there, the value "left" (1,) float32 s:
drawn to the end at once in the first, cloth is wanted further from where it is than it can go.
"""

from __future__ import annotations

from dataclasses import replace

import warp as wp

from tryon_solver.effects import pins
from tryon_solver.effects.base import BuildContext
from tryon_solver.linalg.launch import launch
from tryon_solver.plan import Contribution
from tryon_solver.scene import Pins
from tryon_solver.state import State

wp.set_module_options({"enable_backward": False})


@wp.kernel
def lead_kernel(
    wanted: wp.array(dtype=wp.vec3),
    left: wp.array(dtype=wp.float32),
    dt: wp.array(dtype=wp.float32),
    places: wp.array(dtype=wp.vec3),
):
    k = wp.tid()
    share = wp.min(1.0, dt[0] / wp.max(left[0], 1.0e-9))
    places[k] = places[k] + share * (wanted[k] - places[k])


@wp.kernel
def pass_kernel(dt: wp.array(dtype=wp.float32), left: wp.array(dtype=wp.float32)):
    left[0] = wp.max(0.0, left[0] - dt[0])


def bind(spec: Pins, context: BuildContext) -> Contribution | None:
    """None when nothing is drawn."""
    bound = pins.bind(spec, context)
    if bound is None:
        return None
    places = bound.values["places"]
    wanted, left = wp.clone(places), wp.zeros(1, dtype=wp.float32, device=context.device)

    def start_step(state: State) -> None:
        launch(lead_kernel, len(places), [wanted, left, state.dt], [places], device=context.device)
        launch(pass_kernel, 1, [state.dt], [left], device=context.device)

    return replace(bound, name="drawn", start_step=start_step, values={**bound.values, "wanted": wanted, "left": left})
