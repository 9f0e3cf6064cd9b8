"""The solver's device functions, called on arrays: one stencil or one gap per entry."""

from __future__ import annotations

import numpy as np
import warp as wp

from tryon_solver.contact.barrier import barrier, barrier_curvature, barrier_gradient, mollifier
from tryon_solver.contact.ccd import time_of_impact
from tryon_solver.contact.distances import stencil_vector, stencil_weights
from tryon_solver.contact.nearest import Fans, share_of_stencil
from tryon_solver.contact.verify import edge_edge_sq, point_triangle_sq

wp.config.quiet = True
wp.set_module_options({"enable_backward": False})


@wp.kernel
def distance_kernel(
    kind: int,
    x: wp.array2d(dtype=wp.vec3),
    lam_out: wp.array(dtype=wp.vec4),
    d_out: wp.array(dtype=wp.float32),
):
    i = wp.tid()
    lam = stencil_weights(kind, x[i, 0], x[i, 1], x[i, 2], x[i, 3])
    lam_out[i] = lam
    d_out[i] = wp.length(stencil_vector(lam, x[i, 0], x[i, 1], x[i, 2], x[i, 3]))


@wp.kernel
def exact_distance_kernel(kind: int, x: wp.array2d(dtype=wp.vec3d), d_out: wp.array(dtype=wp.float64)):
    i = wp.tid()
    if kind == 0:
        d_out[i] = wp.sqrt(point_triangle_sq(x[i, 0], x[i, 1], x[i, 2], x[i, 3]))
    else:
        d_out[i] = wp.sqrt(edge_edge_sq(x[i, 0], x[i, 1], x[i, 2], x[i, 3]))


@wp.kernel
def barrier_kernel(g: wp.array(dtype=wp.float32), g_hat: float, floor: float, out: wp.array(dtype=wp.vec3)):
    i = wp.tid()
    out[i] = wp.vec3(
        barrier(g[i], g_hat, floor), barrier_gradient(g[i], g_hat, floor), barrier_curvature(g[i], g_hat, floor)
    )


@wp.kernel
def mollifier_kernel(c: wp.array(dtype=wp.float32), eps: float, out: wp.array(dtype=wp.float32)):
    i = wp.tid()
    out[i] = mollifier(c[i], eps)


@wp.kernel
def impact_kernel(
    kind: int,
    floor: wp.array(dtype=wp.float32),
    x: wp.array2d(dtype=wp.vec3),
    p: wp.array2d(dtype=wp.vec3),
    t_out: wp.array(dtype=wp.float32),
):
    i = wp.tid()
    t_out[i] = time_of_impact(
        kind, floor[i], x[i, 0], x[i, 1], x[i, 2], x[i, 3], p[i, 0], p[i, 1], p[i, 2], p[i, 3]
    )


@wp.kernel
def share_kernel(
    kinds: wp.array(dtype=wp.int32),
    ids: wp.array(dtype=wp.vec4i),
    x: wp.array(dtype=wp.vec3),
    starts: wp.array(dtype=wp.int32),
    corners: wp.array(dtype=wp.vec2i),
    out: wp.array(dtype=wp.float32),
):
    i = wp.tid()
    v = ids[i]
    lam = stencil_weights(kinds[i], x[v[0]], x[v[1]], x[v[2]], x[v[3]])
    away = stencil_vector(lam, x[v[0]], x[v[1]], x[v[2]], x[v[3]])
    out[i] = share_of_stencil(kinds[i], v, lam, away, x, starts, corners)


def _vectors(values: np.ndarray) -> wp.array:
    return wp.array(np.ascontiguousarray(values, np.float32), dtype=wp.vec3, device="cpu")


def solver_distances(kind: int, stencils: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance (S,) and weights (S, 4) of stencils (S, 4, 3) in the solver's float32."""
    count = len(stencils)
    lam = wp.full(count, wp.vec4(np.nan, np.nan, np.nan, np.nan), dtype=wp.vec4, device="cpu")
    d = wp.full(count, np.nan, dtype=wp.float32, device="cpu")
    wp.launch(distance_kernel, count, [kind, _vectors(stencils)], [lam, d], device="cpu")
    return d.numpy().astype(np.float64), lam.numpy().astype(np.float64)


def verifier_distances(kind: int, stencils: np.ndarray) -> np.ndarray:
    """Distance (S,) of stencils (S, 4, 3) in the float64 of the commit's verification."""
    x = wp.array(np.ascontiguousarray(stencils, np.float64), dtype=wp.vec3d, device="cpu")
    d = wp.full(len(stencils), np.nan, dtype=wp.float64, device="cpu")
    wp.launch(exact_distance_kernel, len(stencils), [kind, x], [d], device="cpu")
    return d.numpy()


def solver_barrier(g: np.ndarray, g_hat: float, floor: float = 0.0) -> np.ndarray:
    """(G, 3): b, b', b'' at gaps g (G,)."""
    out = wp.full(len(g), wp.vec3(np.nan, np.nan, np.nan), dtype=wp.vec3, device="cpu")
    gaps = wp.array(g, dtype=wp.float32, device="cpu")
    wp.launch(barrier_kernel, len(g), [gaps, g_hat, floor], [out], device="cpu")
    return out.numpy().astype(np.float64)


def solver_mollifier(c: np.ndarray, eps: float) -> np.ndarray:
    """(C,) e(c)."""
    out = wp.full(len(c), np.nan, dtype=wp.float32, device="cpu")
    wp.launch(mollifier_kernel, len(c), [wp.array(c, dtype=wp.float32, device="cpu"), eps], [out], device="cpu")
    return out.numpy().astype(np.float64)


def solver_impact(kind: int, floor: np.ndarray, x: np.ndarray, p: np.ndarray) -> np.ndarray:
    """(S,) fraction of the displacements p (S, 4, 3) that is proven to keep the distance at or above `floor` (S,)."""
    t = wp.full(len(x), np.nan, dtype=wp.float32, device="cpu")
    floors = wp.array(floor, dtype=wp.float32, device="cpu")
    wp.launch(impact_kernel, len(x), [kind, floors, _vectors(x), _vectors(p)], [t], device="cpu")
    return t.numpy().astype(np.float64)


def solver_shares(faces: np.ndarray, kinds: np.ndarray, ids: np.ndarray, x: np.ndarray) -> np.ndarray:
    """(S,) how much stencils (S,), (S, 4) count on triangles (F, 3) with corners at x (A, 3) m."""
    fans = Fans.of(faces, len(x), "cpu")
    out = wp.full(len(kinds), np.nan, dtype=wp.float32, device="cpu")
    kinds_in = wp.array(kinds.astype(np.int32), dtype=wp.int32, device="cpu")
    ids_in = wp.array(ids.astype(np.int32), dtype=wp.vec4i, device="cpu")
    inputs = [kinds_in, ids_in, _vectors(x), fans.starts, fans.corners]
    wp.launch(share_kernel, len(kinds), inputs, [out], device="cpu")
    return out.numpy().astype(np.float64)
