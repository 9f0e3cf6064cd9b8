"""A rest pose to retarget from, where the file's own is none.

Retargeting compares each part with how it stands in the source's rest pose. A skeleton whose bones are rolled any way
has, with all its channels zero, a heap of bones instead: its zero says nothing. Then the frame in which the body stands
most upright is taken for the rest pose, and everything is told relative to that. A rest pose that stands, but along
another axis than the poses (converters keep a Y-up skeleton and turn its root to Z up), is turned upright as a whole.
Ours.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tryon_solver.body import quaternions
from tryon_solver.body.bvh import BvhClip
from tryon_solver.body.skeletons import SIDES, SkeletonParts

FILE_AXES = {
    "x": (1.0, 0.0, 0.0),
    "-x": (-1.0, 0.0, 0.0),
    "y": (0.0, 1.0, 0.0),
    "-y": (0.0, -1.0, 0.0),
    "z": (0.0, 0.0, 1.0),
    "-z": (0.0, 0.0, -1.0),
}
"""By the names that a user tells them by."""
LEG_SPREAD = 50.0  # degrees from straight down that a leg may point in a rest pose; CMU's spread legs have 20
TRUNK_LEAN = 30.0  # degrees from upright
FRAMES_LOOKED_AT = 200
TILTED = 10.0  # degrees
STANDING_SHARE = 0.05  # of the poses: so many that stand along the rest pose's axis say that it is up
FLOOR = (-0.05, 0.25)  # m, heights of the lowest joint over a clip whose floor is at zero: toes, or who lies on it
STEADY, UNSTEADY = 0.05, 0.15  # m, up and down of the lowest joint in nine tenths of the poses: on a floor, on none
ALIKE = 20.0  # degrees; the legs of CMU's skeletons lean to the front and their trunks to the back, by 14 together


def with_standing_rest(
    clip: BvhClip, parts: SkeletonParts, up: str | None = None, start: int = 0
) -> tuple[BvhClip, str]:
    """The clip relative to a rest pose in which it stands, and what was done, for people; "" where nothing was.

    `up`: the axis of the file that is up, one of `FILE_AXES`; None to find it out.
    `start`: the frame with which the motion begins, and the clip that is returned; the pose before it may be taken for
    the rest pose, but does not tell up.
    """
    rest = clip.rest_positions()
    own = _own_axis(rest, parts)
    begun = clip.since(start)
    frames, positions = looked_at(begun)
    upward = _upward(positions, parts, own) if up is None else np.array(FILE_AXES[up])
    if own is not None:
        if upward @ own > 0.5:
            return begun, ""
        whose = "its poses along" if up is None else "up is as told,"
        told = f"its rest pose stands along {_axis_name(own)}, {whose} {_axis_name(upward)}"
        told += ": up is the poses'" if up is None else ": it was turned upright"
        return _rest_turned(begun, _turn_upright(rest, parts, own, upward)), told
    frames = np.concatenate([np.zeros(min(start, 1), dtype=frames.dtype), frames + start])
    positions, rotations = clip.world()
    frame = int(frames[int(np.argmin([_lean(x, parts, upward) for x in positions[frames]]))])
    _, left = _directions(positions[frame], parts)
    left = left - (left @ upward) * upward
    left /= np.linalg.norm(left)
    axes = np.stack([left, upward, np.cross(left, upward)])  # to x left, y up, z ahead
    turned = _relative_to(clip, positions, rotations, frame, axes)
    told = f"with all channels zero it does not stand: its frame {frame + 1} is taken for its rest pose"
    return turned.since(start), told


def upward_axis(clip: BvhClip, parts: SkeletonParts, up_told: str | None = None) -> tuple[str, str]:
    """The axis of the file that is played as up: "Y", "-Z", ...; and by what it is told, for people.

    `up_told`: as of `with_standing_rest`.
    """
    if up_told is not None:
        return up_told.upper(), "as told"
    _, positions = looked_at(clip)
    up = _upward(positions, parts, _own_axis(clip.rest_positions(), parts))
    poses = _upward(positions, parts, None)
    if up @ poses > 0.5:
        return _axis_name(up), "from feet to shoulders in its poses"
    lies = f"in its poses the person lies along {_axis_name(poses)}"
    if up @ poses < -0.5:
        lies = "in most of its poses the person is upside down"
    return _axis_name(up), f"from feet to shoulders in its rest pose: {lies}"


def lying_or_standing(clip: BvhClip, parts: SkeletonParts, up_told: str | None = None) -> str:
    """How a clip is played whose poses stand along another axis than the rest pose, by what, and what tells otherwise.

    For people; "" for any other clip, and where it is told. `up_told`: as of `with_standing_rest`.
    """
    _, positions = looked_at(clip)
    own, poses = _own_axis(clip.rest_positions(), parts), _upward(positions, parts, None)
    if up_told is not None or own is None or own @ poses > 0.5:
        return ""
    up, because = _reading(positions, parts, own)
    odd, is_odd = ("upside down", "is upside down") if own @ poses < -0.5 else ("lying", "lies")
    played, other, otherwise = (odd, poses, "stands") if up @ own > 0.5 else ("standing", own, is_odd)
    return (
        f"the person is played {played}, {because}; if it {otherwise}, with {_axis_name(other)} up, "
        f"--motion-up={_axis_name(other).lower()} tells"
    )


def _upward(positions: np.ndarray, parts: SkeletonParts, own: np.ndarray | None) -> np.ndarray:
    """(3,): the coordinate axis that is up, of poses (T, J, 3) m whose rest pose stands along `own` (None: nowhere)."""
    return _reading(positions, parts, own)[0]


def _reading(positions: np.ndarray, parts: SkeletonParts, own: np.ndarray | None) -> tuple[np.ndarray, str]:
    """The same, and by what it is told where the poses stand along another axis than the rest pose.

    It is the one along which most poses are up, from feet to shoulders. That is not the rest pose's where root or
    converter turn the person, but neither is it where somebody lies all along. The floor tells the two apart where it
    is at zero along one of both axes; else it is the rest pose's if the person ever stands along it, or stands on the
    hands, or is lowest at one height along it and not along the poses' axis: a floor is lain on all the time, but the
    feet of who lies move to and fro. Else it is the poses'.
    """
    poses = _nearest_axis(np.median([_directions(x, parts)[0] for x in positions], axis=0))
    if own is None or poses @ own > 0.5:
        return poses, "from feet to shoulders in its poses"
    lowest_own, lowest_poses = ((positions @ axis).min(axis=1) for axis in (own, poses))
    on_own, on_poses = (FLOOR[0] <= float(lowest.min()) <= FLOOR[1] for lowest in (lowest_own, lowest_poses))
    if on_own != on_poses:
        axis = own if on_own else poses
        return axis, f"since the floor is at zero along {_axis_name(axis)}"
    if np.mean([_stands(x, parts, own) for x in positions]) >= STANDING_SHARE:
        return own, f"since it also stands, along {_axis_name(own)}"
    upside_down = poses @ own < -0.5
    if upside_down and _on_hands(positions, parts, own):
        return own, "since it is on the hands"
    if not upside_down and _travel(lowest_own) < STEADY and _travel(lowest_poses) > UNSTEADY:
        return own, f"since its lowest joint stays at one height along {_axis_name(own)}"
    return poses, "as if its root turned it to another upward axis"


def _travel(heights: np.ndarray) -> float:
    low, high = np.percentile(heights, (5.0, 95.0))
    return float(high - low)


def _on_hands(positions: np.ndarray, parts: SkeletonParts, up: np.ndarray) -> bool:
    """Whether most of these poses (T, J, 3) m are upside down along `up`, on the hands: of a person who is turned over
    by the file hang, or swing, hands beside the hips, above the head."""
    over = np.array([_directions(x, parts)[0] @ up < 0.0 for x in positions])
    at = {name: positions[:, joint] @ up for name, joint in parts.joints.items()}
    below = np.minimum(at["left_hand"], at["right_hand"]) < at["head"]
    return bool(np.mean(over & below) > 0.5)


def _own_axis(rest: np.ndarray, parts: SkeletonParts) -> np.ndarray | None:
    """The axis along which a rest pose (J, 3) m stands; None where it does not."""
    up, left = (_nearest_axis(direction) for direction in _directions(rest, parts))
    return up if _stands(rest, parts, up) and abs(up @ left) < 0.5 else None


def looked_at(clip: BvhClip) -> tuple[np.ndarray, np.ndarray]:
    """Up to `FRAMES_LOOKED_AT` frames (T,), spread over the clip, and their joints (T, J, 3) m."""
    frames = np.unique(np.linspace(0, clip.frame_count - 1, FRAMES_LOOKED_AT).round().astype(int))
    return frames, replace(clip, positions=clip.positions[frames], rotations=clip.rotations[frames]).world()[0]


def _turn_upright(rest: np.ndarray, parts: SkeletonParts, own: np.ndarray, upward: np.ndarray) -> np.ndarray:
    """(4,): the shortest turn from `own` to `upward`; a body upside down goes on facing where it faces."""
    if own @ upward > -0.5:
        return quaternions.between(own, upward)
    ahead = np.cross(_nearest_axis(_directions(rest, parts)[1]), own)
    return quaternions.from_axis_angle(ahead, np.pi)


def _rest_turned(clip: BvhClip, turn: np.ndarray) -> BvhClip:
    """The same motion on the rest pose turned as a whole by `turn` (4,): W' = W turn^-1 for every joint."""
    rotations = quaternions.multiply(clip.rotations, quaternions.conjugate(turn))
    rotations[:, 1:] = quaternions.multiply(turn, rotations[:, 1:])
    positions = quaternions.rotate(turn, clip.positions)
    positions[:, 0] = clip.positions[:, 0]
    tips = {joint: quaternions.rotate(turn, tip) for joint, tip in clip.end_sites.items()}
    offsets = quaternions.rotate(turn, clip.offsets)
    return replace(clip, offsets=offsets, end_sites=tips, positions=positions, rotations=rotations)


def tilt(clip: BvhClip, parts: SkeletonParts, up_told: str | None = None) -> float:
    """Degrees by which the whole person is tilted from the file's upward axis in most poses; 0 where it can't be told.

    Told by legs and trunk that lean by over `TILTED` and differ by less than `ALIKE`: who bends or sits leans the trunk
    or the legs, who runs has the trunk upright, and nobody stands leaning as a whole. It is the exporter's tilt then.
    0 also where a frame is taken for the rest pose, since relative to that the person is upright, and for who lies.
    `up_told`: as of `with_standing_rest`.
    """
    _, positions = looked_at(clip)
    own = _own_axis(clip.rest_positions(), parts)
    up = _upward(positions, parts, None)
    played = _upward(positions, parts, own) if up_told is None else np.array(FILE_AXES[up_told])
    if own is None or played @ up < 0.5:
        return 0.0
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


def _axis_name(axis: np.ndarray) -> str:
    index = int(np.abs(axis).argmax())
    return ("-" if axis[index] < 0 else "") + "XYZ"[index]


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
