"""Whether a garment is still worn: which limbs each of its boundary loops runs around."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

OFF_CENTRE = np.array([0.0137, 0.0071, -0.0093])  # of the loop's extent: a bone may run exactly through its centre


class LoopsOnLimbs:
    """How often each way through the body passes through each loop, and how far a loop has slid.

    A way leads along the bones from the head to a fingertip or a toe. It passes through a loop when it crosses a fan of
    triangles from near the loop's centre to its edges; the crossings, counted with their direction, add up to the
    linking number of the loop with the way (closed far outside), whatever shape the fan has. A loop that slips off the
    end of a limb, or a limb that slips out of a loop or into another one, changes a number. Sliding along a limb does
    not; that is the distance along the bones from where the fan was crossed to where it is crossed now.
    """

    def __init__(
        self, loops: list[np.ndarray], joint_names: tuple[str, ...], parents: np.ndarray, rest_joints: np.ndarray
    ) -> None:
        """`loops`: vertex ids of each boundary loop; `rest_joints` (J, 3) m."""
        self.loops = loops
        self.parents = np.asarray(parents)
        self.bones = np.flatnonzero(self.parents >= 0)  # a bone is named by the joint at its far end
        leaves = np.setdiff1d(np.arange(len(self.parents)), self.parents)
        head = joint_names.index("head") if "head" in joint_names else int(leaves[0])
        from_root = {leaf: self._path(int(leaf)) for leaf in {head, *leaves.tolist()}}
        self.ends = [joint_names[leaf] for leaf in leaves if leaf != head]
        self.ways = np.array([from_root[leaf] - from_root[head] for leaf in leaves.tolist() if leaf != head])
        self.lengths = np.linalg.norm(rest_joints[self.bones] - rest_joints[self.parents[self.bones]], axis=1)
        ends = (self.parents[self.bones], self.bones)
        graph = sparse.coo_matrix((np.maximum(self.lengths, 1e-9), ends), shape=(len(parents), len(parents)))
        self.between = csgraph.dijkstra(graph.tocsr(), directed=False)  # (J, J) m along the bones

    def _path(self, leaf: int) -> np.ndarray:
        """(bones,) 1 for each bone between the root and this joint."""
        on_path = np.zeros(len(self.bones), int)
        while self.parents[leaf] >= 0:
            on_path[self.bones == leaf] = 1
            leaf = int(self.parents[leaf])
        return on_path

    def crossings(self, cloth: np.ndarray, joints: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
        """How often each way passes each loop (loops, ways), and where bones cross each loop's fan.

        `cloth` (N, 3) m, `joints` (J, 3) m. A place is a row (bone, share of its length from its near end).
        """
        start, end = joints[self.parents[self.bones]], joints[self.bones]
        counts, places = zip(*(fan_crossings(cloth[loop], start, end) for loop in self.loops))
        return np.array(counts) @ self.ways.T, list(places)

    def slide(self, before: np.ndarray, now: np.ndarray) -> float:
        """Distance [m] along the bones between a loop's places before and now, the nearest two; inf without any.

        0 for a loop that no bone crossed before, as that of a hood around the face: it has no place on a limb.
        """
        if not len(before):
            return 0.0
        if not len(now):
            return np.inf
        bone = [places[:, 0].astype(int) for places in (before, now)]
        along = [self.lengths[b] * places[:, 1] for b, places in zip(bone, (before, now))]
        near = [(self.parents[self.bones[b]], a) for b, a in zip(bone, along)]
        far = [(self.bones[b], self.lengths[b] - a) for b, a in zip(bone, along)]
        ways = [
            rest_i[:, None] + self.between[np.ix_(i, j)] + rest_j[None]
            for i, rest_i in (near[0], far[0])
            for j, rest_j in (near[1], far[1])
        ]
        same = bone[0][:, None] == bone[1][None]
        straight = np.where(same, np.abs(along[0][:, None] - along[1][None]), np.inf)
        return float(np.minimum(np.min(ways, axis=0), straight).min())


def fan_crossings(loop: np.ndarray, start: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How often segments from `start` to `end` (S, 3) cross the fan of the closed polygon (L, 3), with direction: (S,).

    And where: rows (segment, share of its length). Line and triangle after Moeller and Trumbore 1997.
    """
    centre = loop.mean(0) + OFF_CENTRE * np.ptp(loop, axis=0).max()
    first = loop - centre
    second = np.roll(loop, -1, axis=0) - centre
    along = (end - start)[:, None]
    h = np.cross(along, second[None])
    determinant = np.einsum("le,sle->sl", first, h)
    safe = np.where(determinant == 0, 1.0, determinant)
    to_start = (start - centre)[:, None]
    u = (to_start * h).sum(2) / safe
    q = np.cross(to_start, first[None])
    v = (along * q).sum(2) / safe
    t = np.einsum("le,sle->sl", second, q) / safe
    hit = (determinant != 0) & (u >= 0) & (v >= 0) & (u + v < 1) & (t >= 0) & (t < 1)
    places = np.column_stack([np.nonzero(hit)[0], t[hit]])
    return np.where(hit, np.sign(determinant), 0).sum(1).astype(int), places
