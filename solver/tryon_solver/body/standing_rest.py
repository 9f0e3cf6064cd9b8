"""A rest pose to retarget from, where the file's own is none.

Retargeting compares each part with how it stands in the source's rest pose. A skeleton whose bones are rolled any way
has, with all its channels zero, a heap of bones instead: its zero says nothing. Then the frame in which the body stands
most upright is taken for the rest pose, and everything is told relative to that. Ours.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tryon_solver.body import quaternions
from tryon_solver.body.bvh import BvhClip
from tryon_solver.body.skeletons import SIDES, SkeletonParts

LEG_SPREAD = 50.0  # degrees from straight down that a leg may point in a rest pose; CMU's spread legs have 20
TRUNK_LEAN = 30.0  # degrees from upright
FRAMES_LOOKED_AT = 200
TILTED = 10.0  # degrees
ALIKE = 20.0  # degrees; the legs of CMU's skeletons lean to the front and their trunks to the back, by 14 together


def with_standing_rest(clip: BvhClip, parts: SkeletonParts) -> tuple[BvhClip, str]:
    """The clip relative to a rest pose in which it stands, and what was done, for people; "" where nothing was."""
    rest = clip.rest_positions()
    up, left = _directions(rest, parts)
    if _stands(rest, parts, _nearest_axis(up)) and abs(_nearest_axis(up) @ _nearest_axis(left)) < 0.5:
        return clip, ""
    positions, rotations = clip.world()
    looked_at = np.unique(np.linspace(0, clip.frame_count - 1, FRAMES_LOOKED_AT).round().astype(int))
    upward = _nearest_axis(np.median([_directions(positions[k], parts)[0] for k in looked_at], axis=0))
    leans = [_lean(positions[k], parts, upward) for k in looked_at]
    frame = int(looked_at[int(np.argmin(leans))])
    _, left = _directions(positions[frame], parts)
    left = left - (left @ upward) * upward
    left /= np.linalg.norm(left)
    axes = np.stack([left, upward, np.cross(left, upward)])  # to x left, y up, z ahead
    turned = _relative_to(clip, positions, rotations, frame, axes)
    return turned, f"with all channels zero it does not stand: its frame {frame + 1} is taken for its rest pose"


def upward_axis(clip: BvhClip, parts: SkeletonParts) -> str:
    """The axis of the file that is up in most of its poses: "Y", "-Z", ..."""
    looked_at = np.unique(np.linspace(0, clip.frame_count - 1, FRAMES_LOOKED_AT).round().astype(int))
    positions, _ = replace(clip, positions=clip.positions[looked_at], rotations=clip.rotations[looked_at]).world()
    up = _nearest_axis(np.median([_directions(x, parts)[0] for x in positions], axis=0))
    axis = int(np.abs(up).argmax())
    return ("-" if up[axis] < 0 else "") + "XYZ"[axis]


def tilt(clip: BvhClip, parts: SkeletonParts) -> float:
    """Degrees by which the whole person is tilted from the file's upward axis in most poses; 0 where it can't be told.

    Told by legs and trunk that lean by over `TILTED` and differ by less than `ALIKE`: who bends or sits leans the trunk
    or the legs, who runs has the trunk upright, and nobody stands leaning as a whole. It is the exporter's tilt then.
    """
    looked_at = np.unique(np.linspace(0, clip.frame_count - 1, FRAMES_LOOKED_AT).round().astype(int))
    positions, _ = replace(clip, positions=clip.positions[looked_at], rotations=clip.rotations[looked_at]).world()
    up = _nearest_axis(np.median([_directions(x, parts)[0] for x in positions], axis=0))
    at = {name: positions[:, joint] for name, joint in parts.joints.items()}
    hips, feet = at["left_thigh"] + at["right_thigh"], at["left_foot"] + at["right_foot"]
    legs = np.median(hips - feet, axis=0)
    trunk = np.median(at["left_upper_arm"] + at["right_upper_arm"] - hips, axis=0)
    if _angle(legs, trunk) > ALIKE or min(_angle(legs, up), _angle(trunk, up)) < TILTED:
        return 0.0
    return _angle(legs / np.linalg.norm(legs) + trunk / np.linalg.norm(trunk), up)


def _relative_to(
    clip: BvhClip, positions: np.ndarray, rotations: np.ndarray, frame: int, axes: np.ndarray
) -> BvhClip:
    """The same motion with the pose of a frame as its rest pose, in new axes (rows)."""
    vectors = rotations[..., :3] @ axes.T
    turned = np.concatenate([vectors, rotations[..., 3:]], axis=-1)
    placed = positions @ axes.T
    world = quaternions.multiply(turned, quaternions.conjugate(turned[frame]))
    local, moved = world.copy(), placed.copy()
    offsets = placed[frame].copy()
    tips = {}
    for joint, parent in enumerate(clip.parents):
        if parent >= 0:
            back = quaternions.conjugate(world[:, parent])
            local[:, joint] = quaternions.multiply(back, world[:, joint])
            moved[:, joint] = quaternions.rotate(back, placed[:, joint] - placed[:, parent])
            offsets[joint] = placed[frame, joint] - placed[frame, parent]
        if joint in clip.end_sites:
            tip = axes @ quaternions.rotate(rotations[frame, joint], clip.end_sites[joint])
            tips[joint] = tip
    return replace(clip, offsets=offsets, end_sites=tips, positions=moved, rotations=local)


def _directions(x: np.ndarray, parts: SkeletonParts) -> tuple[np.ndarray, np.ndarray]:
    """Up (feet to shoulders) and left, of joints x (J, 3) m; neither is of unit length."""
    at = {name: x[joint] for name, joint in parts.joints.items()}
    up = at["left_upper_arm"] + at["right_upper_arm"] - at["left_foot"] - at["right_foot"]
    left = at["left_thigh"] - at["right_thigh"] + at["left_upper_arm"] - at["right_upper_arm"]
    return up, left


def _nearest_axis(direction: np.ndarray) -> np.ndarray:
    axis = int(np.abs(direction).argmax())
    return np.eye(3)[axis] * (1.0 if direction[axis] >= 0 else -1.0)


def _angles(x: np.ndarray, parts: SkeletonParts, up: np.ndarray) -> tuple[float, list[float]]:
    """Degrees by which the trunk leans, and by which thighs and shins are off straight down."""
    at = {name: x[joint] for name, joint in parts.joints.items()}
    trunk = at["left_upper_arm"] + at["right_upper_arm"] - 2 * at["pelvis"]
    bones = [(f"{side}_{a}", f"{side}_{b}") for side in SIDES for a, b in (("thigh", "shin"), ("shin", "foot"))]
    return _angle(trunk, up), [_angle(at[b] - at[a], -up) for a, b in bones]


def _stands(x: np.ndarray, parts: SkeletonParts, up: np.ndarray) -> bool:
    trunk, legs = _angles(x, parts, up)
    return trunk < TRUNK_LEAN and max(legs) < LEG_SPREAD


def _lean(x: np.ndarray, parts: SkeletonParts, up: np.ndarray) -> float:
    trunk, legs = _angles(x, parts, up)
    return trunk + sum(legs)


def _angle(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)))
