"""Vertices held, or led, by stiff springs: Psi = k/2 sum_i |x_i - p_i|^2.

The places p_i are the contribution's value "places" (K,) vec3 m: where the vertices were at the start, until they are
written between two steps. Springs rather than constraints: what is led through something narrow must be able to give.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from tryon_solver.effects.base import BuildContext
from tryon_solver.linalg.launch import launch
from tryon_solver.plan import Contribution
from tryon_solver.scene import Pins

wp.set_module_options({"enable_backward": False})


@wp.kernel
def add_pins_kernel(
    vertices: wp.array(dtype=wp.int32),
    places: wp.array(dtype=wp.vec3),
    stiffness: float,
    x: wp.array(dtype=wp.vec3),
    gradient_out: wp.array(dtype=wp.vec3),
):
    k = wp.tid()
    i = vertices[k]
    gradient_out[i] = gradient_out[i] + stiffness * (x[i] - places[k])


def bind(spec: Pins, context: BuildContext) -> Contribution | None:
    """None when no vertex is held, or by nothing."""
    if len(spec.vertices) == 0 or spec.stiffness == 0:
        return None
    device, x_start = context.device, context.scene.x_start
    vertices: wp.array = wp.array(spec.vertices.astype(np.int32), dtype=wp.int32, device=device)
    places: wp.array = wp.array(x_start[spec.vertices].astype(np.float32), dtype=wp.vec3, device=device)
    held = np.zeros(context.scene.garment.vertex_count)
    held[spec.vertices] = spec.stiffness

    def add_gradient(x: wp.array, gradient: wp.array) -> None:
        inputs = [vertices, places, spec.stiffness, x]
        launch(add_pins_kernel, len(vertices), inputs, [gradient], device=device)

    def diagonal(_dt: float, _area: np.ndarray) -> np.ndarray:
        return held

    def energy(x: wp.array) -> float:
        apart = x.numpy()[spec.vertices].astype(np.float64) - places.numpy()
        return 0.5 * spec.stiffness * float((apart * apart).sum())

    return Contribution(
        "pins", add_gradient=add_gradient, diagonal=diagonal, energy=energy, values={"places": places}
    )
