"""Coulomb friction with smoothed static regime, on every contact pair.

For a pair with normal force N = -e kappa b' and tangential slip u = (I - n n^T) sum_i lam_i (x_i - x_start_i), which
includes the body's own motion, the force on vertex i is

    -lam_i mu N f1(|u|) u/|u|,   f1(y) = (2 - y/e) y/e for y < e, else 1,   e = eps_v dt.

N and n are lagged per iteration. Source: Li et al. 2020 (IPC), section 5. Two matrices are made of it, both positive
semidefinite, with T = I - n n^T and t = u/|u|:

    a model that is used away from where it was made (the contact proxy):   mu N f1/y T
    an iteration of the correction:                                         mu N (f1/y (T - t t^T) + c t t^T)

The first bounds the potential from above, and iterated alone it leaves the static regime ever so slowly: along t the
force of what slides does not grow any more. So in the correction c is f1', zero beyond e. A slip that an iteration
turned round (u . u_before < 0) has passed the static regime, where f1' knows nothing of the resistance in between:
there c is the slope of the chord, (f1(y) + f1(y_before))/(y + y_before). A slip beyond e that an iteration shortened is
on its way back to it, and c = 0 would send it past again and again: there the secant stays, which shortens it steadily.
Of the pair's normal forces at this iterate and the last the smaller counts, and where they differ by more than SETTLED
the secant stays: a pair that fell deep into its barrier for one iteration would throw the cloth.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from tryon_solver.contact.barrier import barrier_gradient
from tryon_solver.contact.pairs import ContactPairs
from tryon_solver.effects.base import BuildContext
from tryon_solver.plan import ContactTerm, Contribution
from tryon_solver.scene import Friction
from tryon_solver.state import State

wp.set_module_options({"enable_backward": False})

SETTLED = 0.5  # share that the normal force of a pair keeps, or kept, from an iteration to the next to be relied on


@wp.func
def slip(
    v: wp.vec4i,
    w: wp.vec4,
    n: wp.vec3,
    x: wp.array(dtype=wp.vec3),
    remainder: wp.array(dtype=wp.vec3),
    x_start: wp.array(dtype=wp.vec3),
) -> wp.vec3:
    """u = (I - n n^T) sum_i lam_i (x_i - x_start_i) [m], of x with its remainder."""
    u = wp.vec3()
    for k in range(4):
        u += w[k] * ((x[v[k]] - x_start[v[k]]) + remainder[v[k]])
    return u - wp.dot(u, n) * n


@wp.func
def f1(y: float, e: float) -> float:
    """Share of the Coulomb force at slip y [-]."""
    if y >= e:
        return 1.0
    return (2.0 - y / e) * y / e


@wp.func
def force_before(
    v: wp.vec4i, w: wp.vec4, n: wp.vec3, gap: wp.vec3, x: wp.array(dtype=wp.vec3), x_before: wp.array(dtype=wp.vec3)
) -> float:
    """Contact force at x_before over that at x [-]."""
    g = gap[0]
    for k in range(4):
        g += w[k] * wp.dot(n, x_before[v[k]] - x[v[k]])
    return barrier_gradient(g, gap[1], gap[2]) / barrier_gradient(gap[0], gap[1], gap[2])


@wp.kernel
def prepare_kernel(
    counters: wp.array(dtype=wp.int32),
    ids: wp.array(dtype=wp.vec4i),
    lam: wp.array(dtype=wp.vec4),
    normal: wp.array(dtype=wp.vec3),
    slope: wp.array(dtype=wp.float32),
    gap: wp.array(dtype=wp.vec3),
    cloth_count: int,
    mu_body: float,
    mu_self: float,
    static_slip: float,
    iterating: int,
    x: wp.array(dtype=wp.vec3),
    x_before: wp.array(dtype=wp.vec3),
    remainder: wp.array(dtype=wp.vec3),
    x_start: wp.array(dtype=wp.vec3),
    weight_out: wp.array(dtype=wp.float32),
    along_out: wp.array(dtype=wp.vec4),
):
    """weight = mu N f1(|u|)/|u| [N/m]; along = (t, what the stiffness along t has beyond it [N/m])."""
    c = wp.tid()
    if c >= counters[0]:
        return
    v = ids[c]
    u = slip(v, lam[c], normal[c], x, remainder, x_start)
    y = wp.length(u)
    mu = mu_self
    for k in range(4):
        if v[k] >= cloth_count:
            mu = mu_body
    coulomb = -mu * slope[c]
    settled = bool(False)
    if iterating == 1:
        ratio = force_before(v, lam[c], normal[c], gap[c], x, x_before)
        coulomb *= wp.min(ratio, 1.0)
        settled = ratio > SETTLED and ratio * SETTLED < 1.0
    weight = coulomb / wp.max(y, static_slip)
    if y < static_slip:
        weight = coulomb * (2.0 - y / static_slip) / static_slip
    weight_out[c] = weight
    along_out[c] = wp.vec4()
    if not settled or y == 0.0:
        return
    stiffness = 2.0 * coulomb * wp.max(1.0 - y / static_slip, 0.0) / static_slip
    before = slip(v, lam[c], normal[c], x_before, remainder, x_start)
    y_before = wp.length(before)
    turned = wp.dot(u, before) < 0.0
    if not turned and y > static_slip and y < y_before:
        return
    if turned:
        stiffness = coulomb * (f1(y, static_slip) + f1(y_before, static_slip)) / (y + y_before)
    t = u / y
    along_out[c] = wp.vec4(t[0], t[1], t[2], stiffness - weight)


@wp.func
def resistance(weight: float, along: wp.vec4, n: wp.vec3, u: wp.vec3) -> wp.vec3:
    """The pair's tangential matrix times u [N]."""
    t = wp.vec3(along[0], along[1], along[2])
    return weight * (u - wp.dot(u, n) * n) + (along[3] * wp.dot(t, u)) * t


@wp.kernel
def add_gradient_kernel(
    counters: wp.array(dtype=wp.int32),
    ids: wp.array(dtype=wp.vec4i),
    lam: wp.array(dtype=wp.vec4),
    normal: wp.array(dtype=wp.vec3),
    weight: wp.array(dtype=wp.float32),
    x: wp.array(dtype=wp.vec3),
    remainder: wp.array(dtype=wp.vec3),
    x_start: wp.array(dtype=wp.vec3),
    gradient_out: wp.array(dtype=wp.vec3),
):
    c = wp.tid()
    if c >= counters[0]:
        return
    v = ids[c]
    w = lam[c]
    f = weight[c] * slip(v, w, normal[c], x, remainder, x_start)
    for k in range(4):
        wp.atomic_add(gradient_out, v[k], w[k] * f)


@wp.kernel
def add_product_kernel(
    counters: wp.array(dtype=wp.int32),
    ids: wp.array(dtype=wp.vec4i),
    lam: wp.array(dtype=wp.vec4),
    normal: wp.array(dtype=wp.vec3),
    weight: wp.array(dtype=wp.float32),
    along: wp.array(dtype=wp.vec4),
    p: wp.array(dtype=wp.vec3),
    product_out: wp.array(dtype=wp.vec3),
):
    c = wp.tid()
    if c >= counters[0]:
        return
    v = ids[c]
    w = lam[c]
    u = wp.vec3()
    for k in range(4):
        u += w[k] * p[v[k]]
    f = resistance(weight[c], along[c], normal[c], u)
    for k in range(4):
        wp.atomic_add(product_out, v[k], w[k] * f)


@wp.kernel
def add_diagonal_kernel(
    counters: wp.array(dtype=wp.int32),
    ids: wp.array(dtype=wp.vec4i),
    lam: wp.array(dtype=wp.vec4),
    normal: wp.array(dtype=wp.vec3),
    weight: wp.array(dtype=wp.float32),
    along: wp.array(dtype=wp.vec4),
    blocks_out: wp.array(dtype=wp.mat33),
):
    c = wp.tid()
    if c >= counters[0]:
        return
    n = normal[c]
    t = wp.vec3(along[c][0], along[c][1], along[c][2])
    tangential = weight[c] * (wp.identity(n=3, dtype=wp.float32) - wp.outer(n, n)) + along[c][3] * wp.outer(t, t)
    for k in range(4):
        if lam[c][k] != 0.0:
            wp.atomic_add(blocks_out, ids[c][k], lam[c][k] * lam[c][k] * tangential)


@dataclass
class FrictionWeights:
    """Per contact pair `weight` float32 N/m and `along` vec4, see prepare_kernel; grows with the pairs."""

    weight: wp.array
    along: wp.array

    @staticmethod
    def allocate(capacity: int, device: str) -> FrictionWeights:
        return FrictionWeights(
            wp.zeros(capacity, dtype=wp.float32, device=device), wp.zeros(capacity, dtype=wp.vec4, device=device)
        )


def bind(spec: Friction, context: BuildContext) -> Contribution | None:
    """None when the fabric is frictionless everywhere."""
    fabric, device = context.scene.fabric, context.device
    if fabric.mu_body == 0 and fabric.mu_self == 0:
        return None
    cloth_count = context.scene.garment.vertex_count
    held = FrictionWeights.allocate(1024, device)

    def prepare(pairs: ContactPairs, state: State, x: wp.array, x_before: wp.array | None, dt: float) -> None:
        if len(held.weight) < pairs.capacity:
            held.__dict__.update(FrictionWeights.allocate(pairs.capacity, device).__dict__)
        wp.launch(
            prepare_kernel,
            pairs.size,
            [
                pairs.counters,
                pairs.ids,
                pairs.lam,
                pairs.normal,
                pairs.slope,
                pairs.gap,
                cloth_count,
                fabric.mu_body,
                fabric.mu_self,
                spec.eps_v * dt,
                int(x_before is not None),
                x,
                x if x_before is None else x_before,
                state.remainder,
                state.x_start,
            ],
            [held.weight, held.along],
            device=device,
        )

    def add_gradient(pairs: ContactPairs, state: State, x: wp.array, gradient: wp.array) -> None:
        wp.launch(
            add_gradient_kernel,
            pairs.size,
            [pairs.counters, pairs.ids, pairs.lam, pairs.normal, held.weight, x, state.remainder, state.x_start],
            [gradient],
            device=device,
        )

    def add_product(pairs: ContactPairs, p: wp.array, product: wp.array) -> None:
        wp.launch(
            add_product_kernel,
            pairs.size,
            [pairs.counters, pairs.ids, pairs.lam, pairs.normal, held.weight, held.along, p],
            [product],
            device=device,
        )

    def add_diagonal(pairs: ContactPairs, blocks: wp.array) -> None:
        wp.launch(
            add_diagonal_kernel,
            pairs.size,
            [pairs.counters, pairs.ids, pairs.lam, pairs.normal, held.weight, held.along],
            [blocks],
            device=device,
        )

    def tangential(pairs: ContactPairs) -> np.ndarray:
        return held.weight.numpy()[: pairs.size].astype(np.float64)

    term = ContactTerm(prepare, add_gradient, add_product, add_diagonal, tangential)
    return Contribution("friction", contact=term)
