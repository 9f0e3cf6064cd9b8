"""Linear blend skinning on the device: one Warp kernel, one thread per vertex."""

from __future__ import annotations

import numpy as np
import warp as wp

from tryon_solver.body.model import BodyModel
from tryon_solver.body.pose import Pose, world_from_rest
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.upload import Upload


@wp.kernel
def skin_vertices(
    rest_vertices: wp.array(dtype=wp.vec3d),
    skin_joints: wp.array2d(dtype=wp.int32),
    skin_weights: wp.array2d(dtype=wp.float32),
    world_from_rest_joint: wp.array(dtype=wp.mat44d),
    vertices_out: wp.array(dtype=wp.vec3),
):
    """v = sum_k w_k T_k v_rest, summed in float64 and rounded once, so that the error is that of the rounding."""
    b = wp.tid()
    rest = rest_vertices[b]
    blended = wp.vec3d(wp.float64(0.0), wp.float64(0.0), wp.float64(0.0))
    for k in range(skin_joints.shape[1]):
        weight = wp.float64(skin_weights[b, k])
        blended += weight * wp.transform_point(world_from_rest_joint[skin_joints[b, k]], rest)
    vertices_out[b] = wp.vec3(blended)


class SkinningKernel:
    """Poses a body on a Warp device. Allocates on construction only; a run uploads J matrices and launches once.

    The result equals `tryon_solver.body.pose.skin` within 1e-6 m for coordinates below 8 m.
    """

    def __init__(self, model: BodyModel, device: str | wp.Device) -> None:
        self.model = model
        self.device = wp.get_device(device)
        self._rest_vertices: wp.array = wp.array(model.rest_vertices, dtype=wp.vec3d, device=self.device)
        self._skin_joints: wp.array = wp.array(model.skin_joints, dtype=wp.int32, device=self.device)
        self._skin_weights: wp.array = wp.array(model.skin_weights, dtype=wp.float32, device=self.device)
        self._transforms: wp.array = wp.zeros(model.joint_count, dtype=wp.mat44d, device=self.device)
        self._upload = Upload(self._transforms)

    def run(self, pose: Pose, out: wp.array) -> None:
        """Write the posed vertices [m] to `out`: wp.array of B vec3 on this kernel's device.

        Raises ValueError when `out` has another length, type or device. The pose is taken as valid, see Pose.validate.
        """
        if out.shape != (self.model.vertex_count,) or out.dtype != wp.vec3 or out.device != self.device:
            raise ValueError(
                f"out must be {self.model.vertex_count} vec3 on {self.device}, "
                f"got shape {out.shape} of {out.dtype.__name__} on {out.device}"
            )
        self.take(world_from_rest(self.model, pose), pose)
        self.write(out)

    def transforms(self, stance: Pose) -> np.ndarray:
        """(J, 4, 4) float64 m: what each joint does to points at rest."""
        return world_from_rest(self.model, stance)

    def take(self, transforms: np.ndarray, _stance: Pose) -> None:
        """Be where the joints' transforms (J, 4, 4) float64 are, which say all there is to say of a posed body."""
        self._upload.write(transforms)

    def write(self, out: wp.array) -> None:
        """The vertices there."""
        self._upload.fetch()
        launch(
            skin_vertices,
            dim=self.model.vertex_count,
            inputs=[self._rest_vertices, self._skin_joints, self._skin_weights, self._transforms],
            outputs=[out],
            device=self.device,
        )

    def between(self, first: Pose, last: Pose, share: float) -> Pose:
        """The pose at `share` of the way."""
        return Pose.interpolate(first, last, share)

    def part_way(self, first: Pose, last: Pose, share: float) -> Pose:
        """The pose at `share` of the way, but its root where that of the last one is."""
        between = self.between(first, last, share)
        return Pose(last.root, np.vstack([last.rotations[:1], between.rotations[1:]]))

    def place(self, stance: Pose) -> np.ndarray:
        """(3,) m: where the root joint is."""
        return np.asarray(stance.root, dtype=np.float64)

    def moved(self, stance: Pose, by: np.ndarray) -> Pose:
        """The same pose, `by` (3,) m away."""
        return Pose(np.asarray(stance.root) + by, stance.rotations)

