"""Linear blend skinning in numpy float64: the posed surface that a frame's offsets refer to. PROTOCOL.md section 8.

    v_i = root + sum_k w_ik ( W_j (r_i - c_j) + p_j ),   j = skin_joints[i,k]

with r rest vertices, c rest joints, W_j the product of the local rotations from the root to j, and p_j the centre of
joint j relative to the root joint: p_0 = 0, p_j = p_parent + W_parent (c_j - c_parent). The root's place is added last,
so that a distant root costs no precision.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import numpy.typing as npt

from .topology import BodySurface

Doubles = npt.NDArray[np.float64]


class Skinner:
    """Poses one body; everything that depends on the body alone is prepared once."""

    def __init__(self, body: BodySurface) -> None:
        rest = body.rest_vertices.astype(np.float64)
        self._centres = body.rest_joints.astype(np.float64)
        self._vertex_count = len(rest)
        parents = body.parents
        bones = self._centres.copy()
        bones[1:] -= self._centres[parents[1:]]
        depth = np.zeros(len(parents), dtype=np.int64)
        for joint in range(1, len(parents)):
            depth[joint] = depth[parents[joint]] + 1
        levels = [np.flatnonzero(depth == level) for level in range(1, int(depth.max()) + 1)]
        self._levels = [(level, parents[level], bones[level][:, :, None]) for level in levels]

        # One entry per non-zero weight, sorted by joint: a joint moves its entries with one small matrix product.
        vertices, slots = np.nonzero(body.skin_weights)
        joints = body.skin_joints[vertices, slots].astype(np.int64)
        weights = body.skin_weights[vertices, slots].astype(np.float64)
        order = np.argsort(joints, kind="stable")
        weighted = np.concatenate([rest[vertices], np.ones((len(vertices), 1))], axis=1) * weights[:, None]
        self._weighted = weighted[order]
        bounds = np.searchsorted(joints[order], np.arange(len(parents) + 1))
        self._spans = [(j, int(a), int(b)) for j, (a, b) in enumerate(pairwise(bounds)) if b > a]
        self._moved = np.empty((len(vertices), 3))

        # Sum per vertex: the first influence of every vertex, then the second of those that have one, and so on, with
        # the vertices in order of how many they have, so that each time it is the first so many that have one more.
        place = np.empty(len(vertices), dtype=np.int64)
        place[order] = np.arange(len(vertices))
        counts = np.bincount(vertices, minlength=self._vertex_count)
        starts = np.cumsum(counts) - counts
        most_first = np.argsort(-counts, kind="stable")
        self._rank = np.empty(self._vertex_count, dtype=np.int64)
        self._rank[most_first] = np.arange(self._vertex_count)
        entries = []
        for influence in range(max(1, int(counts.max(initial=0)))):
            owners = most_first[: int((counts > influence).sum())]
            entries.append(place[starts[owners] + influence])
        self._first, *self._further = entries
        self._ranked, self._more = np.zeros((2, self._vertex_count, 3))

    def joint_transforms(self, rotations: npt.NDArray[np.floating]) -> tuple[Doubles, Doubles]:
        """World rotations W (J,3,3) and joint centres p (J,3) m relative to the root joint.

        rotations: (J,4) local quaternions x, y, z, w; they are normalised here.
        """
        local = rotation_matrices(rotations)
        world, centres = local.copy(), np.zeros((len(local), 3))
        for joints, parents, bones in self._levels:
            turned = world[parents]
            world[joints] = turned @ local[joints]
            centres[joints] = centres[parents] + (turned @ bones)[:, :, 0]
        return world, centres

    def pose(self, root: npt.NDArray[np.float64], rotations: npt.NDArray[np.floating]) -> Doubles:
        """The posed surface (B,3) float64 m. root: (3,) m; rotations: (J,4) quaternions x, y, z, w."""
        world, centres = self.joint_transforms(rotations)
        matrices = np.empty((len(world), 4, 3))
        matrices[:, :3] = world.transpose(0, 2, 1)
        matrices[:, 3] = centres - (world @ self._centres[:, :, None])[:, :, 0]
        for joint, start, stop in self._spans:
            np.matmul(self._weighted[start:stop], matrices[joint], out=self._moved[start:stop])
        moved, ranked = self._moved, self._ranked
        # "clip" checks no index; what does has to copy for `out`
        np.take(moved, self._first, axis=0, out=ranked[: len(self._first)], mode="clip")
        for entries in self._further:
            more = np.take(moved, entries, axis=0, out=self._more[: len(entries)], mode="clip")
            ranked[: len(entries)] += more
        surface = np.take(ranked, self._rank, axis=0)
        surface += root
        return surface


def rotation_matrices(quaternions: npt.NDArray[np.floating]) -> Doubles:
    """(J,4) quaternions x, y, z, w, none of them zero -> (J,3,3) float64 rotation matrices."""
    q = quaternions.astype(np.float64)
    x, y, z, w = (q / np.sqrt((q * q).sum(axis=1, keepdims=True))).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.array(rows).transpose(2, 0, 1).copy()
