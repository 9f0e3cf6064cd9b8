"""Vertices held in place by stiff springs: an effect of the tests' own, registered as any other.

The solver has no pins. That this works says that an effect needs no line in the core.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from tryon_solver.effects import registry
from tryon_solver.effects.base import BuildContext
from tryon_solver.plan import Contribution

wp.set_module_options({"enable_backward": False})


@dataclass(frozen=True)
class Pins:
    """`vertices` (K,) int32 held at their start by `stiffness` N/m."""

    vertices: np.ndarray
    stiffness: float = 2e4


registry.MODULES[Pins] = __name__


@wp.kernel
def hold_kernel(
    vertices: wp.array(dtype=wp.int32),
    places: wp.array(dtype=wp.vec3),
    stiffness: float,
    x: wp.array(dtype=wp.vec3),
    gradient_out: wp.array(dtype=wp.vec3),
):
    k = wp.tid()
    i = vertices[k]
    gradient_out[i] = gradient_out[i] + stiffness * (x[i] - places[k])


def bind(spec: Pins, context: BuildContext) -> Contribution:
    """k/2 sum |x_i - X_i|^2."""
    device = context.device
    vertices = wp.array(spec.vertices.astype(np.int32), dtype=wp.int32, device=device)
    places = wp.array(context.scene.x_start[spec.vertices].astype(np.float32), dtype=wp.vec3, device=device)

    def add_gradient(x: wp.array, gradient: wp.array) -> None:
        inputs = [vertices, places, spec.stiffness, x]
        wp.launch(hold_kernel, len(spec.vertices), inputs, [gradient], device=device)

    diagonal = np.zeros(context.scene.garment.vertex_count)
    diagonal[spec.vertices] = spec.stiffness

    def held(dt: float) -> np.ndarray:
        assert dt > 0  # the springs' stiffness is the same in every step
        return diagonal

    return Contribution("pins", add_gradient=add_gradient, diagonal=held)
