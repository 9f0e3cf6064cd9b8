"""From a motion on its own skeleton to a motion of the body, by rotation and rest directions.

Every part of the body is turned as its counterpart is turned away from its own rest pose, corrected by the turn that
takes our rest direction of the limb to the source's: `W_ours = W_source C`, `C d_ours = d_source`. So T, A and
legs-spread rest poses all serve, limbs and trunk point where the source's point, and our own bone lengths stay. The
head needs no such correction, since rest poses agree on where ahead is; where a file's does not stand at all, one of
its frames is taken for it, and where it stands along another axis than the poses, it is turned (standing_rest.py).
Sides that names have the wrong way round are swapped (own_sides.py).
Hips that then fold our belly deep into our thighs are bent less (folding.py).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tryon_solver.body import quaternions
from tryon_solver.body.bvh import BvhClip
from tryon_solver.body.feet import floor, foot_correction
from tryon_solver.body.folding import GIVE, unfolded
from tryon_solver.body.model import BodyModel
from tryon_solver.body.motion import Motion, ease
from tryon_solver.body.own_sides import with_own_sides, with_told_facing
from tryon_solver.body.pose_jumps import find_start, refuse_jumps
from tryon_solver.body.root_unit import with_root_unit
from tryon_solver.body.skeletons import SIDES, RetargetError, SkeletonParts, find_parts
from tryon_solver.body.standing_rest import with_standing_rest
from tryon_solver.body.trunk_line import trunk_correction

ARM_CLEARANCE_DEGREES = 18.0  # below 17 our upper arm and trunk cross at the armpit
SHORTEST_BONE = 0.01  # m, a direction is not read off anything shorter


def retarget(
    clip: BvhClip,
    model: BodyModel,
    arm_clearance_degrees: float = ARM_CLEARANCE_DEGREES,
    names: Mapping[str, str] | None = None,
    give: float = GIVE,
    facing: str | None = None,
    up: str | None = None,
) -> Motion:
    """The clip as a motion of `model`, which must have the joints that scripts/make_body.py gives it.

    The motion starts above the origin and stands on y = 0: the lowest point of the soles over the whole clip is there,
    or of the hands where it is all of a handstand, or of the whole body where it is well below these (feet.floor).
    `arm_clearance_degrees`: smallest angle between a hanging upper arm and the trunk, seen from the front; an arm that
    would dig into the trunk is turned out as a whole, since a thinner actor's arms hang closer than ours can.
    0 turns nothing out.
    `give`: how deep [m] the trunk may lie in thighs and shins before it is bent up again (folding.py, which leads hands
    clear of them, too); infinity leaves both as they are.
    `names`: see skeletons.find_parts.
    `facing`: the axis of the file that the person faces along in the first frame, "-z" for one; None to go by knees and
    toes.
    `up`: the axis of the file that is up, one of standing_rest.FILE_AXES; None to find it out.
    Positions of a root in another unit than the bones are mended (root_unit.py).
    A pose for calibration ahead of the motion is left out (pose_jumps.py): the motion has no frame of it.
    Raises RetargetError naming a missing joint, or the frames between which the whole body or a limb jumps elsewhere.
    """
    parts = find_parts(clip.joint_names, clip.parents, names)
    told = None if facing is None else with_told_facing(clip, parts, facing)
    clip, _ = with_root_unit(clip, parts, up)
    start, _ = find_start(clip, parts)
    refuse_jumps(clip, parts, start)
    clip, _ = with_standing_rest(clip, parts, up, start)
    parts, _ = told or with_own_sides(clip, parts)
    source = _Source(clip, parts)
    rest = {name: model.rest_joints[k] for k, name in enumerate(model.joint_names)}
    _refuse_other_rigs(rest)
    turns = _trunk(source, rest)
    for side in SIDES:
        turns |= _arm(source, rest, side, turns["spine_5"], turns[f"{side}_clavicle"], arm_clearance_degrees)
        turns |= _leg(source, rest, side, turns["pelvis"])

    world = np.stack([turns[name] for name in model.joint_names], axis=1)
    world = unfolded(model, world, clip.dt, give)
    local = world.copy()
    local[:, 1:] = quaternions.multiply(quaternions.conjugate(world[:, model.parents[1:]]), world[:, 1:])
    roots = _roots(source, rest, world[:, 0])
    motion = Motion(roots, quaternions.continuous(quaternions.normalise(local)), clip.dt, clip.name)
    roots[:, 1] -= floor(model, motion)[0]
    return Motion(roots, motion.rotations, clip.dt, clip.name)


class _Source:
    """The clip turned to our axes: x to the body's left, y up, z forward."""

    def __init__(self, clip: BvhClip, parts: SkeletonParts) -> None:
        self.parts = parts
        axes = _axes(clip, parts)
        positions, rotations = clip.world()
        vectors = rotations[..., :3] @ axes.T  # a rotation about an axis becomes the rotation about the turned axis
        self.rotations = np.concatenate([vectors, rotations[..., 3:]], axis=-1)
        self.positions = positions @ axes.T
        self.rest = clip.rest_positions() @ axes.T
        self.clip = clip
        self._axes = axes

    def turn(self, part: str) -> np.ndarray:
        """(T, 4): world rotation of a part away from the source's rest pose."""
        return self.rotations[:, self.parts.joints[part]]

    def direction(self, part: str, next_part: str) -> np.ndarray:
        """(3,) m: from one joint to the next in the source's rest pose."""
        joints = self.parts.joints
        bone = self.rest[joints[next_part]] - self.rest[joints[part]]
        if np.linalg.norm(bone) < SHORTEST_BONE:
            raise RetargetError(
                f"joints {self.clip.joint_names[joints[part]]!r} and {self.clip.joint_names[joints[next_part]]!r} are "
                "at one place in the rest pose; a limb needs a length"
            )
        return bone

    def hand_direction(self, side: str) -> np.ndarray | None:
        """(3,) m: from the wrist to the middle of the knuckles at rest; None when the hand is a bare joint."""
        hand = self.parts.joints[f"{side}_hand"]
        bones = []
        for child in np.flatnonzero(self.clip.parents == hand):
            if "thumb" not in self.clip.joint_names[child].lower():
                bones += self._first_far_point(int(child), hand)
        if hand in self.clip.end_sites:
            bones.append(self._axes @ self.clip.end_sites[hand])
        bones = [bone for bone in bones if np.linalg.norm(bone) > SHORTEST_BONE]
        return np.mean(bones, axis=0) if bones else None

    def _first_far_point(self, joint: int, origin: int) -> list[np.ndarray]:
        bone = self.rest[joint] - self.rest[origin]
        if np.linalg.norm(bone) > SHORTEST_BONE:
            return [bone]
        return [
            far
            for child in np.flatnonzero(self.clip.parents == joint)
            for far in self._first_far_point(int(child), origin)
        ]


def _axes(clip: BvhClip, parts: SkeletonParts) -> np.ndarray:
    """(3, 3): orthonormal rows, the body's left, up and forward at rest in the clip's axes.

    Up is a coordinate axis, since a trunk that leans at rest is still measured from the vertical. The facing is the
    rest pose's own, square to the line of its hips and shoulders: a skeleton may stand at any angle about the vertical.
    """
    rest, joints = clip.rest_positions(), parts.joints
    left = rest[joints["left_thigh"]] - rest[joints["right_thigh"]]
    left = left + rest[joints["left_upper_arm"]] - rest[joints["right_upper_arm"]]
    up = rest[joints["left_upper_arm"]] + rest[joints["right_upper_arm"]]
    up = up - rest[joints["left_foot"]] - rest[joints["right_foot"]]
    axis = int(np.abs(up).argmax())
    upward = np.sign(up[axis]) * np.eye(3)[axis]
    level = left - (left @ upward) * upward
    width = float(np.linalg.norm(level))
    if not upward.any() or width < SHORTEST_BONE or abs(left @ upward) > width:
        raise RetargetError("the rest pose does not stand upright; export it in a T or A pose")
    return np.stack([level / width, upward, np.cross(level / width, upward)])


def _trunk(source: _Source, rest: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """World turns of pelvis, spine, neck and head; the source's are spread over ours by their place along the trunk.

    The trunk as a whole, from the hips to the shoulders, points where the source's points; the head looks where it
    looks, and the neck makes up the difference.
    """
    joints, parts = source.parts.joints, source.parts
    to_trunk = trunk_correction(rest, {part: source.rest[joint] for part, joint in joints.items()})

    def corrected(turn: np.ndarray, share: float = 1.0) -> np.ndarray:
        return quaternions.multiply(turn, _share(np.broadcast_to(to_trunk, turn.shape), share))

    turns = {"pelvis": corrected(source.turn("pelvis")), "head": source.turn("head")}
    shoulders = 0.5 * (source.rest[joints["left_upper_arm"]] + source.rest[joints["right_upper_arm"]])
    spine = [f"spine_{k}" for k in range(1, 6)]
    keys = [(0.0, turns["pelvis"])]
    chain = [*source.rest[list(parts.spine)], shoulders]
    keys += _keys(source.rest[joints["pelvis"]], chain, [corrected(source.rotations[:, j]) for j in parts.spine])
    ours = 0.5 * (rest["left_upper_arm"] + rest["right_upper_arm"])
    turns |= _spread(keys, spine, rest["pelvis"], [*(rest[name] for name in spine), ours])

    neck = [f"neck_{k}" for k in range(1, 4)]
    chest = corrected(source.rotations[:, parts.spine[-1]]) if parts.spine else turns["pelvis"]
    start = source.rest[parts.neck[0]] if parts.neck else shoulders
    chain = [*source.rest[list(parts.neck)], source.rest[joints["head"]]]
    between = _keys(start, chain, [source.rotations[:, j] for j in parts.neck])
    keys = [(0.0, chest), *((k, corrected(turn, 1.0 - k)) for k, turn in between), (1.0, turns["head"])]
    turns |= _spread(keys, neck, rest["neck_1"], [*(rest[name] for name in neck), rest["head"]])

    for side in SIDES:
        carried = corrected(source.rotations[:, parts.clavicles[side]]) if side in parts.clavicles else chest
        turns |= {f"{side}_clavicle": carried, f"{side}_shoulder": carried}
    return turns


def _keys(start: np.ndarray, chain: list[np.ndarray], turns: list[np.ndarray]) -> list[tuple[float, np.ndarray]]:
    """(place in (0, 1), turn) of each bone of a chain of joints: a bone's place is its middle, by length along it."""
    return list(zip(_places(start, chain), turns))


def _places(start: np.ndarray, chain: list[np.ndarray]) -> np.ndarray:
    """(bones,): middles of the bones chain[k] - chain[k + 1], as a share of the way from `start` to the end."""
    along = np.cumsum([np.linalg.norm(b - a) for a, b in zip([start, *chain[:-1]], chain)])
    return 0.5 * (along[:-1] + along[1:]) / max(along[-1], 1e-9)


def _spread(
    keys: list[tuple[float, np.ndarray]], names: list[str], start: np.ndarray, chain: list[np.ndarray]
) -> dict[str, np.ndarray]:
    """Turns of our joints `names` along `chain`, interpolated between the source's turns at their places."""
    places = np.array([place for place, _ in keys])
    spread = {}
    for name, place in zip(names, _places(start, chain)):
        k = int(np.searchsorted(places, place, side="right")) - 1
        if k + 1 == len(keys):
            spread[name] = keys[-1][1]
        else:
            share = (place - places[k]) / (places[k + 1] - places[k])
            spread[name] = quaternions.slerp(keys[k][1], keys[k + 1][1], share)
    return spread


def _arm(
    source: _Source,
    rest: Mapping[str, np.ndarray],
    side: str,
    chest: np.ndarray,
    carrier: np.ndarray,
    clearance_degrees: float,
) -> dict[str, np.ndarray]:
    """World turns of an arm, turned out from the trunk where it would dig in, its twist spread along it."""
    upper, fore, hand = f"{side}_upper_arm", f"{side}_forearm", f"{side}_hand"
    axis_upper, axis_fore = rest[fore] - rest[upper], rest[hand] - rest[fore]
    to_upper = _correction(quaternions.IDENTITY, axis_upper, source.direction(upper, fore))
    to_fore = _correction(to_upper, axis_fore, source.direction(fore, hand))
    knuckles = source.hand_direction(side)
    to_hand = to_fore if knuckles is None else _correction(to_fore, rest[f"{side}_fingers"] - rest[hand], knuckles)
    turn_upper = quaternions.multiply(source.turn(upper), to_upper)
    out = _arm_push(turn_upper, axis_upper, chest, side, clearance_degrees)
    turn_upper = quaternions.multiply(out, turn_upper)
    turn_fore = quaternions.multiply(out, quaternions.multiply(source.turn(fore), to_fore))
    turn_hand = quaternions.multiply(out, quaternions.multiply(source.turn(hand), to_hand))
    return {
        upper: _half_twisted(carrier, turn_upper, axis_upper),
        f"{upper}_twist": turn_upper,
        **_twisted_segment(fore, turn_upper, turn_fore, turn_hand, axis_fore),
        hand: turn_hand,
        f"{side}_fingers": turn_hand,
    }


def _leg(source: _Source, rest: Mapping[str, np.ndarray], side: str, pelvis: np.ndarray) -> dict[str, np.ndarray]:
    """World turns of a leg; the foot's direction is corrected about the vertical only, soles being flat at rest."""
    thigh, shin, foot = f"{side}_thigh", f"{side}_shin", f"{side}_foot"
    axis_thigh, axis_shin = rest[shin] - rest[thigh], rest[foot] - rest[shin]
    to_thigh = _correction(quaternions.IDENTITY, axis_thigh, source.direction(thigh, shin))
    to_shin = _correction(to_thigh, axis_shin, source.direction(shin, foot))
    turn_thigh = quaternions.multiply(source.turn(thigh), to_thigh)
    turn_shin = quaternions.multiply(source.turn(shin), to_shin)
    has_toes = f"{side}_toes" in source.parts.joints
    pointing = source.direction(foot, f"{side}_toes") if has_toes else np.array([0.0, 0.0, 1.0])
    to_foot = foot_correction(
        pointing,
        rest[f"{side}_toes"] - rest[foot],
        source.direction(shin, foot),
        source.positions[:, source.parts.joints[foot]],
        source.turn(foot),
        source.clip.dt,
    )
    turn_foot = quaternions.multiply(source.turn(foot), to_foot)
    turn_toes = quaternions.multiply(source.turn(f"{side}_toes"), to_foot) if has_toes else turn_foot
    return {
        thigh: _half_twisted(pelvis, turn_thigh, axis_thigh),
        f"{thigh}_twist": turn_thigh,
        **_twisted_segment(shin, turn_thigh, turn_shin, turn_foot, axis_shin),
        foot: turn_foot,
        f"{side}_toes": turn_toes,
    }


def _correction(above: np.ndarray, ours: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    """(4,): the turn that takes our rest direction of a limb to the source's.

    It goes on from the correction of the limb `above`, so that only the joint between them is bent: our half bent
    elbow is then straightened about its own hinge, and the palm ends up facing where the source's does.
    """
    return quaternions.multiply(quaternions.between(quaternions.rotate(above, ours), theirs), above)


def _half_twisted(carrier: np.ndarray, turn: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """`turn` with only half of its twist about `axis` relative to `carrier`: the joint next to shoulder or hip."""
    twist = _relative_twist(carrier, turn, axis)
    return quaternions.multiply(turn, quaternions.conjugate(_share(twist, 0.5)))


def _twisted_segment(
    name: str, above: np.ndarray, turn: np.ndarray, below: np.ndarray, axis: np.ndarray
) -> dict[str, np.ndarray]:
    """Forearm or shin: the twist between elbow and hand (knee and foot) in thirds, next to none of it at the elbow."""
    own = _relative_twist(above, turn, axis)
    whole = quaternions.multiply(own, _relative_twist(turn, below, axis))
    untwisted = quaternions.multiply(turn, quaternions.conjugate(own))
    return {
        name: quaternions.multiply(untwisted, _share(whole, 1 / 3)),
        f"{name}_twist": quaternions.multiply(untwisted, _share(whole, 2 / 3)),
    }


def _relative_twist(above: np.ndarray, turn: np.ndarray, axis: np.ndarray) -> np.ndarray:
    relative = quaternions.multiply(quaternions.conjugate(above), turn)
    return quaternions.twist_about(relative, axis / np.linalg.norm(axis))


def _share(turn: np.ndarray, share: float) -> np.ndarray:
    return quaternions.slerp(np.broadcast_to(quaternions.IDENTITY, turn.shape), turn, share)


def _arm_push(
    turn_upper: np.ndarray, axis: np.ndarray, chest: np.ndarray, side: str, clearance_degrees: float
) -> np.ndarray:
    """(T, 4): world turns about the chest's forward axis that give a hanging arm its clearance.

    With d the upper arm's direction in the chest's frame, its angle from straight down, seen from the front, is
    atan2(d_out, -d_up). What is missing to the clearance is added through a soft maximum (2 degrees wide, so that
    nothing starts abruptly): all of it up to 45 degrees from hanging, nothing for an arm at or above the horizontal.
    """
    outward = 1.0 if side == "left" else -1.0
    relative = quaternions.multiply(quaternions.conjugate(chest), turn_upper)
    d = quaternions.rotate(relative, np.broadcast_to(axis / np.linalg.norm(axis), (len(relative), 3)))
    angle = np.arctan2(outward * d[:, 0], -d[:, 1])
    width = np.radians(2.0)
    missing = width * np.logaddexp(0.0, (np.radians(clearance_degrees) - angle) / width)
    hanging = ease(-d[:, 1] / np.cos(np.pi / 4)) if clearance_degrees > 0.0 else np.zeros(len(d))
    forward = np.broadcast_to(np.array([0.0, 0.0, 1.0]), d.shape)
    push = quaternions.from_axis_angle(forward, outward * missing * hanging)
    return quaternions.multiply(quaternions.multiply(chest, push), quaternions.conjugate(chest))


def _roots(source: _Source, rest: Mapping[str, np.ndarray], pelvis: np.ndarray) -> np.ndarray:
    """(T, 3) m: root positions that carry the middle of our hips along the source's, scaled by leg length."""
    joints = source.parts.joints
    sides = [(f"{side}_thigh", f"{side}_shin", f"{side}_foot") for side in SIDES]
    lengths = [
        sum(np.linalg.norm(place[b] - place[a]) + np.linalg.norm(place[c] - place[b]) for a, b, c in sides)
        for place in (rest, {part: source.rest[joint] for part, joint in joints.items()})
    ]
    hips = 0.5 * (source.positions[:, joints["left_thigh"]] + source.positions[:, joints["right_thigh"]])
    hips = hips * (lengths[0] / lengths[1])
    hips[:, [0, 2]] -= hips[0, [0, 2]]
    centre = 0.5 * (rest["left_thigh"] + rest["right_thigh"]) - rest["pelvis"]
    return hips - quaternions.rotate(pelvis, np.broadcast_to(centre, hips.shape))


def _refuse_other_rigs(rest: Mapping[str, np.ndarray]) -> None:
    limbs = ["clavicle", "shoulder", "upper_arm", "upper_arm_twist", "forearm", "forearm_twist", "hand", "fingers"]
    limbs += ["thigh", "thigh_twist", "shin", "shin_twist", "foot", "toes"]
    wanted = ["pelvis", *(f"spine_{k}" for k in range(1, 6)), *(f"neck_{k}" for k in range(1, 4)), "head"]
    wanted += [f"{side}_{limb}" for side in SIDES for limb in limbs]
    missing = [name for name in wanted if name not in rest]
    extra = [name for name in rest if name not in wanted]
    if missing or extra:
        what = f"lacks the joint {missing[0]!r}" if missing else f"has the unknown joint {extra[0]!r}"
        raise RetargetError(f"the body {what}; retargeting needs the rig of scripts/make_body.py")
