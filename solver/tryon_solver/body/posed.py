"""A body in its pose on the device, and what a step does with it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import warp as wp

from tryon_solver.body import felt, held_surface
from tryon_solver.body.carry import Carry

if TYPE_CHECKING:
    from tryon_solver.body.on_device import MovingBody, WornBody
    from tryon_solver.settings import Settings
    from tryon_solver.state import State


@dataclass
class PosedBody:
    """The body on the device, its carry field, the tracked skin before and after a sub-step (B,) vec3 m, its stance;
    `reached`: the stance it was moved to last, with its transforms (J, 4, 4) m; `felt` (A,) vec3 m/s: see
    stepping/leap.py."""

    moving: MovingBody
    carry: Carry
    skin_now: wp.array
    skin_next: wp.array
    pose: Any
    reached: tuple[Any, np.ndarray]
    felt: wp.array

    @staticmethod
    def build(body: WornBody, cloth_count: int, pose: Any, device: str) -> PosedBody:
        """Allocate for a scene's body in this stance, beside a cloth of so many vertices."""
        moving = body.on_device(device)
        count = len(body.rest_vertices)
        skin_now = wp.zeros(count, dtype=wp.vec3, device=device)
        reached = pose, moving.transforms(pose)
        moving.take(reached[1], pose)
        moving.write(skin_now)
        carry = Carry.build(cloth_count, body.skin_joints, body.skin_weights, body.joint_count, device)
        felt_of_it = wp.zeros(cloth_count + count, dtype=wp.vec3, device=device)
        return PosedBody(moving, carry, skin_now, wp.clone(skin_now), pose, reached, felt_of_it)

    def stand(self, pose: Any) -> None:
        """Be in this stance, with the skin that it has; nothing is carried there."""
        self.pose, self.reached = pose, (pose, self.moving.transforms(pose))
        self.moving.take(self.reached[1], pose)
        self.moving.write(self.skin_now)

    def transforms(self) -> np.ndarray:
        """(J, 4, 4) float64 m, world from rest, at its pose: those it was moved to last, as a rule."""
        stance, transforms = self.reached
        return transforms if stance is self.pose else self.moving.transforms(self.pose)

    def feel(self, hardest_kick: float, state: State, carried: wp.array) -> None:
        """Let the step start where who the body has `carried` (A,) m feels no change of that motion beyond
        `hardest_kick`."""
        felt.feel(hardest_kick, state.dt, carried, self.felt, state.x_start)

    def join(self, state: State) -> None:
        """Let the step start where the body has carried everybody to, with the velocity with which it did."""
        felt.join(state.dt, state.x, state.x_start, self.felt)

    def go_along(self, v: wp.array) -> None:
        """Give the cloth's velocities `v` (N,) m/s what is felt of the body's."""
        felt.go_along(self.felt, v)

    def limit_return(self, settings: Settings, state: State) -> None:
        """Where the collision surface is drawn in the coming step, and how firmly."""
        give = settings.return_speed, state.dt, settings.skin_hold, settings.skin_firmness
        held_surface.limit_return(*give, state.x, self.skin_now, state.skin, state.hold)

    def add_gradient(
        self, settings: Settings, state: State, x: wp.array, gradient_out: wp.array, diagonal_out: wp.array
    ) -> None:
        """The collision surface's part of the gradient (A,) N at x (A,) m, and of the diagonal (A,) N/m."""
        stiffness = settings.skin_stiffness
        held_surface.add_gradient(stiffness, state.hold, x, state.skin, gradient_out, diagonal_out)
