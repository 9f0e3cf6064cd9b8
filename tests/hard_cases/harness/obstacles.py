"""Bodies that are no person: rigid parts that stand or move, each along a path of its own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
import warp as wp
from scipy.spatial.transform import Rotation

from tryon_solver.body import quaternions
from tryon_solver.body.mesh_sequence import blend
from tryon_solver.body.skinning import skin_vertices

Path = Callable[[float], tuple[np.ndarray, np.ndarray]]
"""Time [s] -> rotation vector (3,) rad and displacement (3,) m of a part, about its own middle."""


def standing(_t: float) -> tuple[np.ndarray, np.ndarray]:
    """Does not move."""
    return np.zeros(3), np.zeros(3)


@dataclass(frozen=True)
class Placed:
    """Where the parts are: rotations (P, 4) unit quaternions x y z w, displacements (P, 3) m of their middles."""

    rotations: np.ndarray
    shifts: np.ndarray


class Obstacles:
    """Rigid parts as a body that cloth can touch. Joint 0 is the world, which stands still; joint p + 1 is part p."""

    def __init__(self, parts: Sequence[tuple[np.ndarray, np.ndarray]], paths: Sequence[Path]) -> None:
        """`parts`: vertices (B, 3) m at time 0 and outward faces (F, 3) of each."""
        counts = [len(v) for v, _ in parts]
        starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
        self.paths = list(paths)
        self.rest_vertices = np.vstack([v for v, _ in parts]).astype(np.float64)
        self.faces = np.vstack([f + s for (_, f), s in zip(parts, starts)]).astype(np.int32)
        self.middles = np.array([v.mean(0) for v, _ in parts])
        self.skin_joints = np.repeat(np.arange(1, len(parts) + 1, dtype=np.int32), counts)[:, None]
        self.skin_weights = np.ones((len(self.rest_vertices), 1), np.float32)

    @property
    def joint_count(self) -> int:
        return len(self.middles) + 1

    def at(self, t: float) -> Placed:
        """Where the paths lead at t [s]."""
        turned, shifts = zip(*(path(t) for path in self.paths))
        return Placed(Rotation.from_rotvec(np.array(turned)).as_quat(), np.array(shifts, np.float64))

    def start(self) -> Placed:
        return self.at(0.0)

    def transforms(self, stance: Placed) -> np.ndarray:
        """(J, 4, 4) float64 m."""
        result = np.tile(np.eye(4), (self.joint_count, 1, 1))
        turns = quaternions.to_matrix(stance.rotations)
        result[1:, :3, :3] = turns
        result[1:, :3, 3] = self.middles + stance.shifts - (turns @ self.middles[..., None])[..., 0]
        return result

    def surface(self, stance: Placed) -> np.ndarray:
        """(B, 3) float64 m."""
        return blend(self.transforms(stance), self.skin_joints, self.skin_weights, self.rest_vertices)

    def on_device(self, device: str) -> FollowedObstacles:
        return FollowedObstacles(self, device)


class FollowedObstacles:
    """The parts on a device."""

    def __init__(self, obstacles: Obstacles, device: str) -> None:
        self.obstacles, self.device = obstacles, device
        self._rest: wp.array = wp.array(obstacles.rest_vertices, dtype=wp.vec3d, device=device)
        self._joints: wp.array = wp.array(obstacles.skin_joints, dtype=wp.int32, device=device)
        self._weights: wp.array = wp.array(obstacles.skin_weights, dtype=wp.float32, device=device)
        self._transforms: wp.array = wp.zeros(obstacles.joint_count, dtype=wp.mat44d, device=device)

    def transforms(self, stance: Placed) -> np.ndarray:
        return self.obstacles.transforms(stance)

    def root(self, stance: Placed) -> np.ndarray:
        return self.transforms(stance)[0]

    def take(self, transforms: np.ndarray, _stance: Placed) -> None:
        self._transforms.assign(np.ascontiguousarray(transforms))

    def write(self, out: wp.array) -> None:
        inputs = [self._rest, self._joints, self._weights, self._transforms]
        wp.launch(skin_vertices, len(self._rest), inputs, [out], device=self.device)

    def between(self, first: Placed, last: Placed, share: float) -> Placed:
        turned = quaternions.slerp(first.rotations, last.rotations, share)
        return Placed(turned, (1 - share) * first.shifts + share * last.shifts)

    def part_way(self, first: Placed, last: Placed, share: float) -> Placed:
        return self.between(first, last, share)  # as a whole they stand

    def place(self, _stance: Placed) -> np.ndarray:
        return np.zeros(3)

    def moved(self, stance: Placed, by: np.ndarray) -> Placed:
        return Placed(stance.rotations, stance.shifts + by)


def outward(mesh: trimesh.Trimesh) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and outward faces of a closed mesh."""
    mesh.merge_vertices()
    assert mesh.is_watertight
    if mesh.volume < 0:
        mesh.invert()
    return np.array(mesh.vertices, np.float64), np.array(mesh.faces, np.int32)


def cone(radius: float, height: float, sections: int) -> tuple[np.ndarray, np.ndarray]:
    """Its tip in the origin, its base below."""
    mesh = trimesh.creation.cone(radius, height, sections=sections)
    vertices, faces = outward(mesh)  # along z, base at z = 0
    return np.column_stack([vertices[:, 0], vertices[:, 2] - height, -vertices[:, 1]]), faces


def wedge(length: float, width: float, height: float, pieces: int) -> tuple[np.ndarray, np.ndarray]:
    """A knife: its edge along x through the origin, its back `width` m wide below, cut into pieces along x."""
    x = np.linspace(-length / 2, length / 2, pieces + 1)
    n = pieces + 1
    edge = np.column_stack([x, 0 * x, 0 * x])
    left, right = edge + [0, -height, -width / 2], edge + [0, -height, width / 2]
    faces = []
    for a, b in ((0, n), (n, 2 * n), (2 * n, 0)):  # the three long sides, as strips
        for k in range(pieces):
            faces += [[a + k, a + k + 1, b + k + 1], [a + k, b + k + 1, b + k]]
    faces += [[0, n, 2 * n], [pieces, 2 * n + pieces, n + pieces]]
    return outward(trimesh.Trimesh(np.vstack([edge, left, right]), np.array(faces), process=False))


def corner(side: float, cells: int) -> tuple[np.ndarray, np.ndarray]:
    """A cube that stands on one corner, the opposite one in the origin, its sides cut into cells."""
    box = trimesh.creation.box((side, side, side))
    for _ in range(max(0, round(np.log2(cells)))):
        box = box.subdivide()
    vertices, faces = outward(box)
    vertices = vertices - side / 2
    up = Rotation.align_vectors([[0, 1, 0]], [[1, 1, 1]])[0]
    return up.apply(vertices), faces


def torus(radius: float, wire: float, around: int, across: int) -> tuple[np.ndarray, np.ndarray]:
    """A ring about the y axis; `radius` m to the middle of a wire of that radius."""
    vertices, faces = outward(trimesh.creation.torus(radius, wire, major_sections=around, minor_sections=across))
    return np.column_stack([vertices[:, 0], vertices[:, 2], -vertices[:, 1]]), faces
