"""Poses and linear blend skinning, in numpy: the reference that the Warp kernel is held to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tryon_solver.body import quaternions
from tryon_solver.body.model import BodyModel

UNIT_TOLERANCE = 1e-3  # float32 quaternions off the wire are off by 1e-7; anything beyond this is a sender's mistake


class PoseError(ValueError):
    """A pose that cannot be applied to a body; the message names the joint and the remedy."""


@dataclass(frozen=True)
class Pose:
    """Where the root joint is and how every joint is turned away from the rest pose."""

    root: np.ndarray  # (3,) float64 m, world position of the root joint
    rotations: np.ndarray  # (J, 4) float64, unit quaternions x y z w, local, relative to the rest pose

    @staticmethod
    def rest(model: BodyModel) -> Pose:
        """The pose in which the body was modelled."""
        return Pose(model.rest_joints[0].copy(), np.tile(quaternions.IDENTITY, (model.joint_count, 1)))

    @staticmethod
    def interpolate(a: Pose, b: Pose, t: float) -> Pose:
        """From a (t = 0) to b (t = 1): the root on a straight line, each joint by slerp along the shorter arc."""
        root = (1.0 - t) * a.root + t * b.root
        return Pose(root, quaternions.slerp(a.rotations, b.rotations, t))

    def validate(self, model: BodyModel) -> None:
        """Raise PoseError unless the pose fits the model: counts, finite values, unit quaternions within 1e-3."""
        root, rotations = np.asarray(self.root), np.asarray(self.rotations)
        if root.shape != (3,) or not np.isfinite(root).all():
            raise PoseError(f"the root position is {root.tolist()}; send three finite numbers in metres")
        if rotations.shape != (model.joint_count, 4):
            raise PoseError(_count_message(rotations, model))
        bad = np.flatnonzero(~np.isfinite(rotations).all(axis=1))
        if bad.size:
            name, value = model.joint_names[bad[0]], rotations[bad[0]].tolist()
            raise PoseError(f"joint {name!r} has the rotation {value}; send its last good rotation instead")
        lengths = np.linalg.norm(rotations, axis=1)
        bad = np.flatnonzero(np.abs(lengths - 1.0) > UNIT_TOLERANCE)
        if bad.size:
            name, length = model.joint_names[bad[0]], lengths[bad[0]]
            raise PoseError(
                f"joint {name!r} has a quaternion of length {length:.6g}; send unit quaternions in the order x y z w "
                "(0 0 0 1 for a joint that does not move)"
            )


def _count_message(rotations: np.ndarray, model: BodyModel) -> str:
    expected = f"(joints, 4) = ({model.joint_count}, 4)"
    if rotations.ndim == 2 and rotations.shape[1] == 4 and len(rotations) < model.joint_count:
        absent = model.joint_names[len(rotations)]
        return (
            f"the pose has {len(rotations)} rotations, the body has {model.joint_count} joints; the first without one "
            f"is {absent!r}. Send one quaternion per joint in the order of the body's joint names"
        )
    return f"the pose's rotations have shape {rotations.shape}; expected {expected}, in the order of the body's joints"


def world_from_joint(model: BodyModel, pose: Pose) -> np.ndarray:
    """(J, 4, 4) m: the world transforms of the joints; at rest a translation to the joint, without rotation."""
    transforms = np.zeros((model.joint_count, 4, 4))
    transforms[:, :3, :3], transforms[:, 3, 3] = quaternions.to_matrix(pose.rotations), 1.0
    transforms[0, :3, 3] = pose.root
    transforms[1:, :3, 3] = model.rest_joints[1:] - model.rest_joints[model.parents[1:]]
    for joints, above in model.ancestors:  # from one to the one so far up, then twice as far
        transforms[joints] = transforms[above] @ transforms[joints]
    return transforms


def world_from_rest(model: BodyModel, pose: Pose) -> np.ndarray:
    """(J, 4, 4) m: what each joint does to points fixed to it, `world_from_joint @ translation(-rest joint)`."""
    transforms = world_from_joint(model, pose)
    transforms[:, :3, 3] -= (transforms[:, :3, :3] @ model.rest_joints[..., None])[..., 0]
    return transforms


def skin(model: BodyModel, pose: Pose) -> np.ndarray:
    """(B, 3) float64 m: linear blend skinning, v = sum_k w_k (world_from_rest[j_k] v_rest)."""
    transforms = world_from_rest(model, pose)[:, :3]
    weights = model.skin_weights.astype(np.float64)
    blended = np.einsum("bk,bkxy->bxy", weights, transforms[model.skin_joints])
    return np.einsum("bxy,by->bx", blended[:, :, :3], model.rest_vertices) + blended[:, :, 3]
