"""Who is tracked standing on the floor stands there with our body too, whatever the tracker tells of its skeleton."""

from __future__ import annotations

import numpy as np
import pytest
from body_cases import DEMO_MOTIONS

from tryon_solver.body import BodyModel, Motion, Pose, parse_bvh, quaternions, retarget, skin
from tryon_solver.body.feet import world_tracks
from tryon_solver.body.tracking import Sample, SourceSkeleton, Tracker
from tryon_solver.body.tracking.conventions import SMPL_JOINTS, SMPL_MIDDLE, SMPL_PARENTS, SMPL_SIDED, sided

ON_THE_FLOOR = 0.01  # m
# A person in SMPL's T pose, of numbers made up: neither our body's nor the average one's, with long shins and big feet.
MIDDLE = {"pelvis": 0.96, "spine1": 1.06, "spine2": 1.19, "spine3": 1.25, "neck": 1.45, "head": 1.53}
LEFT = {
    "hip": (0.08, 0.88, 0.0),
    "knee": (0.11, 0.51, 0.01),
    "ankle": (0.1, 0.075, -0.03),
    "foot": (0.13, 0.016, 0.1),
    "collar": (0.08, 1.35, -0.02),
    "shoulder": (0.18, 1.38, -0.03),
    "elbow": (0.44, 1.37, -0.05),
    "wrist": (0.69, 1.38, -0.05),
    "hand": (0.78, 1.37, -0.06),
}
BONES = {"hip": "knee", "knee": "ankle", "shoulder": "elbow", "elbow": "wrist"}  # joint -> where its bone ends
SEEN = np.ones(len(SMPL_JOINTS), dtype=bool)


def t_pose(size: float) -> np.ndarray:
    """(24, 3) m: that person's joints, over the floor y = 0."""
    places = []
    for name in SMPL_JOINTS:
        side, _, joint = name.partition("_")
        place = np.array(LEFT[joint] if side in ("left", "right") else (0.0, MIDDLE[name], 0.0))
        places.append(size * place * ([-1.0, 1.0, 1.0] if side == "right" else 1.0))
    return np.array(places)


def lowest(body: BodyModel, pose: Pose) -> float:
    """Height [m] of the body's lowest vertex: of its soles, in these poses."""
    return float(skin(body, pose)[:, 1].min())


def performed(body: BodyModel, motion: Motion, size: float, above: np.ndarray) -> list[Sample]:
    """What that person sends while doing what `motion` does, with the lower sole `above` (T,) m over the floor."""
    ours = {joint: part for part, joint in (sided(SMPL_SIDED) | SMPL_MIDDLE).items()}
    ours |= {"spine1": "spine_2", "spine2": "spine_3", "spine3": "spine_5", "neck": "neck_1"}
    ours |= {f"{side}_hand": f"{side}_hand" for side in ("left", "right")}
    rest = t_pose(size)
    index = {name: k for k, name in enumerate(SMPL_JOINTS)}
    _, turns = world_tracks(body, motion)
    world = turns[:, [body.index_of[ours[name]] for name in SMPL_JOINTS]]
    for joint, name in enumerate(SMPL_JOINTS):
        side, _, part = name.partition("_")
        if part in BONES:
            end = f"{side}_{BONES[part]}"
            theirs = rest[index[end]] - rest[joint]
            bone = body.rest_joints[body.index_of[ours[end]]] - body.rest_joints[body.index_of[ours[name]]]
            world[:, joint] = quaternions.multiply(world[:, joint], quaternions.between(*map(unit, (theirs, bone))))
    local, places = world.copy(), np.zeros((*world.shape[:2], 3))
    for joint, parent in enumerate(SMPL_PARENTS[1:], start=1):
        local[:, joint] = quaternions.multiply(quaternions.conjugate(world[:, parent]), world[:, joint])
        offset = np.broadcast_to(rest[joint] - rest[parent], places[:, joint].shape)
        places[:, joint] = places[:, parent] + quaternions.rotate(world[:, parent], offset)
    feet = [index[f"{side}_{part}"] for side in ("left", "right") for part in ("ankle", "foot")]
    soles = (places[:, feet, 1] - rest[feet, 1]).min(axis=1)
    roots = motion.roots.copy()
    roots[:, 1] = above - soles
    return [Sample(root, None, turn, SEEN) for root, turn in zip(roots, local)]


def unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v)


@pytest.mark.parametrize("told", [True, False])
@pytest.mark.parametrize("size", [0.7, 0.9, 1.0, 1.1, 1.2])
def test_an_smpl_person_who_stands_has_the_soles_on_the_floor(body: BodyModel, size: float, told: bool) -> None:
    rest = t_pose(size)
    tracker = Tracker(body, SourceSkeleton("smpl", "session", SMPL_JOINTS, rest_positions=rest if told else None))
    pose = tracker.pose(Sample(rest[0], None, np.tile(quaternions.IDENTITY, (24, 1)), SEEN))
    assert lowest(body, pose) == pytest.approx(0.0, abs=ON_THE_FLOOR)


@pytest.mark.parametrize("size", [0.85, 1.1])
@pytest.mark.parametrize("name", ["walk", "squat", "turn"])
def test_an_smpl_person_without_a_rest_pose_moves_on_the_floor(body: BodyModel, name: str, size: float) -> None:
    """From the first pose on."""
    motion = sparse(body, name)
    tracker = Tracker(body, SourceSkeleton("smpl", "session", SMPL_JOINTS))
    samples = performed(body, motion, size, np.zeros(motion.frame_count))
    soles = np.array([lowest(body, tracker.pose(sample)) for sample in samples])
    assert np.abs(soles).max() < ON_THE_FLOOR


def test_who_jumps_comes_off_the_floor_and_is_no_taller_for_it(body: BodyModel) -> None:
    """Up by 0.3 m; the first pose that comes is in the air."""
    motion = sparse(body, "jumping_jack")
    times = np.arange(motion.frame_count)
    above = np.where(times % 6 < 3, 0.3, 0.0)
    tracker = Tracker(body, SourceSkeleton("smpl", "session", SMPL_JOINTS))
    poses = [tracker.pose(sample) for sample in performed(body, motion, 1.0, above)]
    soles = np.array([lowest(body, pose) for pose in poses])[6:]
    np.testing.assert_allclose(soles[above[6:] == 0.0], 0.0, atol=ON_THE_FLOOR)
    np.testing.assert_allclose(soles[above[6:] > 0.0], 0.3, atol=0.05)


def test_a_tracker_that_loses_the_floor_for_a_moment_leaves_the_body_on_it(body: BodyModel) -> None:
    """Three poses in a hundred are 0.2 m too low; who stood before stands there afterwards."""
    rest = t_pose(1.0)
    tracker = Tracker(body, SourceSkeleton("smpl", "session", SMPL_JOINTS))
    turns = np.tile(quaternions.IDENTITY, (24, 1))
    for k in range(100):
        tracker.pose(Sample(rest[0] - [0.0, 0.2 * (50 <= k < 53), 0.0], None, turns, SEEN))
    assert lowest(body, tracker.pose(Sample(rest[0], None, turns, SEEN))) == pytest.approx(0.0, abs=ON_THE_FLOOR)


def test_a_root_that_is_not_over_the_floor_says_nothing_of_the_size(body: BodyModel) -> None:
    """Trackers with the origin between the hips: the body is then where they say, of average size."""
    rest = t_pose(1.0)
    turns = np.tile(quaternions.IDENTITY, (24, 1))
    skeleton = SourceSkeleton("smpl", "session", SMPL_JOINTS)
    origin = Tracker(body, skeleton).pose(Sample(np.zeros(3), None, turns, SEEN))
    over = Tracker(body, skeleton).pose(Sample(np.array([2.0, 0.0, -3.0]), None, turns, SEEN))
    np.testing.assert_allclose(over.root - origin.root, [2.0, 0.0, -3.0], atol=1e-9)
    assert lowest(body, origin) == pytest.approx(-rest[0, 1], abs=0.1)


def sparse(body: BodyModel, name: str) -> Motion:
    whole = retarget(parse_bvh((DEMO_MOTIONS / f"{name}.bvh").read_text(), name=name), body)
    return Motion(whole.roots[::10], whole.rotations[::10], 10 * whole.dt, name)
