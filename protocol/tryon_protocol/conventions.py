"""The conventions of trackers: which joints they have, and which arrays their poses hold. PROTOCOL.md section 3.1."""

from __future__ import annotations

from dataclasses import dataclass

from .messages import POSE_FRAME

IMAGE_FRAME = "mediapipe-world"
_SIDES = ("left", "right")


def _both(*joints: str) -> tuple[str, ...]:
    return tuple(joint.format(side=side) for side in _SIDES for joint in joints)


@dataclass(frozen=True)
class Convention:
    """What a tracker's poses look like.

    Attributes:
        known: names a skeleton of it may have; () for any.
        required: names it must have.
        positions: whether poses hold world positions; else they hold `root` and rotations relative to the parent.
        rotations: whether they hold rotations.
        frames: what `frame` may be.
        needs_rest: whether the skeleton must tell parents and rest positions.
        fewest: number of joints that a skeleton must have at least, whatever their names.
    """

    known: tuple[str, ...] = ()
    required: tuple[str, ...] = ()
    positions: bool = True
    rotations: bool = True
    frames: tuple[str, ...] = (POSE_FRAME,)
    needs_rest: bool = False
    fewest: int = 1


_FINGERS = tuple(
    f"{{side}}-hand-{finger}-{bone}"
    for finger in ("index", "middle", "ring", "little")
    for bone in ("metacarpal", "phalanx-proximal", "phalanx-intermediate", "phalanx-distal", "tip")
)
_THUMB = tuple(f"{{side}}-hand-thumb-{bone}" for bone in ("metacarpal", "phalanx-proximal", "phalanx-distal", "tip"))
WEBXR_JOINTS = (
    *("hips", "spine-lower", "spine-middle", "spine-upper", "chest", "neck", "head"),
    *_both("{side}-shoulder", "{side}-scapula", "{side}-arm-upper", "{side}-arm-lower", "{side}-hand-wrist-twist"),
    *_both("{side}-hand-palm", "{side}-hand-wrist", *_THUMB, *_FINGERS, "{side}-hand-middle-phalanx-metacarpal"),
    *_both("{side}-upper-leg", "{side}-lower-leg"),
    *_both(*(f"{{side}}-foot-{part}" for part in ("ankle-twist", "ankle", "subtalar", "transverse", "ball"))),
    "viewer",
)
"""WebXR Body Tracking Level 1, with both spellings of the middle metacarpal, and `viewer`: the XRViewerPose."""
MEDIAPIPE_JOINTS = (
    *("nose", "left_eye_inner", "left_eye", "left_eye_outer", "right_eye_inner", "right_eye", "right_eye_outer"),
    *("left_ear", "right_ear", "mouth_left", "mouth_right", "left_shoulder", "right_shoulder", "left_elbow"),
    *("right_elbow", "left_wrist", "right_wrist", "left_pinky", "right_pinky", "left_index", "right_index"),
    *("left_thumb", "right_thumb", "left_hip", "right_hip", "left_knee", "right_knee", "left_ankle", "right_ankle"),
    *("left_heel", "right_heel", "left_foot_index", "right_foot_index"),
)
"""The 33 landmarks of MediaPipe Pose, in its order."""
SMPL_JOINTS = (
    *("pelvis", "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2", "left_ankle", "right_ankle"),
    *("spine3", "left_foot", "right_foot", "neck", "left_collar", "right_collar", "head", "left_shoulder"),
    *("right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist", "left_hand", "right_hand"),
)
"""The 24 joints of SMPL, in its order; those of XR_BD_body_tracking are the same."""

CONVENTIONS: dict[str, Convention] = {
    "webxr": Convention(
        known=WEBXR_JOINTS,
        required=("hips", *_both("{side}-arm-upper", "{side}-arm-lower", "{side}-hand-wrist")),
    ),
    "head-hands": Convention(known=("viewer", *_both("{side}-hand-wrist")), required=("viewer",)),
    "mediapipe": Convention(
        known=MEDIAPIPE_JOINTS,
        required=_both("{side}_hip", "{side}_shoulder", "{side}_elbow", "{side}_wrist"),
        rotations=False,
        frames=(POSE_FRAME, IMAGE_FRAME),
    ),
    "smpl": Convention(known=SMPL_JOINTS, required=SMPL_JOINTS, positions=False),
    "bvh": Convention(positions=False, needs_rest=True, fewest=14),  # pelvis, head, three of each limb
}
