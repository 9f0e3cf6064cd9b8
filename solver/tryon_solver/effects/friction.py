"""Coulomb friction with smoothed static regime, on every contact pair.

For a pair with normal force N = -e kappa b' and tangential slip u = (I - n n^T) sum_i lam_i (x_i - x_start_i), which
includes the body's own motion, the force on vertex i is

    -lam_i mu N f1(|u|) u/|u|,   f1(y) = (2 - y/e) y/e for y < e, else 1,   e = eps_v dt.

Lagged per iteration: N, n and f1(|u|)/|u|. Source: Li et al. 2020 (IPC), section 5. The matrix used is
mu N f1/|u| (I - n n^T), positive semidefinite; its dropped part only softens it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from tryon_solver.contact.pairs import ContactPairs
from tryon_solver.effects.base import BuildContext
from tryon_solver.plan import ContactTerm, Contribution
from tryon_solver.scene import Friction

wp.set_module_options({"enable_backward": False})


@wp.func
def slip(v: wp.vec4i, w: wp.vec4, n: wp.vec3, x: wp.array(dtype=wp.vec3), x_start: wp.array(dtype=wp.vec3)) -> wp.vec3:
    """u = (I - n n^T) sum_i lam_i (x_i - x_start_i) [m]."""
    u = wp.vec3()
    for k in range(4):
        u += w[k] * (x[v[k]] - x_start[v[k]])
    return u - wp.dot(u, n) * n


@wp.kernel
def prepare_kernel(
    ids: wp.array(dtype=wp.vec4i),
    lam: wp.array(dtype=wp.vec4),
    normal: wp.array(dtype=wp.vec3),
    slope: wp.array(dtype=wp.float32),
    cloth_count: int,
    mu_body: float,
    mu_self: float,
    static_slip: float,
    x: wp.array(dtype=wp.vec3),
    x_start: wp.array(dtype=wp.vec3),
    weight_out: wp.array(dtype=wp.float32),
):
    """weight = mu N f1(|u|)/|u| [N/m]."""
    c = wp.tid()
    v = ids[c]
    y = wp.length(slip(v, lam[c], normal[c], x, x_start))
    mu = mu_self
    for k in range(4):
        if v[k] >= cloth_count:
            mu = mu_body
    if y < static_slip:
        weight_out[c] = -mu * slope[c] * (2.0 - y / static_slip) / static_slip
    else:
        weight_out[c] = -mu * slope[c] / y


@wp.kernel
def add_gradient_kernel(
    ids: wp.array(dtype=wp.vec4i),
    lam: wp.array(dtype=wp.vec4),
    normal: wp.array(dtype=wp.vec3),
    weight: wp.array(dtype=wp.float32),
    x: wp.array(dtype=wp.vec3),
    x_start: wp.array(dtype=wp.vec3),
    gradient_out: wp.array(dtype=wp.vec3),
):
    c = wp.tid()
    v = ids[c]
    w = lam[c]
    f = weight[c] * slip(v, w, normal[c], x, x_start)
    for k in range(4):
        wp.atomic_add(gradient_out, v[k], w[k] * f)


@wp.kernel
def add_product_kernel(
    ids: wp.array(dtype=wp.vec4i),
    lam: wp.array(dtype=wp.vec4),
    normal: wp.array(dtype=wp.vec3),
    weight: wp.array(dtype=wp.float32),
    p: wp.array(dtype=wp.vec3),
    product_out: wp.array(dtype=wp.vec3),
):
    c = wp.tid()
    v = ids[c]
    w = lam[c]
    n = normal[c]
    u = wp.vec3()
    for k in range(4):
        u += w[k] * p[v[k]]
    f = weight[c] * (u - wp.dot(u, n) * n)
    for k in range(4):
        wp.atomic_add(product_out, v[k], w[k] * f)


@wp.kernel
def add_diagonal_kernel(
    ids: wp.array(dtype=wp.vec4i),
    lam: wp.array(dtype=wp.vec4),
    normal: wp.array(dtype=wp.vec3),
    weight: wp.array(dtype=wp.float32),
    blocks_out: wp.array(dtype=wp.mat33),
):
    c = wp.tid()
    n = normal[c]
    tangential = weight[c] * (wp.identity(n=3, dtype=wp.float32) - wp.outer(n, n))
    for k in range(4):
        if lam[c][k] != 0.0:
            wp.atomic_add(blocks_out, ids[c][k], lam[c][k] * lam[c][k] * tangential)


@dataclass
class FrictionWeights:
    """One weight per contact pair [N/m]; grows with the pairs."""

    weight: wp.array


def bind(spec: Friction, context: BuildContext) -> Contribution | None:
    """None when the fabric is frictionless everywhere."""
    fabric, device = context.scene.fabric, context.device
    if fabric.mu_body == 0 and fabric.mu_self == 0:
        return None
    cloth_count = context.scene.garment.vertex_count
    held = FrictionWeights(wp.zeros(1024, dtype=wp.float32, device=device))

    def prepare(pairs: ContactPairs, x: wp.array, x_start: wp.array, dt: float) -> None:
        if len(held.weight) < pairs.capacity:
            held.weight = wp.zeros(pairs.capacity, dtype=wp.float32, device=device)
        wp.launch(
            prepare_kernel,
            pairs.size,
            [
                pairs.ids,
                pairs.lam,
                pairs.normal,
                pairs.slope,
                cloth_count,
                fabric.mu_body,
                fabric.mu_self,
                spec.eps_v * dt,
                x,
                x_start,
            ],
            [held.weight],
            device=device,
        )

    def add_gradient(pairs: ContactPairs, x: wp.array, x_start: wp.array, gradient: wp.array) -> None:
        wp.launch(
            add_gradient_kernel,
            pairs.size,
            [pairs.ids, pairs.lam, pairs.normal, held.weight, x, x_start],
            [gradient],
            device=device,
        )

    def add_product(pairs: ContactPairs, p: wp.array, product: wp.array) -> None:
        wp.launch(
            add_product_kernel,
            pairs.size,
            [pairs.ids, pairs.lam, pairs.normal, held.weight, p],
            [product],
            device=device,
        )

    def add_diagonal(pairs: ContactPairs, blocks: wp.array) -> None:
        wp.launch(
            add_diagonal_kernel, pairs.size, [pairs.ids, pairs.lam, pairs.normal, held.weight], [blocks], device=device
        )

    def tangential(pairs: ContactPairs) -> np.ndarray:
        return held.weight.numpy()[: pairs.size].astype(np.float64)

    term = ContactTerm(prepare, add_gradient, add_product, add_diagonal, tangential)
    return Contribution("friction", contact=term)
