"""Carrying the cloth along with the body before anything is solved.

At 2 m/s the wrist moves 33 mm between two frames; a barrier that reaches 2 mm cannot push a sleeve that far. So the
cloth is moved by the body's own motion first, through one displacement field in space:

    u(x) = sum_j W_j(x) (A_j x - x),   A_j = joint j's rigid motion over the sub-step,

with W(x) the skinning weights of the skin around x, averaged with weights (1 - d/R)^2 / (d^2 + r^2)^2 and fading to the
root joint's between `carry_full` and `carry_none`. All layers and the skin next to them see the same smooth field, so
it hardly ever brings two of them closer. It changes where the solve starts, not the inertia: that stays in world space.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

wp.set_module_options({"enable_backward": False})

SHARPNESS = 0.01  # m, r above: skin closer than this dominates skin further away
GRID = 64


@dataclass
class Carry:
    """`weights` (N, J) float32 rows sum to one; `motions` (J,) mat44; `near` (B,) int32: skin in reach of the cloth."""

    weights: wp.array
    motions: wp.array
    near: wp.array
    grid: wp.HashGrid
    skin_joints: wp.array
    skin_weights: wp.array

    @staticmethod
    def build(cloth_count: int, skin_joints: np.ndarray, skin_weights: np.ndarray, joints: int, device: str) -> Carry:
        """`skin_joints` (B, K) int32 and `skin_weights` (B, K) float32 as in BodyModel."""
        return Carry(
            wp.zeros((cloth_count, joints), dtype=wp.float32, device=device),
            wp.zeros(joints, dtype=wp.mat44, device=device),
            wp.zeros(len(skin_joints), dtype=wp.int32, device=device),
            wp.HashGrid(GRID, GRID, GRID, device=device),
            wp.array(skin_joints, dtype=wp.int32, device=device),
            wp.array(skin_weights, dtype=wp.float32, device=device),
        )


@wp.kernel
def weights_kernel(
    grid: wp.uint64,
    x: wp.array(dtype=wp.vec3),
    surface: wp.array(dtype=wp.vec3),
    skin_joints: wp.array2d(dtype=wp.int32),
    skin_weights: wp.array2d(dtype=wp.float32),
    full: float,
    none: float,
    sharpness: float,
    weights_out: wp.array2d(dtype=wp.float32),
    near_out: wp.array(dtype=wp.int32),
):
    i = wp.tid()
    here = x[i]
    for j in range(weights_out.shape[1]):
        weights_out[i, j] = 0.0
    query = wp.hash_grid_query(grid, here, none)
    b = int(0)
    total = float(0.0)
    nearest = none
    while wp.hash_grid_query_next(query, b):
        d = wp.length(surface[b] - here)
        if d < none:
            near_out[b] = 1
            nearest = wp.min(nearest, d)
            fade = 1.0 - d / none
            softened = d * d + sharpness * sharpness
            w = fade * fade / (softened * softened)
            total += w
            for k in range(skin_joints.shape[1]):
                weights_out[i, skin_joints[b, k]] = weights_out[i, skin_joints[b, k]] + w * skin_weights[b, k]
    share = float(0.0)
    if total > 0.0:
        t = wp.clamp((none - nearest) / (none - full), 0.0, 1.0)
        share = t * t * (3.0 - 2.0 * t)
        for j in range(weights_out.shape[1]):
            weights_out[i, j] = weights_out[i, j] * share / total
    weights_out[i, 0] = weights_out[i, 0] + 1.0 - share


@wp.kernel
def field_kernel(
    weights: wp.array2d(dtype=wp.float32),
    motions: wp.array(dtype=wp.mat44),
    x: wp.array(dtype=wp.vec3),
    displacement_out: wp.array(dtype=wp.vec3),
):
    """u(x) above for the cloth."""
    i = wp.tid()
    here = x[i]
    u = wp.vec3()
    for j in range(weights.shape[1]):
        w = weights[i, j]
        if w > 0.0:
            u += w * (wp.transform_point(motions[j], here) - here)
    displacement_out[i] = u


@wp.kernel
def rigid_kernel(motion: wp.mat44, x: wp.array(dtype=wp.vec3)):
    """Moves everything by one rigid motion."""
    i = wp.tid()
    x[i] = wp.transform_point(motion, x[i])


@wp.kernel
def surface_kernel(
    cloth_count: int,
    skin_before: wp.array(dtype=wp.vec3),
    skin_after: wp.array(dtype=wp.vec3),
    displacement_out: wp.array(dtype=wp.vec3),
):
    """The collision surface moves as the skin does.

    Where it has yielded it stays so much behind: only the correction knows what presses on it and lets it return.
    """
    j = wp.tid()
    displacement_out[cloth_count + j] = skin_after[j] - skin_before[j]


@wp.kernel
def travel_kernel(
    near: wp.array(dtype=wp.int32),
    skin_before: wp.array(dtype=wp.vec3),
    skin_after: wp.array(dtype=wp.vec3),
    largest_out: wp.array(dtype=wp.float32),
):
    """Largest motion of skin that is in reach of the cloth."""
    j = wp.tid()
    if near[j] != 0:
        wp.atomic_max(largest_out, 0, wp.length(skin_after[j] - skin_before[j]))


def set_weights(carry: Carry, x: wp.array, surface: wp.array, cloth_count: int, full: float, none: float) -> None:
    """Weights of the field from the cloth's and the surface's current positions; lengths in m."""
    device = x.device
    carry.near.zero_()
    carry.grid.build(surface, none / 2)
    wp.launch(
        weights_kernel,
        cloth_count,
        [carry.grid.id, x, surface, carry.skin_joints, carry.skin_weights, full, none, SHARPNESS],
        [carry.weights, carry.near],
        device=device,
    )
