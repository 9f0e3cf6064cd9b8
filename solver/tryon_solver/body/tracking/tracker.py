"""One tracker's poses as poses of our body: directions where points tell them, turns away from rest where those do.

Limbs point where the source's point, our own bone lengths stay. How a limb is twisted comes from the source's turns
away from its rest pose, as in retarget.py; a source of points alone tells it by the plane in which elbow or knee bends.
"""

from __future__ import annotations

import numpy as np

from tryon_solver.body import quaternions
from tryon_solver.body.model import BodyModel
from tryon_solver.body.motion import ease
from tryon_solver.body.pose import Pose, world_from_joint
from tryon_solver.body.tracking.conventions import read_with
from tryon_solver.body.tracking.frames import frame, matrix_to_quaternion, swing
from tryon_solver.body.tracking.observation import LIMBS, SIDES, Observation, Sample, SourceSkeleton, TrackingError
from tryon_solver.body.tracking.palms import back_of_hand
from tryon_solver.body.tracking.standing import complete

ARM_CLEARANCE = np.radians(18.0)  # as in retarget.py: below 17 degrees our upper arm and trunk cross at the armpit
BENT = (0.1, 0.4)  # sine of a limb's bend: below the first its plane says nothing, above the second all
SHORTEST_BONE = 0.01  # m, a direction is not read off anything shorter
SPINE = tuple(f"spine_{k}" for k in range(1, 6))
NECK = tuple(f"neck_{k}" for k in range(1, 4))
TRUNK = ("left_thigh", "right_thigh", "left_upper_arm", "right_upper_arm", "waist")
LEFT = np.array([1.0, 0.0, 0.0])
# Per limb: the joint it hangs on, its three joints, the joints that carry half and thirds of its twist, and its end.
JOINTS = {
    "arm": ("upper_arm", "forearm", "hand", "upper_arm_twist", "forearm_twist", "fingers"),
    "leg": ("thigh", "shin", "foot", "thigh_twist", "shin_twist", "toes"),
}


def fits(joint_names: tuple[str, ...]) -> bool:
    """Whether a body with these joints can follow trackers: it has the rig of scripts/make_body.py."""
    wanted = {"pelvis", *SPINE, *NECK, "head"}
    for side in SIDES:
        wanted |= {f"{side}_clavicle", f"{side}_shoulder"}
        wanted |= {f"{side}_{part}" for parts in JOINTS.values() for part in parts}
    return wanted == set(joint_names)


class Tracker:
    """Follows one tracker with one body.

    Raises TrackingError when the body has another rig, or the skeleton lacks something its convention needs.
    """

    def __init__(self, model: BodyModel, skeleton: SourceSkeleton) -> None:
        if not fits(model.joint_names):
            raise TrackingError("this body has not the rig of scripts/make_body.py; send poses as model-local")
        self._model = model
        self._read = read_with(skeleton, model)
        self._rest = {name: model.rest_joints[k] for name, k in model.index_of.items()}
        rest = self._rest
        self._limbs = [(limb.partition("_")[0], JOINTS[limb.partition("_")[2]]) for limb in LIMBS]
        self._upper = self._bones(0, 1)
        self._lower = self._bones(1, 2)
        self._end = self._bones(2, 5)
        self._hinge = np.cross(self._upper, self._lower)
        self._hinge[2:] = LEFT  # knees are nearly straight at rest: they bend about the axis to the left
        self._backs = {side: back_of_hand(model, side) for side in SIDES}
        self._spine_places = _places(
            [rest[name] for name in SPINE], 0.5 * (rest["left_upper_arm"] + rest["right_upper_arm"])
        )
        self._neck_places = _places([rest[name] for name in NECK], rest["head"])
        self._twist = np.zeros(4)  # rad, of limbs known by points alone: held while they are straight
        self._directions = (self._upper.copy(), self._lower.copy())
        self._trunk = {"pelvis": quaternions.IDENTITY, "chest": quaternions.IDENTITY}

    def pose(self, sample: Sample) -> Pose:
        """The pose of our body for one of the tracker's. Bones that have no length in it keep their last direction."""
        seen = self._read(sample)
        if seen.stride != 1.0:
            seen.points = {part: seen.stride * point for part, point in seen.points.items()}
        complete(seen, self._rest)
        pelvis, chest = self._trunk_turn(seen, "pelvis"), self._trunk_turn(seen, "chest")
        head = seen.turns.get("head", chest)
        turns = {"pelvis": pelvis, "head": head}
        turns |= dict(zip(SPINE, quaternions.slerp(pelvis[None], chest[None], self._spine_places)))
        turns |= dict(zip(NECK, quaternions.slerp(chest[None], head[None], self._neck_places)))
        for side in SIDES:
            carried = seen.turns.get(f"{side}_clavicle", chest)
            turns |= {f"{side}_clavicle": carried, f"{side}_shoulder": carried}
        turns |= self._limb_turns(seen, turns, pelvis, chest)
        return self._placed(seen, np.stack([turns[name] for name in self._model.joint_names]))

    def _bones(self, a: int, b: int) -> np.ndarray:
        """(4, 3) m: from joint a to joint b of each limb at rest."""
        return np.array(
            [self._rest[f"{side}_{parts[b]}"] - self._rest[f"{side}_{parts[a]}"] for side, parts in self._limbs]
        )

    def _trunk_turn(self, seen: Observation, part: str) -> np.ndarray:
        """(4,): pelvis or chest, by its turn or else by the line between hips or shoulders and the spine beside it."""
        if part in seen.turns:
            return seen.turns[part]
        now, then = _trunk_frame(seen.points, part), _trunk_frame(self._rest_of(seen), part)
        if now is not None and then is not None:
            self._trunk[part] = matrix_to_quaternion(now @ then.T)
        return self._trunk[part]

    def _rest_of(self, seen: Observation) -> dict[str, np.ndarray]:
        """The trunk's points at rest: the source's own where it told them, else ours."""
        wanted = {part for part in TRUNK if part in seen.points}
        if seen.rest is not None and wanted <= seen.rest.keys():
            return {part: seen.rest[part] for part in wanted}
        return {part: self._rest["spine_3" if part == "waist" else part] for part in wanted}

    # Limbs --------------------------------------------------------------------------------------------------------

    def _limb_turns(
        self, seen: Observation, trunk: dict[str, np.ndarray], pelvis: np.ndarray, chest: np.ndarray
    ) -> dict[str, np.ndarray]:
        upper_now = self._direction(seen, 0, 1)
        lower_now = self._direction(seen, 1, 2)
        carriers = np.stack([trunk["left_clavicle"], trunk["right_clavicle"], pelvis, pelvis])
        upper = self._upper_turns(seen, carriers, upper_now, lower_now)
        lower = self._lower_turns(seen, upper, lower_now)
        end = self._end_turns(seen, lower, lower_now)
        out = self._arm_push(upper[:2], chest)
        upper[:2], lower[:2], end[:2] = (quaternions.multiply(out, turn[:2]) for turn in (upper, lower, end))

        half = _share(_twist(carriers, upper, self._upper), 0.5)
        upper_joint = quaternions.multiply(upper, quaternions.conjugate(half))
        own = _twist(upper, lower, self._lower)
        whole = quaternions.multiply(own, _twist(lower, end, self._lower))
        untwisted = quaternions.multiply(lower, quaternions.conjugate(own))
        thirds = [quaternions.multiply(untwisted, _share(whole, share)) for share in (1 / 3, 2 / 3)]
        turns: dict[str, np.ndarray] = {}
        for limb, (side, parts) in enumerate(self._limbs):
            values = (upper_joint, thirds[0], end, upper, thirds[1], self._beyond(seen, side, parts, end))
            turns |= {f"{side}_{part}": value[limb] for part, value in zip(parts, values)}
        return turns

    def _direction(self, seen: Observation, a: int, b: int) -> np.ndarray:
        """(4, 3) m: from joint a to joint b of each limb now; the last one known where they are at one place."""
        kept = self._directions[a]
        for limb, (side, parts) in enumerate(self._limbs):
            bone = seen.points[f"{side}_{parts[b]}"] - seen.points[f"{side}_{parts[a]}"]
            if np.linalg.norm(bone) > SHORTEST_BONE:
                kept[limb] = bone
        return kept

    def _known(self, seen: Observation, k: int) -> tuple[np.ndarray, np.ndarray]:
        """(4, 4) turns of the limbs' k-th joints, and (4,) which of them the source tells."""
        turns, told = np.tile(quaternions.IDENTITY, (4, 1)), np.zeros(4, dtype=bool)
        for limb, (side, parts) in enumerate(self._limbs):
            turn = seen.turns.get(f"{side}_{parts[k]}")
            if turn is not None:
                turns[limb], told[limb] = turn, True
        return turns, told

    def _upper_turns(
        self, seen: Observation, carriers: np.ndarray, upper_now: np.ndarray, lower_now: np.ndarray
    ) -> np.ndarray:
        turns, told = self._known(seen, 0)
        turns = _pointed(np.where(told[:, None], turns, carriers), self._upper, upper_now)
        if told.all():
            return turns
        axes = upper_now / np.linalg.norm(upper_now, axis=1, keepdims=True)
        plane = np.cross(axes, lower_now / np.linalg.norm(lower_now, axis=1, keepdims=True))
        bend = np.linalg.norm(plane, axis=1)
        hinge = quaternions.rotate(turns, self._hinge)
        angle = np.arctan2((np.cross(hinge, plane) * axes).sum(axis=1), (hinge * plane).sum(axis=1))
        certain = ease((bend - BENT[0]) / (BENT[1] - BENT[0]))
        self._twist += certain * _wrapped(angle - self._twist)
        twisted = quaternions.multiply(quaternions.from_axis_angle(axes, self._twist), turns)
        return np.where(told[:, None], turns, twisted)

    def _lower_turns(self, seen: Observation, upper: np.ndarray, lower_now: np.ndarray) -> np.ndarray:
        """A forearm's own turn goes on from the correction of the upper arm, so that only the elbow is bent."""
        told_upper, has_upper = self._known(seen, 0)
        told_lower, has_lower = self._known(seen, 1)
        correction = quaternions.multiply(quaternions.conjugate(told_upper), upper)
        own = quaternions.multiply(told_lower, correction)
        return _pointed(np.where((has_upper & has_lower)[:, None], own, upper), self._lower, lower_now)

    def _end_turns(self, seen: Observation, lower: np.ndarray, lower_now: np.ndarray) -> np.ndarray:
        """(4, 4): hands and feet."""
        told_lower, has_lower = self._known(seen, 1)
        ends = lower.copy()
        for limb, (side, parts) in enumerate(self._limbs):
            told = seen.turns.get(f"{side}_{parts[2]}")
            if parts[2] == "foot":
                ends[limb] = self._foot(seen, side, told, lower[limb], lower_now[limb])
            elif told is not None and has_lower[limb]:
                correction = quaternions.multiply(quaternions.conjugate(told_lower[limb]), lower[limb])
                ends[limb] = quaternions.multiply(told, correction)
            else:
                ends[limb] = self._hand(seen, side, lower[limb])
        return ends

    def _hand(self, seen: Observation, side: str, lower: np.ndarray) -> np.ndarray:
        palm = seen.palms.get(side) or _palm(seen, side)
        if palm is None:
            return lower
        limb = SIDES.index(side)
        now, then = frame(*palm), frame(self._end[limb], self._backs[side])
        return lower if now is None or then is None else matrix_to_quaternion(now @ then.T)

    def _foot(
        self, seen: Observation, side: str, told: np.ndarray | None, lower: np.ndarray, shin: np.ndarray
    ) -> np.ndarray:
        """(4,): a told turn is corrected about the vertical only, soles being flat at rest; else by ankle and toes."""
        limb = 2 + SIDES.index(side)
        foot, toes = f"{side}_foot", f"{side}_toes"
        if told is not None:
            if seen.rest is None or toes not in seen.rest:
                return told
            theirs, ours = seen.rest[toes] - seen.rest[foot], self._end[limb]
            angle = np.arctan2(theirs[0], theirs[2]) - np.arctan2(ours[0], ours[2])
            return quaternions.multiply(told, quaternions.from_axis_angle(np.array([0.0, 1.0, 0.0]), angle))
        if toes not in seen.points:
            return lower
        now = frame(seen.points[toes] - seen.points[foot], -shin)
        then = frame(self._end[limb], -self._lower[limb])
        return lower if now is None or then is None else matrix_to_quaternion(now @ then.T)

    def _beyond(self, seen: Observation, side: str, parts: tuple[str, ...], ends: np.ndarray) -> np.ndarray:
        """(4, 4): toes, turned against the foot as the source's are; what it doesn't tell goes with `ends`."""
        foot, toes = seen.turns.get(f"{side}_{parts[2]}"), seen.turns.get(f"{side}_{parts[5]}")
        if foot is None or toes is None:
            return ends
        return quaternions.multiply(toes, quaternions.multiply(quaternions.conjugate(foot), ends))

    def _arm_push(self, upper: np.ndarray, chest: np.ndarray) -> np.ndarray:
        """(2, 4): world turns about the chest's forward axis that give hanging arms their clearance, as in retarget.py:
        all of what is missing up to 45 degrees from hanging, nothing for an arm at or above the horizontal."""
        outward = np.array([1.0, -1.0])
        relative = quaternions.multiply(quaternions.conjugate(chest), upper)
        d = quaternions.rotate(relative, self._upper[:2] / np.linalg.norm(self._upper[:2], axis=1, keepdims=True))
        angle = np.arctan2(outward * d[:, 0], -d[:, 1])
        width = np.radians(2.0)
        missing = width * np.logaddexp(0.0, (ARM_CLEARANCE - angle) / width)
        push = outward * missing * ease(-d[:, 1] / np.cos(np.pi / 4))
        turn = quaternions.from_axis_angle(np.array([0.0, 0.0, 1.0]), push)
        return quaternions.multiply(quaternions.multiply(chest, turn), quaternions.conjugate(chest))

    # Place --------------------------------------------------------------------------------------------------------

    def _placed(self, seen: Observation, world: np.ndarray) -> Pose:
        """The pose of these world turns (J, 4) with our hips where the source's are, or stood on the floor."""
        local = world.copy()
        local[1:] = quaternions.multiply(quaternions.conjugate(world[self._model.parents[1:]]), world[1:])
        local = quaternions.normalise(local)
        hips = 0.5 * (seen.points["left_thigh"] + seen.points["right_thigh"])
        centre = 0.5 * (self._rest["left_thigh"] + self._rest["right_thigh"]) - self._rest["pelvis"]
        root = hips - quaternions.rotate(world[0], centre)
        pose = Pose(root, local)
        if not seen.afloat:
            return pose
        joints = world_from_joint(self._model, pose)[:, 1, 3]
        feet = [self._model.index_of[f"{side}_{part}"] for side in SIDES for part in ("foot", "toes")]
        lowest = float((joints[feet] - self._model.rest_joints[feet, 1]).min())
        return Pose(root - np.array([0.0, lowest, 0.0]), local)


def _trunk_frame(points: dict[str, np.ndarray], part: str) -> np.ndarray | None:
    """(3, 3): to the left, and up along the spine; None where the points don't tell."""
    hips = 0.5 * (points["left_thigh"] + points["right_thigh"])
    shoulders = 0.5 * (points["left_upper_arm"] + points["right_upper_arm"])
    waist = points.get("waist")
    if part == "pelvis":
        return frame(points["left_thigh"] - points["right_thigh"], (shoulders if waist is None else waist) - hips)
    across = points["left_upper_arm"] - points["right_upper_arm"]
    return frame(across, shoulders - (hips if waist is None else waist))


def _palm(seen: Observation, side: str) -> tuple[np.ndarray, np.ndarray] | None:
    """Direction of the fingers and out of the back of the hand, by wrist and knuckles."""
    corners = [seen.points.get(f"{side}_{part}") for part in ("hand", "index", "little")]
    if any(corner is None for corner in corners):
        return None
    wrist, index, little = corners
    fingers = 0.5 * (index + little) - wrist  # type: ignore[operator]
    back = np.cross(index - little, fingers)  # type: ignore[operator]
    return fingers, back if side == "left" else -back


def _places(chain: list[np.ndarray], end: np.ndarray) -> np.ndarray:
    """(bones,): middles of the bones of a chain, as a share of the way along it."""
    along = np.concatenate([[0.0], np.cumsum([np.linalg.norm(b - a) for a, b in zip(chain, [*chain[1:], end])])])
    return 0.5 * (along[:-1] + along[1:]) / along[-1]


def _pointed(turns: np.ndarray, ours: np.ndarray, now: np.ndarray) -> np.ndarray:
    """(4, 4): `turns`, swung so that our rest directions `ours` point along `now` (4, 3)."""
    return quaternions.multiply(swing(quaternions.rotate(turns, ours), now), turns)


def _twist(above: np.ndarray, turns: np.ndarray, axes: np.ndarray) -> np.ndarray:
    relative = quaternions.multiply(quaternions.conjugate(above), turns)
    return quaternions.twist_about(relative, axes / np.linalg.norm(axes, axis=1, keepdims=True))


def _share(turns: np.ndarray, share: float) -> np.ndarray:
    return quaternions.slerp(np.broadcast_to(quaternions.IDENTITY, turns.shape), turns, share)


def _wrapped(angles: np.ndarray) -> np.ndarray:
    return (angles + np.pi) % (2.0 * np.pi) - np.pi
