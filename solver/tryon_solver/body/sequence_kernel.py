"""A sequence of meshes on the device: the frame between two of its frames, skinned like a posed body."""

from __future__ import annotations

import numpy as np
import warp as wp

from tryon_solver.body.mesh_sequence import MeshSequence, Moment
from tryon_solver.body.skinning import skin_vertices
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.upload import Upload


class SequenceKernel:
    """Follows a sequence. Allocates on construction only; a stance uploads J matrices and B corrected vertices."""

    def __init__(self, sequence: MeshSequence, device: str) -> None:
        self.sequence = sequence
        self.device = wp.get_device(device)
        self._rest: wp.array = wp.array(sequence.rest_vertices, dtype=wp.vec3d, device=self.device)
        self._joints: wp.array = wp.array(sequence.skin_joints, dtype=wp.int32, device=self.device)
        self._weights: wp.array = wp.array(sequence.skin_weights, dtype=wp.float32, device=self.device)
        self._transforms: wp.array = wp.zeros(sequence.joint_count, dtype=wp.mat44d, device=self.device)
        self._uploads = Upload(self._transforms), Upload(self._rest)

    def transforms(self, stance: Moment) -> np.ndarray:
        """(J, 4, 4) float64 m: what each part does to points at rest."""
        return self.sequence.transforms(stance)

    def take(self, transforms: np.ndarray, stance: Moment) -> None:
        """Be at the stance, seen from where `transforms` (J, 4, 4) are."""
        for upload, values in zip(self._uploads, (transforms, self.sequence.corrected_rest(stance))):
            upload.write(values)

    def write(self, out: wp.array) -> None:
        """The vertices (B,) vec3 m there into `out`."""
        for upload in self._uploads:
            upload.fetch()
        launch(
            skin_vertices,
            dim=self.sequence.vertex_count,
            inputs=[self._rest, self._joints, self._weights, self._transforms],
            outputs=[out],
            device=self.device,
        )

    def between(self, first: Moment, last: Moment, share: float) -> Moment:
        """The moment at `share` of the way."""
        return Moment(
            (1 - share) * first.time + share * last.time, (1 - share) * first.shift + share * last.shift
        )

    def part_way(self, first: Moment, last: Moment, share: float) -> Moment:
        """The moment at `share` of the way, its middle where that of the last one is; turned as it is at that time."""
        between = self.between(first, last, share)
        return self.moved(between, self.place(last) - self.place(between))

    def place(self, stance: Moment) -> np.ndarray:
        """(3,) m: where the middle of the whole body is."""
        return self.sequence.places_at(stance)[0]

    def moved(self, stance: Moment, by: np.ndarray) -> Moment:
        """The same moment, `by` (3,) m away."""
        return Moment(stance.time, stance.shift + by)
