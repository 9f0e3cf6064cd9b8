"""A dense dyad c w w^T beside a sparse matrix A: its solutions from those of A (Sherman and Morrison 1950).

    (A + c w w^T)^-1 b = y + c (w.y)/(1 - c w.z) z,   A y = b,   A z = -w

With A positive definite w.z is below 0, so nothing is divided by less than 1. Where conjugate gradients are cut short y
and z are near their solutions only, and what is found still has less of w than y had. What they leave, r of b - A y and
s of -w - A z, is left of b - (A + c w w^T) p as r + c (w.y)/(1 - c w.z) s.
"""

from __future__ import annotations

from collections.abc import Callable

import warp as wp

from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.vectors import PARTS, dot

wp.set_module_options({"enable_backward": False})

LEAST_ALIKE = wp.constant(0.1)  # share of a move below which nothing is shortened alike


@wp.kernel
def amend_kernel(
    stiffness: wp.array(dtype=wp.float32),
    along: wp.array(dtype=wp.float32),
    given: wp.array(dtype=wp.float32),
    response: wp.array(dtype=wp.vec3),
    left: wp.array(dtype=wp.vec3),
    solution: wp.array(dtype=wp.vec3),
    residual: wp.array(dtype=wp.vec3),
    gain_out: wp.array(dtype=wp.float32),
):
    """y += c (w.y)/(1 - c w.z) z, r likewise by s, and c times what w.y has become"""
    i = wp.tid()
    c = stiffness[0]
    share = c * along[0] / (1.0 - c * given[0])
    solution[i] = solution[i] + share * response[i]
    residual[i] = residual[i] + share * left[i]
    if i == 0:
        gain_out[0] = share


@wp.kernel
def restore_kernel(
    noted: wp.array(dtype=wp.float32),
    along: wp.array(dtype=wp.float32),
    given: wp.array(dtype=wp.float32),
    response: wp.array(dtype=wp.vec3),
    direction: wp.array(dtype=wp.vec3),
):
    """d += (w.d as noted - w.d)/(w.z) z"""
    i = wp.tid()
    if given[0] < 0.0:
        direction[i] = direction[i] + (noted[0] - along[0]) / given[0] * response[i]


@wp.kernel
def least_kernel(
    vector: wp.array(dtype=wp.vec3),
    allowed: wp.array(dtype=wp.float32),
    shares: wp.array(dtype=wp.float32),
    least: wp.array(dtype=wp.float32),
):
    i = wp.tid()
    if wp.length_sq(vector[i]) > 0.0 and allowed[i] > 0.0:
        wp.atomic_min(least, 0, shares[i] / allowed[i])


@wp.kernel
def level_kernel(
    allowed: wp.array(dtype=wp.float32),
    least: wp.array(dtype=wp.float32),
    shares: wp.array(dtype=wp.float32),
):
    i = wp.tid()
    if least[0] > LEAST_ALIKE:
        shares[i] = wp.min(shares[i], least[0] * allowed[i])


class Dyad:
    """`vector` w (A,) vec3 and `stiffness` c (1,) float32, whose owner writes both; `gain` (1,) float32 is c w.p of the
    solution p that was amended last."""

    def __init__(self, count: int, device: str) -> None:
        self.vector: wp.array = wp.zeros(count, dtype=wp.vec3, device=device)
        self.stiffness: wp.array = wp.zeros(1, dtype=wp.float32, device=device)
        self.gain: wp.array = wp.zeros(1, dtype=wp.float32, device=device)
        self._response: wp.array = wp.zeros(count, dtype=wp.vec3, device=device)
        self._left: wp.array = wp.zeros(count, dtype=wp.vec3, device=device)
        self._least: wp.array = wp.zeros(1, dtype=wp.float32, device=device)
        self._noted: wp.array = wp.zeros(1, dtype=wp.float32, device=device)
        self._along: wp.array = wp.zeros(1, dtype=wp.float32, device=device)
        self._given: wp.array = wp.zeros(1, dtype=wp.float32, device=device)
        self._parts: wp.array = wp.zeros(PARTS, dtype=wp.float32, device=device)

    def respond(self, solve: Callable[[wp.array, wp.array], None], residual: wp.array) -> None:
        """Find z; `solve(b, out)` solves A out = -b and leaves its `residual` (A,) vec3."""
        solve(self.vector, self._response)
        wp.copy(self._left, residual)
        dot(self.vector, self._response, self._given, self._parts)

    def amend(self, solution: wp.array, residual: wp.array) -> None:
        """Of a solution (A,) with A and what it leaves make those with the dyad, after `respond`."""
        dot(self.vector, solution, self._along, self._parts)
        inputs = [self.stiffness, self._along, self._given, self._response, self._left]
        launch(amend_kernel, len(solution), inputs, [solution, residual, self.gain], device=solution.device)

    def note(self, direction: wp.array) -> None:
        """Keep w.d of a direction d (A,)."""
        dot(self.vector, direction, self._noted, self._parts)

    def restore(self, direction: wp.array) -> None:
        """Make w.d what was noted, along z, where `respond` has found one: what is so stiff has no use for less."""
        dot(self.vector, direction, self._along, self._parts)
        inputs = [self._noted, self._along, self._given, self._response]
        launch(restore_kernel, len(direction), inputs, [direction], device=direction.device)

    def level(self, shares: wp.array, allowed: wp.array) -> None:
        """Of a direction whose shares (A,) were `allowed` (A,) and have been lowered since, lower all to that part of
        what was allowed to which the most lowered one of those where w is not zero was: w.d of a part of d is not that
        part of w.d. All, since what lies around would otherwise be in the way, or go on through it. Not where that is
        LEAST_ALIKE or less: one vertex that can't move would have everything stand still."""
        count, device = len(shares), shares.device
        self._least.fill_(1.0)
        launch(least_kernel, count, [self.vector, allowed, shares], [self._least], device=device)
        launch(level_kernel, count, [allowed, self._least], [shares], device=device)
