"""What changes while a scene is simulated. Shapes: N cloth vertices, A = N + B with the body's B vertices behind."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import warp as wp

from tryon_solver.linalg.turning import AsOne
from tryon_solver.linalg.vectors import PARTS


@dataclass
class State:
    """Positions and velocities; every array lives on the device.

    `x` is feasible whenever a verb of step.py returns, except between `solve_without_contact` and
    `correct_penetration`, where it is the trial and `x_feasible` holds the feasible state.
    """

    x: wp.array  # (A,) vec3 m, current positions; x[N:] is the collision surface
    x_committed: wp.array  # (A,) vec3 m, committed positions at the start of the step, before the body moved
    x_start: wp.array  # (A,) vec3 m, the same, from which motion is counted: elsewhere where the body leapt (leap.py)
    x_feasible: wp.array  # (A,) vec3 m, intersection-free: carried along with the body; where contact is linearised
    x_hat: wp.array  # (N,) vec3 m, inertial prediction
    v: wp.array  # (N,) vec3 m/s
    acceleration: wp.array  # (N,) vec3 m/s^2, of external forces
    skin: wp.array  # (B,) vec3 m, where the collision surface is drawn in this step: to the tracked skin
    hold: wp.array  # (B,) float32 N, how firmly at most
    dt: wp.array  # (1,) float32 s, the step's time: here, and not in launches, which a GPU's graphs keep as they were
    time: float = 0.0  # s, the poses' clock
    still: float = 0.0  # s, for which nothing has moved faster than Sleep allows
    liveliest: float = 0.0  # m^2/s^2, of all vertices' speeds squared the largest sum in the first half of that
    asleep: bool = False


@dataclass
class Workspace:
    """Scratch of the solve, allocated once."""

    gradient: wp.array  # (A,) vec3 N
    corner_gradient: wp.array  # (F, 3) vec3 N, per triangle corner
    direction: wp.array  # (A,) vec3 m
    product: wp.array  # (A,) vec3 N
    residual: wp.array  # (A,) vec3 N
    preconditioned: wp.array  # (A,) vec3 m
    total: wp.array  # (A,) vec3 m
    wanted: wp.array  # (A,) vec3 m, the correction's direction, as the move began
    held: wp.array  # (A,) vec3 (N/m)^1/2, as in contact/hold.py: zero where nothing touches
    least: wp.array  # (A,) vec3 m, where the correction was nearest to balance
    blocks: wp.array  # (A,) mat33 m/N, inverse diagonal blocks
    diagonal: wp.array  # (A,) float32 N/m, inertia, drag and the skin's hold: what is not in the stiffness rows
    as_one: AsOne
    alpha: wp.array  # (A,) float32, fraction of a displacement each vertex may take
    products: wp.array  # (3,) float32 J, the global step's dot products, as in two_level.py
    parts: wp.array  # (PARTS,) float32, of sums, in their unit, as in linalg/vectors.py
    hits: wp.array  # (1,) int32
    scalars: list[wp.array] = field(default_factory=list)  # (1,) float32 each

    @staticmethod
    def allocate(all_count: int, face_count: int, device: str) -> Workspace:
        """For so many vertices and triangles."""

        def vectors(*shape: int) -> wp.array:
            return wp.zeros(shape, dtype=wp.vec3, device=device)

        return Workspace(
            gradient=vectors(all_count),
            corner_gradient=vectors(face_count, 3),
            direction=vectors(all_count),
            product=vectors(all_count),
            residual=vectors(all_count),
            preconditioned=vectors(all_count),
            total=vectors(all_count),
            wanted=vectors(all_count),
            held=vectors(all_count),
            least=vectors(all_count),
            blocks=wp.zeros(all_count, dtype=wp.mat33, device=device),
            diagonal=wp.zeros(all_count, dtype=wp.float32, device=device),
            as_one=AsOne.allocate(device),
            alpha=wp.zeros(all_count, dtype=wp.float32, device=device),
            products=wp.zeros(3, dtype=wp.float32, device=device),
            parts=wp.zeros(PARTS, dtype=wp.float32, device=device),
            hits=wp.zeros(1, dtype=wp.int32, device=device),
            scalars=[wp.zeros(1, dtype=wp.float32, device=device) for _ in range(4)],
        )


def positions(x_cloth: np.ndarray, x_body: np.ndarray) -> np.ndarray:
    """(A, 3) float32: cloth first, body behind."""
    return np.vstack([x_cloth, x_body]).astype(np.float32)
