"""Feet in retargeting: which way a source's sole faces at rest, and where the floor is."""

from __future__ import annotations

import numpy as np

from tryon_solver.body import quaternions
from tryon_solver.body.model import BodyModel
from tryon_solver.body.motion import Motion

UP = np.array([0.0, 1.0, 0.0])
STANDING_SPEED = 0.1  # m/s, an ankle slower than this
STANDING_HEIGHT = 0.03  # m, and no higher than this above its lowest place, stands
ON_HANDS = 0.5  # m; who bends down or turns a cartwheel has hands and feet on one floor
SUNK = 0.05  # m that knees, seat or elbows may be below the feet, of a person whose limbs are not as long as ours
FEET, HANDS = ("_foot", "_toes"), ("_hand", "_fingers")
CLEARLY_FLATTER = np.radians(5.0)  # rad


def foot_correction(
    source_pointing: np.ndarray,
    our_pointing: np.ndarray,
    source_shin: np.ndarray,
    ankle: np.ndarray,
    turns: np.ndarray,
    dt: float,
) -> np.ndarray:
    """(4,): the turn from our foot at rest to the source's foot at rest, sole to sole and toes to toes.

    How far the line from ankle to toe slopes says nothing about the sole, so soles are matched, not that line. A rest
    pose has its soles either on the floor or, where spread legs came out of a skeleton's zero angles (CMU), square to
    the shins as seen from the front. The second reading is taken when a standing foot then is clearly flatter.

    `source_pointing`, `our_pointing`: ankle to toes at rest; `source_shin`: knee to ankle at rest (3,);
    `ankle`: (T, 3) m in the world; `turns`: (T, 4) world rotations of the source's foot away from rest.
    """
    square = -source_shin * [1.0, 1.0, 0.0]
    readings = [UP, square / np.linalg.norm(square)]
    speed = np.linalg.norm(np.diff(ankle, axis=0, append=ankle[-1:]), axis=1) / dt
    standing = (speed < STANDING_SPEED) & (ankle[:, 1] < ankle[:, 1].min() + STANDING_HEIGHT)
    slopes = [_mean_slope(turns[standing], sole) for sole in readings]
    sole = readings[int(slopes[1] + CLEARLY_FLATTER < slopes[0])]
    return _frame_turn(UP, our_pointing, sole, source_pointing)


def _mean_slope(turns: np.ndarray, sole: np.ndarray) -> float:
    """Mean angle [rad] between the sole's normal and the vertical; 0 without any frame."""
    if not len(turns):
        return 0.0
    normals = quaternions.rotate(turns, np.broadcast_to(sole, (len(turns), 3)))
    return float(np.arccos(np.clip(normals @ UP, -1.0, 1.0)).mean())


def _frame_turn(up_a: np.ndarray, ahead_a: np.ndarray, up_b: np.ndarray, ahead_b: np.ndarray) -> np.ndarray:
    """(4,): the turn that takes up_a to up_b and, about it, the direction ahead_a to ahead_b."""
    tilt = quaternions.between(up_a, up_b)
    ahead = quaternions.rotate(tilt, ahead_a)
    a, b = (v - up_b * (v @ up_b) for v in (ahead, ahead_b))
    angle = np.arctan2(np.cross(a, b) @ up_b, a @ b)
    return quaternions.multiply(quaternions.from_axis_angle(up_b, angle), tilt)


def floor(model: BodyModel, motion: Motion) -> tuple[float, str]:
    """Height [m] of the floor, and what there is to say of it, for people; "" where feet or hands stand on it.

    It is the lowest point of the feet over the whole motion, or of the hands where they are so far below it that the
    person is on the hands all along. Where another part is more than `SUNK` below that, as the head of who is upside
    down with the arms along the trunk, it is the lowest point of the whole skin.
    """
    positions, turns = world_tracks(model, motion)
    soles, _ = _lowest_point(model, positions, turns, FEET)
    hands, _ = _lowest_point(model, positions, turns, HANDS)
    stood_on = hands if hands < soles - ON_HANDS else soles
    others = tuple(name for name in model.joint_names if not name.endswith(FEET + HANDS))
    lowest, part = _lowest_point(model, positions, turns, others)
    if lowest > stood_on - SUNK:
        return stood_on, ""
    word = "trunk" if part.startswith("spine") else part.removesuffix("_twist").replace("_", " ").rstrip(" 123")
    what = "feet" if stood_on == soles else "hands"
    below = f"{stood_on - lowest:.2f} m below its {what}"
    return min(lowest, hands), f"the floor is under its lowest part, the {word}, {below}"


def _lowest_point(
    model: BodyModel, positions: np.ndarray, turns: np.ndarray, ends: tuple[str, ...]
) -> tuple[float, str]:
    """Height [m] of the lowest point of the skin on the joints whose names end so, over joint tracks (T, J, 3 and 4),
    and the name of its joint.

    Each vertex is carried by the joint that has most of it, which at the sole is all of it.
    """
    strongest = model.skin_joints[:, 0]
    lowest, lowest_name = np.inf, ""
    for joint, name in enumerate(model.joint_names):
        points = model.rest_vertices[strongest == joint] - model.rest_joints[joint]
        if not name.endswith(ends) or not len(points):
            continue
        reach = float(np.linalg.norm(points, axis=1).max())
        near = positions[:, joint, 1] - reach < lowest
        if near.any():
            matrices = quaternions.to_matrix(turns[near, joint])
            height = float((positions[near, joint, 1, None] + matrices[:, 1] @ points.T).min())
            lowest, lowest_name = min((lowest, lowest_name), (height, name))
    return lowest, lowest_name


def world_tracks(model: BodyModel, motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    """World positions (T, J, 3) m and rotations (T, J, 4) of the body's joints in every frame."""
    positions = np.empty((motion.frame_count, model.joint_count, 3))
    turns = motion.rotations.copy()
    positions[:, 0] = motion.roots
    for joint, parent in enumerate(model.parents[1:], start=1):
        offset = np.broadcast_to(model.rest_joints[joint] - model.rest_joints[parent], positions[:, joint].shape)
        positions[:, joint] = positions[:, parent] + quaternions.rotate(turns[:, parent], offset)
        turns[:, joint] = quaternions.multiply(turns[:, parent], motion.rotations[:, joint])
    return positions, turns
