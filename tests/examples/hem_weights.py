"""Weights sewn into a hem, or a brooch: an effect made outside the package, on one page.

A point mass m at a vertex falls, swings and resists as the cloth's own mass does. With v the velocity at the step's
start and implicit Euler's inertia, its part of the step's potential is

    m/(2 dt^2) |x - x_start - dt v|^2 - m a.x,   gradient m ((x - x_start)/dt^2 - v/dt - a),   matrix m/dt^2
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import warp as wp

from tryon_solver.checks import check_indices, check_numbers, check_vector
from tryon_solver.effect_spec import check_vertices
from tryon_solver.effects.base import BuildContext
from tryon_solver.linalg.launch import launch
from tryon_solver.plan import Contribution
from tryon_solver.scene import EffectSpec, Scene
from tryon_solver.state import State

if TYPE_CHECKING:
    from tryon_solver.effect_words.rules import Parameters
    from tryon_solver.geometry.named_lines import Cut

wp.set_module_options({"enable_backward": False})


@dataclass(frozen=True)
class HemWeights(EffectSpec):
    """`masses` (K,) kg at `vertices` (K,) int32, under `acceleration` m/s^2.

    The contribution's value "masses" is read by every step; inertia in the matrices stays that of the start.
    """

    module: ClassVar[str] = "hem_weights"  # where `bind` is; imported when a scene lists the effect

    vertices: np.ndarray
    masses: np.ndarray
    acceleration: tuple[float, float, float] = (0.0, -9.81, 0.0)

    def __post_init__(self) -> None:
        check_indices("hem weights: vertices", self.vertices, "K")
        check_numbers("hem weights: masses", self.masses, len(self.vertices))
        if (self.masses < 0).any():
            k = int(np.argmax(self.masses < 0))
            raise ValueError(f"hem weights: mass {k} is {self.masses[k]} kg; give what it weighs, 0 or more")
        check_vector("hem weights: acceleration", self.acceleration)

    def check(self, scene: Scene) -> None:
        """Raises ValueError for a vertex that the garment does not have."""
        check_vertices("hem weights: vertices", self.vertices, scene)


@wp.kernel
def add_inertia_kernel(
    vertices: wp.array(dtype=wp.int32),
    masses: wp.array(dtype=wp.float32),
    acceleration: wp.vec3,
    dt: wp.array(dtype=wp.float32),
    v: wp.array(dtype=wp.vec3),
    x_start: wp.array(dtype=wp.vec3),
    x: wp.array(dtype=wp.vec3),
    gradient_out: wp.array(dtype=wp.vec3),
):
    k = wp.tid()
    i = vertices[k]
    h = dt[0]
    gained = (x[i] - x_start[i]) / (h * h) - v[i] / h
    wp.atomic_add(gradient_out, i, masses[k] * (gained - acceleration))


def spec(parameters: Parameters, cut: Cut) -> HemWeights:
    """What a session lists for the effect by its word (hem_weights_word.py): each line's mass, shared by its vertices.
    Raises EffectError for an edge that the pattern does not have."""
    vertices, masses = [], []
    for k, row in enumerate(parameters["lines"]):
        line = np.unique(cut.mesh_edges(row["along"], f"parameters.lines[{k}].along"))
        vertices.append(line)
        masses.append(np.full(len(line), row["mass"] / len(line)))
    return HemWeights(np.concatenate(vertices), np.concatenate(masses))


def bind(spec: HemWeights, context: BuildContext) -> Contribution | None:
    """None without any weight. All that a step needs is allocated here: what it launches neither reads nor
    allocates."""
    if not spec.masses.any():
        return None
    device = context.device
    vertices = wp.array(spec.vertices.astype(np.int32), dtype=wp.int32, device=device)
    masses = wp.array(spec.masses.astype(np.float32), dtype=wp.float32, device=device)
    acceleration = wp.vec3(*spec.acceleration)
    weighed = np.bincount(spec.vertices, spec.masses, context.scene.garment.vertex_count)

    def add_velocity_gradient(state: State, x: wp.array, gradient: wp.array) -> None:
        inputs = [vertices, masses, acceleration, state.dt, state.v, state.x_start, x]
        launch(add_inertia_kernel, len(masses), inputs, [gradient], device=device)

    def diagonal(dt: float, _area: np.ndarray) -> np.ndarray:
        return weighed / dt**2

    return Contribution(
        "hem_weights", add_velocity_gradient=add_velocity_gradient, diagonal=diagonal, values={"masses": masses}
    )
