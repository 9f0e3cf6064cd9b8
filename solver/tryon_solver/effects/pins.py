"""Vertices held, or led, by stiff springs: Psi = k/2 sum_i |x_i - p_i|^2.

The places p_i are the contribution's value "places" (K,) vec3 m: where the vertices were at the start, until they are
written between two steps; of pins that the body leads, where triangles of its surface take them (geometry/carried.py),
anew in each step. Springs rather than constraints: what is led through something narrow must be able to give.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from tryon_solver.effects.base import BuildContext
from tryon_solver.linalg.launch import launch
from tryon_solver.plan import Contribution
from tryon_solver.scene import Pins
from tryon_solver.state import State

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


@wp.kernel
def follow_kernel(
    onto: wp.array(dtype=wp.vec3i),
    offsets: wp.array(dtype=wp.vec3),
    vertices: wp.array(dtype=wp.int32),
    x: wp.array(dtype=wp.vec3),
    places_out: wp.array(dtype=wp.vec3),
):
    """place = x0 + offset along t, n and n x t of the triangle; where there is none, where the vertex is."""
    k = wp.tid()
    f = onto[k]
    if f[0] == f[1]:
        places_out[k] = x[vertices[k]]
        return
    x0 = x[f[0]]
    along = x[f[1]] - x0
    t = wp.normalize(along)
    n = wp.normalize(wp.cross(along, x[f[2]] - x0))
    offset = offsets[k]
    places_out[k] = x0 + offset[0] * t + offset[1] * n + offset[2] * wp.cross(n, t)


def bind(spec: Pins, context: BuildContext) -> Contribution | None:
    """Always something to do: a spec that holds no vertex, or by nothing, is idle."""
    device, x_start = context.device, context.scene.x_start
    vertices: wp.array = wp.array(spec.vertices.astype(np.int32), dtype=wp.int32, device=device)
    places: wp.array = wp.array(x_start[spec.vertices].astype(np.float32), dtype=wp.vec3, device=device)
    held = np.zeros(context.scene.garment.vertex_count)
    held[spec.vertices] = spec.stiffness

    values = {"places": places}
    onto: wp.array = wp.zeros(len(vertices) if spec.led else 0, dtype=wp.vec3i, device=device)
    offsets: wp.array = wp.zeros(len(onto), dtype=wp.vec3, device=device)
    if spec.led:
        values |= {"onto": onto, "offsets": offsets}

    def follow(state: State) -> None:
        launch(follow_kernel, len(onto), [onto, offsets, vertices, state.x], [places], device=device)

    def add_gradient(x: wp.array, gradient: wp.array) -> None:
        inputs = [vertices, places, spec.stiffness, x]
        launch(add_pins_kernel, len(vertices), inputs, [gradient], device=device)

    def diagonal(_dt: float, _area: np.ndarray) -> np.ndarray:
        return held

    def energy(x: wp.array) -> float:
        apart = x.numpy()[spec.vertices].astype(np.float64) - places.numpy()
        return 0.5 * spec.stiffness * float((apart * apart).sum())

    return Contribution(
        "pins",
        start_step=follow if spec.led else None,
        add_gradient=add_gradient,
        diagonal=diagonal,
        energy=energy,
        led=spec.vertices if spec.led else None,
        values=values,
    )
