"""Inflated pieces: a pressure p behind the cloth, on each triangle the force p A n, a third of it on each corner.

Over a closed piece that is the gradient of -p V, V the volume within. Its Hessian turns forces along with the normals
and is indefinite; it is left out of the matrices, which the tension that the pressure causes bounds from above: at a
sphere of radius r the membrane's tension p r/2 resists a wave of l periods by p l (l + 1)/(2 r), and the pressure gives
way to it by p/r. Source of the force: Hughes and Pister 1978, "Consistent linearization in mechanics of solids and
structures", follower loads.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from tryon_solver.effects.base import BuildContext
from tryon_solver.linalg.launch import launch
from tryon_solver.plan import Contribution
from tryon_solver.scene import Pressure

wp.set_module_options({"enable_backward": False})


@wp.kernel
def add_pressure_kernel(
    inflated: wp.array(dtype=wp.int32),
    faces: wp.array(dtype=wp.vec3i),
    pressure: wp.array(dtype=wp.float32),
    x: wp.array(dtype=wp.vec3),
    corner_gradient_out: wp.array2d(dtype=wp.vec3),
):
    """-p/6 (x1 - x0) x (x2 - x0) to each corner."""
    t = inflated[wp.tid()]
    f = faces[t]
    push = pressure[0] / 6.0 * wp.cross(x[f[1]] - x[f[0]], x[f[2]] - x[f[0]])
    for i in range(3):
        corner_gradient_out[t, i] = corner_gradient_out[t, i] - push


def bind(spec: Pressure, context: BuildContext) -> Contribution | None:
    """Always something to do: the pressure may be written."""
    device, garment = context.device, context.scene.garment
    faces = np.arange(len(garment.faces))
    if spec.panels:
        faces = np.flatnonzero(np.isin(garment.panel_of_face, spec.panels))
    inflated: wp.array = wp.array(faces, dtype=wp.int32, device=device)
    pressure: wp.array = wp.array([spec.pressure], dtype=wp.float32, device=device)

    def project(x: wp.array, corner_gradient: wp.array) -> None:
        inputs = [inflated, context.rest.faces, pressure, x]
        launch(add_pressure_kernel, len(faces), inputs, [corner_gradient], device=device)

    return Contribution("pressure", project=project, values={"pressure": pressure})
