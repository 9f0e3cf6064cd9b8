"""The wearer: model, poses, motions. `skinning` (Warp) and `making` (set-up only) are imported by their own names."""

from tryon_solver.body.bvh import BvhClip, BvhError, parse_bvh
from tryon_solver.body.model import BodyError, BodyModel, default_body, default_body_path
from tryon_solver.body.motion import Motion, MotionError, blend_in
from tryon_solver.body.pose import Pose, PoseError, skin, world_from_joint
from tryon_solver.body.retarget import retarget
from tryon_solver.body.skeletons import RetargetError

__all__ = [
    "BodyError",
    "BodyModel",
    "BvhClip",
    "BvhError",
    "Motion",
    "MotionError",
    "Pose",
    "PoseError",
    "RetargetError",
    "blend_in",
    "default_body",
    "default_body_path",
    "parse_bvh",
    "retarget",
    "skin",
    "world_from_joint",
]
