"""A model of fabric that works on single triangles: its kernels on one garment, ready to take part in the plan."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from tryon_solver.linalg.launch import launch
from tryon_solver.materials.device import RestShape


@dataclass(frozen=True)
class TriangleModel:
    """One energy, summed over triangles.

    Its kernels take the triangles (`faces`, `gradients`, `area` of `rest`), then the model's own `parameters` (arrays
    (F,)), and at last x. `energies` (F,) J is where the last evaluation's are.
    """

    rest: RestShape
    parameters: list[wp.array]
    project_kernel: Any
    energy_kernel: Any
    hessian_kernel: Any
    energies: wp.array

    @staticmethod
    def build(kernels: Any, rest: RestShape, parameters: list[wp.array]) -> TriangleModel:
        """`kernels` is the model's module: it has project_kernel, energy_kernel and hessian_kernel."""
        energies = wp.zeros(rest.face_count, dtype=wp.float32, device=rest.faces.device)
        return TriangleModel(
            rest, parameters, kernels.project_kernel, kernels.energy_kernel, kernels.hessian_kernel, energies
        )

    @property
    def triangles(self) -> list[wp.array]:
        """What every kernel takes first."""
        return [self.rest.faces, self.rest.gradients, self.rest.area, *self.parameters]

    def project(self, x: wp.array, corner_gradient: wp.array) -> None:
        """Add the gradient at x (N,) vec3 m to the triangles' corners (F, 3) vec3 N."""
        self._launch(self.project_kernel, [x], corner_gradient)

    def energy(self, x: wp.array) -> float:
        """At x (N,) vec3 m, in J."""
        self._launch(self.energy_kernel, [x], self.energies)
        return float(self.energies.numpy().sum(dtype=np.float64))

    def add_triangle_hessian(self, x: wp.array, hessians: wp.array) -> None:
        """Add the positive semidefinite Hessian at x (N,) vec3 m over dF to the triangles' (F, 3) mat33 N m."""
        self._launch(self.hessian_kernel, [x], hessians)

    def _launch(self, kernel: Any, state: list[wp.array], output: wp.array) -> None:
        launch(kernel, self.rest.face_count, [*self.triangles, *state], [output], device=output.device)
