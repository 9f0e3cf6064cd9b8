"""The collision surface, held to the tracked skin by a spring that yields: what presses on it draws it away, and it
returns no faster than it is let."""

from __future__ import annotations

import warp as wp

from tryon_solver.linalg.launch import launch

wp.set_module_options({"enable_backward": False})


@wp.kernel
def limit_return_kernel(
    cloth_count: int,
    speed: float,
    dt: wp.array(dtype=wp.float32),
    hold: float,
    firmness: float,
    x: wp.array(dtype=wp.vec3),
    skin: wp.array(dtype=wp.vec3),
    target_out: wp.array(dtype=wp.vec3),
    hold_out: wp.array(dtype=wp.float32),
):
    j = wp.tid()
    lag = skin[j] - x[cloth_count + j]
    size = wp.length(lag)
    longest = speed * dt[0]
    hold_out[j] = hold + firmness * size
    if size > longest:
        lag = (longest / size) * lag
    target_out[j] = x[cloth_count + j] + lag


@wp.kernel
def skin_kernel(
    cloth_count: int,
    stiffness: float,
    hold: wp.array(dtype=wp.float32),
    x: wp.array(dtype=wp.vec3),
    skin: wp.array(dtype=wp.vec3),
    gradient_out: wp.array(dtype=wp.vec3),
    diagonal_out: wp.array(dtype=wp.float32),
):
    """k r/sqrt(1 + |r|^2/e^2), r = c - s, e = hold/k; the diagonal is the secant stiffness, an upper bound."""
    j = wp.tid()
    r = x[cloth_count + j] - skin[j]
    give = stiffness / hold[j]
    secant = stiffness / wp.sqrt(1.0 + give * give * wp.length_sq(r))
    gradient_out[cloth_count + j] = secant * r
    diagonal_out[cloth_count + j] = secant


def limit_return(
    speed: float,
    dt: wp.array,
    hold: float,
    firmness: float,
    x: wp.array,
    skin: wp.array,
    target_out: wp.array,
    hold_out: wp.array,
) -> None:
    """Where the surface, the last of x (A,) m, is drawn in a step of `dt` (1,) s: to the `skin` (B,) m at no more than
    `speed` m/s; and how firmly at most, `hold` N and `firmness` N/m of how far it is behind."""
    count = len(skin)
    inputs = [len(x) - count, speed, dt, hold, firmness, x, skin]
    launch(limit_return_kernel, count, inputs, [target_out, hold_out], device=x.device)


def add_gradient(
    stiffness: float, hold: wp.array, x: wp.array, skin: wp.array, gradient_out: wp.array, diagonal_out: wp.array
) -> None:
    """The surface's part of the gradient (A,) N and of the diagonal (A,) N/m at x (A,) m: `stiffness` N/m, at most
    `hold` (B,) N, towards where it is drawn, `skin` (B,) m."""
    count = len(skin)
    inputs = [len(x) - count, stiffness, hold, x, skin]
    launch(skin_kernel, count, inputs, [gradient_out, diagonal_out], device=x.device)
