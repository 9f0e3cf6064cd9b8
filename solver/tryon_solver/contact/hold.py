"""Vertices that contact stops are held in the correction's next directions, so that all others know of it.

A direction is found for the barrier's quadratic model. In a knot, an armpit that closes on a sleeve, it parts every
pair by micrometres and slides the same edges past each other by millimetres, where their normals are others; deflection
turns it aside and the bounds shorten it, vertex by vertex. What is left of it is no direction of descent any more: the
neighbours went where these vertices were expected to come along. Iterated, that drives a knot uphill.

So a vertex that went only the share s of its way, s = m.p/|p|^2 of its direction p and its move m, as far as contact
had a say in that (the region's border, where the candidates end, stops nobody for good), gets where s < FREE_SHARE and
|p| > LEAST_WAY

    lambda = (1/max(s, LEAST_SHARE) - 1) d,   d the mean of its diagonal block's diagonal,

as a stiffness in the next direction's matrix, along what is lacking of its way, p - m; or it keeps its last one's, KEPT
of it, where that is more: Levenberg-Marquardt's damping (Levenberg 1944, Marquardt 1963), of those vertices alone, that
way alone. Held in all directions, cloth that had met what it slides on stood still on it: a barrier's stiffness is a
thousand times what inertia takes it on by. The gradient is untouched, and so is the balance that is found. Ours.
"""

from __future__ import annotations

from dataclasses import dataclass

import warp as wp

from tryon_solver.linalg.launch import launch

wp.set_module_options({"enable_backward": False})

LEAST_SHARE = 0.1  # of its way: what went less is held as firmly as what went this
FREE_SHARE = 0.5  # of its way: what went as much is free
LEAST_WAY = 1.0e-6  # m: who wants to go less far is not stopped, whatever pushes it; such a way's sign is rounding's
KEPT = 0.3  # of a vertex's stiffness from direction to direction


@wp.kernel
def measure_kernel(
    wanted: wp.array(dtype=wp.vec3),
    allowed: wp.array(dtype=wp.float32),
    moved: wp.array(dtype=wp.vec3),
    share_out: wp.array(dtype=wp.float32),
    lacking_out: wp.array(dtype=wp.vec3),
):
    i = wp.tid()
    p = wanted[i]
    share_out[i] = 1.0
    lacking_out[i] = allowed[i] * p - moved[i]
    if allowed[i] > 0.0 and wp.length(p) > LEAST_WAY:
        share_out[i] = wp.dot(moved[i], p) / (allowed[i] * wp.length_sq(p))


@wp.kernel
def add_kernel(
    share: wp.array(dtype=wp.float32),
    lacking: wp.array(dtype=wp.vec3),
    held: wp.array(dtype=wp.vec3),
    blocks: wp.array(dtype=wp.mat33),
):
    i = wp.tid()
    h = wp.sqrt(KEPT) * held[i]
    if share[i] < FREE_SHARE:
        own = wp.trace(blocks[i]) / 3.0
        stiffness = (1.0 / wp.max(share[i], LEAST_SHARE) - 1.0) * own
        if stiffness > wp.length_sq(h):
            h = wp.sqrt(stiffness) * wp.normalize(lacking[i])
    held[i] = h
    blocks[i] = blocks[i] + wp.outer(h, h)


@dataclass(frozen=True)
class Holding:
    """Of A vertices: `allowed` float32, the share of the direction that lies within the region; `share` float32 of that
    that they went, and what is `lacking` vec3 m; `held` vec3 (N/m)^1/2, h of the stiffness h h^T by which they are
    held."""

    held: wp.array
    allowed: wp.array
    share: wp.array
    lacking: wp.array

    @staticmethod
    def over(held: wp.array) -> Holding:
        """Nothing held."""
        count, device = len(held), held.device
        return Holding(
            held,
            wp.full(count, 1.0, dtype=wp.float32, device=device),
            wp.full(count, 1.0, dtype=wp.float32, device=device),
            wp.zeros(count, dtype=wp.vec3, device=device),
        )

    def release(self) -> None:
        """Hold nothing."""
        self.share.fill_(1.0)
        self.held.zero_()

    def measure(self, wanted: wp.array, moved: wp.array) -> None:
        """Take note of what `moved` (A,) m has of the direction that was `wanted` (A,) m."""
        outputs = [self.share, self.lacking]
        launch(measure_kernel, len(moved), [wanted, self.allowed, moved], outputs, device=moved.device)

    def add(self, blocks: wp.array) -> None:
        """Find what vertices are to be `held` by, and add it to the blocks (A,) [N/m]."""
        launch(add_kernel, len(blocks), [self.share, self.lacking], [self.held, blocks], device=blocks.device)
