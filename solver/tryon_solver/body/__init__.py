"""The wearer: model, poses, motions. `skinning` (Warp) and `making` (set-up only) are imported by their own names."""

from tryon_solver.body.model import BodyError, BodyModel, default_body, default_body_path
from tryon_solver.body.pose import Pose, PoseError, skin, world_from_joint

__all__ = [
    "BodyError",
    "BodyModel",
    "Pose",
    "PoseError",
    "default_body",
    "default_body_path",
    "skin",
    "world_from_joint",
]
