"""Gas that cloth shuts in: a ball, an airbed, a puffed chamber; as it is squeezed its pressure rises.

The ideal gas at one temperature (Boyle 1662): p V = n R T stays, V the volume within the triangles and the caps that
close their openings. Against the pressure around, p_a, its potential and the force on the vertices are

    E(V) = p_a V - n R T ln V,   f = (n R T/V - p_a) w,   w_i = dV/dx_i = sum over triangles at i of A n/3

the follower load of pressure.py with a pressure that follows the volume. Of the Hessian

    n R T/V^2 w w^T - (n R T/V - p_a) d^2V/dx^2

the first is a dyad, dense but positive semidefinite, and so stiff that nothing works without it: air in a ball of 10 cm
resists its skin's breathing ten thousand times more than the skin's inertia does. The correction takes it whole
(linalg/dyad.py), for one more system to solve an iteration. The second turns forces along with the normals and is left
out, as in pressure.py. Projective dynamics, which knows no dyad, goes on with the pressure that the last direction of
the step before was to lead to, p - n R T/V^2 w.d, which is what skin and all else hold; what it is otherwise acts in
the correction alone. A step that begins with 1 % too little room would send the skin off by a metre with the pressure
that this makes, where a micrometre relieves it: what a correction that is cut short leaves is not to be the next one's.
"""

from __future__ import annotations

import numpy as np
import warp as wp

from tryon_solver.effects.base import BuildContext
from tryon_solver.geometry.enclosed import closed_by_caps, enclosed_volume
from tryon_solver.linalg.dyad import Dyad
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.order_free import add, places
from tryon_solver.plan import Contribution
from tryon_solver.scene import Gas
from tryon_solver.state import State

wp.set_module_options({"enable_backward": False})

VOLUME_QUANTA = wp.constant(wp.float64(2.0**50))  # in 1 m^3, and volumes up to 8192 (order_free.py)
LEAST = wp.constant(wp.float64(1e-4))  # of the gas's volume at the pressure around: below it the law is at its end


@wp.kernel
def measure_kernel(
    faces: wp.array(dtype=wp.vec3i),
    x: wp.array(dtype=wp.vec3),
    volume: wp.array(dtype=wp.float64),
    whole_volume: wp.array(dtype=wp.int64),
    slope: wp.array(dtype=wp.vec3),
    whole: wp.array(dtype=wp.int64),
):
    """volume += x0 . (x1 x x2)/6 about a vertex; slope += (x1 - x0) x (x2 - x0)/6 at each corner."""
    f = faces[wp.tid()]
    origin = x[faces[0][0]]
    x0 = x[f[0]] - origin
    x1 = x[f[1]] - origin
    x2 = x[f[2]] - origin
    part = wp.float64(wp.dot(x0, wp.cross(x1, x2))) / wp.float64(6.0)
    if whole_volume.shape[0] == 0:
        wp.atomic_add(volume, 0, part)
    else:
        wp.atomic_add(whole_volume, 0, wp.int64(wp.rint(part * VOLUME_QUANTA)))
    push = wp.cross(x1 - x0, x2 - x0) / 6.0
    for k in range(3):
        add(slope, whole, f[k], push)


@wp.kernel
def follow_kernel(
    volume: wp.array(dtype=wp.float64),
    whole_volume: wp.array(dtype=wp.int64),
    amount: wp.array(dtype=wp.float64),
    share: wp.array(dtype=wp.float64),
    ambient: wp.array(dtype=wp.float64),
    gauge_out: wp.array(dtype=wp.float32),
    stiffness_out: wp.array(dtype=wp.float32),
):
    """n R T/V - p_a [Pa] and n R T/V^2 [Pa/m^3], n R T = amount share"""
    nrt = amount[0] * share[0]
    v = volume[0]
    if whole_volume.shape[0] > 0:
        v = wp.float64(whole_volume[0]) / VOLUME_QUANTA
    v = wp.max(v, LEAST * nrt / ambient[0])
    gauge_out[0] = wp.float32(nrt / v - ambient[0])
    stiffness_out[0] = wp.float32(nrt / (v * v))


@wp.kernel
def expect_kernel(
    gauge: wp.array(dtype=wp.float32), gain: wp.array(dtype=wp.float32), expected_out: wp.array(dtype=wp.float32)
):
    """The pressure that the last direction was to lead to: gauge - n R T/V^2 w.p"""
    expected_out[0] = gauge[0] - gain[0]


@wp.kernel
def add_push_kernel(
    gauge: wp.array(dtype=wp.float32),
    without: wp.array(dtype=wp.float32),
    slope: wp.array(dtype=wp.vec3),
    gradient_out: wp.array(dtype=wp.vec3),
):
    """gradient -= (gauge - without) w"""
    i = wp.tid()
    gradient_out[i] = gradient_out[i] - (gauge[0] - without[0]) * slope[i]


def bind(spec: Gas, context: BuildContext) -> Contribution | None:
    """Always something to do: there is gas in it."""
    device, scene, sums = context.device, context.scene, context.sums
    into = sums.vectors
    garment = scene.garment
    faces = closed_by_caps(spec.faces_of(garment))
    start = enclosed_volume(scene.x_start, faces)
    volume = start if spec.volume is None else spec.volume
    closed: wp.array = wp.array(faces, dtype=wp.vec3i, device=device)
    amount: wp.array = wp.array([spec.ambient * volume], dtype=wp.float64, device=device)
    share: wp.array = wp.array([1.0], dtype=wp.float64, device=device)
    ambient: wp.array = wp.array([spec.ambient], dtype=wp.float64, device=device)
    now: wp.array = wp.zeros(1, dtype=wp.float64, device=device)
    whole = places(1, device)
    gauge, gauge_before, unused, nothing = (wp.zeros(1, dtype=wp.float32, device=device) for _ in range(4))
    body = 0 if scene.body is None else len(scene.body.rest_vertices)
    dyad = Dyad(garment.vertex_count + body, device)

    def measure(x: wp.array, gauge_out: wp.array) -> None:
        now.zero_()
        whole.zero_()
        dyad.vector.zero_()
        outputs = [now, whole, dyad.vector, into]
        launch(measure_kernel, len(faces), [closed, x], outputs, device=device)
        sums.settle(dyad.vector)
        launch(follow_kernel, 1, [now, whole, amount, share, ambient], [gauge_out, dyad.stiffness], device=device)

    def start_step(_state: State) -> None:
        launch(expect_kernel, 1, [gauge, dyad.gain], [gauge_before], device=device)

    def add_gradient(x: wp.array, gradient: wp.array) -> None:
        measure(x, unused)
        inputs = [gauge_before, nothing, dyad.vector]
        launch(add_push_kernel, garment.vertex_count, inputs, [gradient], device=device)

    def add_in_correction(_state: State, x: wp.array, gradient: wp.array) -> None:
        measure(x, gauge)
        inputs = [gauge, gauge_before, dyad.vector]
        launch(add_push_kernel, garment.vertex_count, inputs, [gradient], device=device)

    def energy(x: wp.array) -> float:
        within = enclosed_volume(x.numpy().astype(np.float64), faces)
        nrt = float(amount.numpy()[0] * share.numpy()[0])
        return float(ambient.numpy()[0] * within - nrt * np.log(within))

    return Contribution(
        "gas",
        start_step=start_step,
        add_gradient=add_gradient,
        add_velocity_gradient_in_correction=add_in_correction,
        dyad=dyad,
        energy=energy,
        values={"amount": amount, "share": share, "ambient": ambient},
    )
