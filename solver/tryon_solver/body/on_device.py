"""What a simulation asks of a body that moves: a posed body (skinning.py) and a sequence of meshes (sequence_kernel.py)
both answer."""

from __future__ import annotations

from typing import Any, Protocol, TypeVar

import numpy as np
import warp as wp

Stance = TypeVar("Stance")
"""A body at an instant: a Pose of a posed body, a Moment of a sequence. Only the body itself looks into it."""


class MovingBody(Protocol[Stance]):
    """A body on a device: its surface at any stance, and rigid parts whose motion the cloth near them is carried along
    with. Part 0 is the body as a whole."""

    def transforms(self, stance: Stance) -> np.ndarray:
        """(J, 4, 4) float64 m: what each part does to points at rest."""

    def take(self, transforms: np.ndarray, stance: Stance) -> None:
        """Be at the stance as of the next `write`, seen from where `transforms` (J, 4, 4) are: those of the
        stance, moved by one rigid motion."""

    def write(self, out: wp.array) -> None:
        """Put the vertices (B,) vec3 m at the stance that was taken into `out`; a launch, for a graph to repeat."""

    def between(self, first: Stance, last: Stance, share: float) -> Stance:
        """The stance at `share` of the way from the first to the last."""

    def part_way(self, first: Stance, last: Stance, share: float) -> Stance:
        """The stance with the shape at `share` of the way, as a whole where the last one is."""

    def place(self, stance: Stance) -> np.ndarray:
        """(3,) m: where the body is as a whole."""

    def moved(self, stance: Stance, by: np.ndarray) -> Stance:
        """The stance elsewhere, `by` (3,) m away."""


class WornBody(Protocol):
    """A body's description on the host, as a scene holds it."""

    @property
    def rest_vertices(self) -> np.ndarray:
        """(B, 3) float64 m"""

    @property
    def faces(self) -> np.ndarray:
        """(F, 3) int32"""

    @property
    def joint_count(self) -> int:
        """J, number of parts"""

    @property
    def skin_joints(self) -> np.ndarray:
        """(B, K) int32, the parts each vertex moves with"""

    @property
    def skin_weights(self) -> np.ndarray:
        """(B, K) float32, how much with each; rows sum to 1"""

    def start(self) -> Any:
        """The stance in which a garment is put on: the rest pose, or a frame: the first if nothing is against it."""

    def surface(self, stance: Any) -> np.ndarray:
        """(B, 3) float64 m: its vertices at the stance."""

    def on_device(self, device: str) -> MovingBody:
        """The body ready to be followed."""
