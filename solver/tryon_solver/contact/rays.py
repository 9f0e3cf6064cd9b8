"""Rays from points into triangles: how far to the first one and to the last one within a length."""

from __future__ import annotations

import numpy as np
import warp as wp

from tryon_solver.linalg.launch import launch

wp.set_module_options({"enable_backward": False})

MOST_HITS = 32  # of one ray
PAST = 1e-5  # m, a hit is left behind by this much before the next is looked for


@wp.kernel
def ray_kernel(
    mesh: wp.uint64,
    start: wp.array(dtype=wp.vec3),
    direction: wp.array(dtype=wp.vec3),
    longest: wp.array(dtype=wp.float32),
    most: int,
    past: float,
    first_out: wp.array(dtype=wp.float32),
    last_out: wp.array(dtype=wp.float32),
):
    i = wp.tid()
    gone = float(0.0)
    first = float(-1.0)
    last = float(-1.0)
    for _k in range(most):
        if gone < longest[i]:
            hit = wp.mesh_query_ray(mesh, start[i] + gone * direction[i], direction[i], longest[i] - gone)
            if hit.result:
                gone = gone + hit.t
                if first < 0.0:
                    first = gone
                last = gone
                gone = gone + past
            else:
                gone = longest[i]
    first_out[i] = first
    last_out[i] = last


def first_and_last_hit(
    vertices: np.ndarray,
    faces: np.ndarray,
    start: np.ndarray,
    direction: np.ndarray,
    longest: np.ndarray,
    device: str,
) -> tuple[np.ndarray, np.ndarray]:
    """Distances (K,) m along each ray to its first and its last hit within `longest` (K,) m; -1 where it has none.

    `vertices` (V, 3) m and `faces` (F, 3) are what is hit; rays go from `start` (K, 3) m along unit `direction` (K, 3).
    """
    points: wp.array = wp.array(vertices.astype(np.float32), dtype=wp.vec3, device=device)
    indices: wp.array = wp.array(faces.astype(np.int32).ravel(), dtype=wp.int32, device=device)
    mesh = wp.Mesh(points, indices)
    first = wp.zeros(len(start), dtype=wp.float32, device=device)
    last = wp.zeros(len(start), dtype=wp.float32, device=device)
    launch(
        ray_kernel,
        len(start),
        [
            mesh.id,
            wp.array(start.astype(np.float32), dtype=wp.vec3, device=device),
            wp.array(direction.astype(np.float32), dtype=wp.vec3, device=device),
            wp.array(longest.astype(np.float32), dtype=wp.float32, device=device),
            MOST_HITS,
            PAST,
        ],
        [first, last],
        device=device,
    )
    return first.numpy(), last.numpy()
