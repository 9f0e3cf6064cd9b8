"""The contact barrier.

With g = d - xi the gap above the thickness offset and g_hat the activation distance,

    b(g) = -(g - g_hat)^2 ln(g / g_hat)      for 0 < g < g_hat, else 0          [m^2]
    b'(g) = -2 (g - g_hat) ln(g/g_hat) - (g - g_hat)^2 / g                        [m], <= 0
    b''(g) = -2 ln(g/g_hat) - 4 (g - g_hat)/g + (g - g_hat)^2 / g^2               [-], >= 0

The potential of a pair is kappa b(g), kappa in N/m. Below a small `floor` it is the second-order expansion about it,
for g at or under zero too: rounding can put a pair there, and its force must go on growing, or a load that is larger
than the force at the floor has no balance. Sources: Li et al. 2020 (IPC), equation 6; thickness offset after Li et
al. 2021 (Codimensional IPC), section 4; the expansion is ours.

"""
from __future__ import annotations

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.func
def barrier(g: float, g_hat: float, floor: float) -> float:
    """b(g) [m^2]."""
    if g >= g_hat:
        return 0.0
    at = wp.max(g, floor)
    below = g - at
    b = -(at - g_hat) * (at - g_hat) * wp.log(at / g_hat)
    return b + (gradient_of_log(at, g_hat) + 0.5 * curvature_of_log(at, g_hat) * below) * below


@wp.func
def barrier_gradient(g: float, g_hat: float, floor: float) -> float:
    """b'(g) [m]."""
    if g >= g_hat:
        return 0.0
    at = wp.max(g, floor)
    return gradient_of_log(at, g_hat) + curvature_of_log(at, g_hat) * (g - at)


@wp.func
def barrier_curvature(g: float, g_hat: float, floor: float) -> float:
    """b''(g) [-]."""
    if g >= g_hat:
        return 0.0
    return curvature_of_log(wp.max(g, floor), g_hat)


@wp.func
def gradient_of_log(g: float, g_hat: float) -> float:
    """b'(g) [m] for 0 < g < g_hat."""
    reach = g - g_hat
    return -2.0 * reach * wp.log(g / g_hat) - reach * reach / g


@wp.func
def curvature_of_log(g: float, g_hat: float) -> float:
    """b''(g) [-] for 0 < g < g_hat."""
    ratio = (g - g_hat) / g
    return -2.0 * wp.log(g / g_hat) - 4.0 * ratio + ratio * ratio


@wp.func
def mollifier(c: float, eps: float) -> float:
    """e(c) = (2 - c/eps) c/eps below eps, else 1: fades the barrier of nearly parallel edges, c = |ea x eb|^2.

    Source: Li et al. 2020, equation 24.
    """
    if c >= eps:
        return 1.0
    return (2.0 - c / eps) * c / eps
