"""Following trackers: the body does what the tracked person does, whatever the tracker calls its joints."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from body_cases import DEMO_MOTIONS
from trackers import followed, mediapipe, smpl, webxr

from tryon_solver.body import BodyModel, Motion, parse_bvh, quaternions, retarget
from tryon_solver.body.feet import world_tracks
from tryon_solver.body.tracking import Sample, SourceSkeleton, Tracker, TrackingError, fits

MOTIONS = ("walk", "squat", "turn", "jumping_jack")
LIMB_JOINTS = [
    f"{side}_{part}" for side in ("left", "right") for part in ("upper_arm", "forearm", "hand", "thigh", "shin", "foot")
]
TURN_AND_SHIFT = (quaternions.from_axis_angle(np.array([0.0, 1.0, 0.0]), 2.1), np.array([3.0, 0.4, -7.0]))


@pytest.fixture(scope="session")
def motions(body: BodyModel) -> dict[str, Motion]:
    """Half a second of each, every sixth frame of which would do but filters need their rate."""
    found = {}
    for name in MOTIONS:
        whole = retarget(parse_bvh((DEMO_MOTIONS / f"{name}.bvh").read_text(), name=name), body)
        found[name] = Motion(whole.roots[::5], whole.rotations[::5], 5 * whole.dt, name)
    return found


def farthest(body: BodyModel, a: Motion, b: Motion, joints: list[str]) -> float:
    """Largest distance [m] between the same joints of two motions."""
    places = [body.index_of[joint] for joint in joints]
    return float(
        np.linalg.norm(world_tracks(body, a)[0][:, places] - world_tracks(body, b)[0][:, places], axis=2).max()
    )


def largest_turn(body: BodyModel, a: Motion, b: Motion, joint: str) -> float:
    """Largest angle [degrees] between the world turns of a joint."""
    one, other = (world_tracks(body, motion)[1][:, body.index_of[joint]] for motion in (a, b))
    return float(np.degrees(quaternions.angle_of(quaternions.multiply(quaternions.conjugate(one), other))).max())


@pytest.mark.parametrize("name", MOTIONS)
def test_webxr_joints_are_followed_by_their_own_rest_pose(
    body: BodyModel, motions: dict[str, Motion], name: str
) -> None:
    """Axes at rest are the tracker's own business: any will do, and give the same poses."""
    motion = motions[name]
    followed_plain = followed(body, *webxr(body, motion, seed=0))
    followed_odd = followed(body, *webxr(body, motion, seed=5))
    np.testing.assert_allclose(followed_odd.roots, followed_plain.roots, atol=1e-9)
    assert farthest(body, followed_odd, followed_plain, list(body.joint_names)) < 1e-9
    assert farthest(body, followed_plain, motion, LIMB_JOINTS) < 0.012
    for joint in ("pelvis", "spine_5", "head", "left_hand", "right_foot", "left_toes"):
        assert largest_turn(body, followed_plain, motion, joint) < 7.0


@pytest.mark.parametrize("name", MOTIONS)
def test_smpl_rotations_are_followed(body: BodyModel, motions: dict[str, Motion], name: str) -> None:
    ours = followed(body, *smpl(body, motions[name]))
    assert farthest(body, ours, motions[name], LIMB_JOINTS) < 0.012
    assert largest_turn(body, ours, motions[name], "head") < 0.1


@pytest.mark.parametrize("name", MOTIONS)
def test_bvh_rotations_are_followed_as_a_file_of_them_is(
    body: BodyModel, motions: dict[str, Motion], name: str
) -> None:
    clip = parse_bvh((DEMO_MOTIONS / f"{name}.bvh").read_text(), name=name)
    parents = tuple(int(parent) for parent in clip.parents)
    skeleton = SourceSkeleton("bvh", "session", clip.joint_names, parents, clip.rest_positions())
    seen = np.ones(len(parents), dtype=bool)
    places = clip.world()[0]
    samples = [Sample(places[t, 0], None, clip.rotations[t], seen) for t in range(0, len(places), 5)]
    ours = followed(body, skeleton, samples)
    file = motions[name]
    moved = Motion(ours.roots + file.roots[0] - ours.roots[0], ours.rotations, ours.dt)
    assert farthest(body, moved, file, LIMB_JOINTS) < 0.012


@pytest.mark.parametrize("name", ["walk", "squat", "turn"])
def test_points_alone_move_the_limbs_and_the_trunk(body: BodyModel, motions: dict[str, Motion], name: str) -> None:
    ours = followed(body, *mediapipe(body, motions[name], image=False))
    assert farthest(body, ours, motions[name], LIMB_JOINTS) < 0.02
    for joint, most in (("pelvis", 8.0), ("spine_5", 8.0), ("left_shin", 12.0), ("right_forearm", 25.0)):
        assert largest_turn(body, ours, motions[name], joint) < most


def test_landmarks_of_an_image_stand_on_the_floor_and_face_the_camera(
    body: BodyModel, motions: dict[str, Motion]
) -> None:
    ours = followed(body, *mediapipe(body, motions["squat"], image=True))
    places, _ = world_tracks(body, ours)
    feet = [body.index_of[f"{side}_{part}"] for side in ("left", "right") for part in ("foot", "toes")]
    above = (places[:, feet, 1] - body.rest_joints[feet, 1]).min(axis=1)
    np.testing.assert_allclose(above, 0.0, atol=1e-9)
    np.testing.assert_allclose(ours.roots[:, [0, 2]], 0.0, atol=0.05)
    assert farthest(body, Motion(motions["squat"].roots, ours.rotations, ours.dt), motions["squat"], LIMB_JOINTS) < 0.03


@pytest.mark.parametrize("convention", ["webxr", "mediapipe"])
def test_who_turns_and_goes_elsewhere_is_followed_there(
    body: BodyModel, motions: dict[str, Motion], convention: str
) -> None:
    turn, shift = TURN_AND_SHIFT
    skeleton, samples = (
        webxr(body, motions["walk"], 3) if convention == "webxr" else mediapipe(body, motions["walk"], image=False)
    )
    elsewhere = [
        Sample(
            None,
            quaternions.rotate(turn, sample.positions) + shift,
            None if sample.rotations is None else quaternions.multiply(turn, sample.rotations),
            sample.tracked,
        )
        for sample in samples
    ]
    here, there = followed(body, skeleton, samples), followed(body, skeleton, elsewhere)
    expected = quaternions.rotate(turn, world_tracks(body, here)[0]) + shift
    np.testing.assert_allclose(world_tracks(body, there)[0], expected, atol=1e-9)


def head_and_hands(body: BodyModel, places: dict[str, np.ndarray], look: np.ndarray) -> Motion:
    names = ("viewer", "left-hand-wrist", "right-hand-wrist")
    skeleton = SourceSkeleton("head-hands", "session", names)
    seen = np.array([name in places for name in names])
    positions = np.array([places.get(name, np.zeros(3)) for name in names])
    rotations = np.tile(quaternions.IDENTITY, (3, 1))
    rotations[0] = look
    return followed(body, skeleton, [Sample(None, positions, rotations, seen)])


def test_head_and_hands_alone_make_an_upright_person(body: BodyModel) -> None:
    """A viewer looks along -Z; so our body, which faces +Z at rest, is turned by half a turn."""
    eyes = np.array([1.0, 1.63, 2.0])
    hands = {"left-hand-wrist": eyes + np.array([-0.25, -0.45, -0.3])}
    hands["right-hand-wrist"] = eyes + np.array([0.22, -0.35, -0.3])
    pose = head_and_hands(body, {"viewer": eyes, **hands}, quaternions.IDENTITY)
    places, turns = (track[0] for track in world_tracks(body, pose))
    at = {name: places[k] for name, k in body.index_of.items()}
    for side in ("left", "right"):
        np.testing.assert_allclose(at[f"{side}_hand"], hands[f"{side}-hand-wrist"], atol=0.02)
        assert at[f"{side}_foot"][1] == pytest.approx(body.rest_joints[body.index_of[f"{side}_foot"]][1], abs=0.02)
        assert at[f"{side}_forearm"][1] < at[f"{side}_upper_arm"][1], "elbows hang"
    assert at["left_thigh"][0] < at["right_thigh"][0], "the left is at -X of who looks along -Z"
    assert np.linalg.norm((at["pelvis"] - eyes)[[0, 2]]) < 0.25
    ahead = quaternions.rotate(turns[body.index_of["pelvis"]], np.array([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(ahead, [0.0, 0.0, -1.0], atol=1e-9)


@pytest.mark.parametrize("pitch", [-85.0, -40.0, 0.0, 40.0, 85.0])
def test_looking_up_or_down_does_not_turn_the_body(body: BodyModel, pitch: float) -> None:
    look = quaternions.from_axis_angle(np.array([1.0, 0.0, 0.0]), np.radians(pitch))
    pose = head_and_hands(body, {"viewer": np.array([0.0, 1.6, 0.0])}, look)
    ahead = quaternions.rotate(world_tracks(body, pose)[1][0, 0], np.array([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(ahead, [0.0, 0.0, -1.0], atol=1e-9)


def test_a_lower_head_bends_the_knees(body: BodyModel) -> None:
    shins = body.index_of["left_shin"]
    angles = []
    for height in (1.62, 1.3):
        pose = head_and_hands(body, {"viewer": np.array([0.0, height, 0.0])}, quaternions.IDENTITY)
        angles.append(float(np.degrees(quaternions.angle_of(pose.rotations[0, shins]))))
        foot = world_tracks(body, pose)[0][0, body.index_of["left_foot"]]
        assert foot[1] == pytest.approx(body.rest_joints[body.index_of["left_foot"]][1], abs=0.03)
    assert angles[1] > angles[0] + 20.0


def test_legs_that_are_not_tracked_stand_below_the_hips(body: BodyModel, motions: dict[str, Motion]) -> None:
    skeleton, samples = webxr(body, motions["walk"], seed=2)
    upper = [k for k, name in enumerate(skeleton.joint_names) if "leg" not in name and "foot" not in name]
    assert skeleton.rest_positions is not None
    assert skeleton.rest_rotations is not None
    half = SourceSkeleton(
        "webxr",
        "session",
        tuple(skeleton.joint_names[k] for k in upper),
        rest_positions=skeleton.rest_positions[upper],
        rest_rotations=skeleton.rest_rotations[upper],
    )
    cut = [Sample(None, s.positions[upper], s.rotations[upper], s.tracked[upper]) for s in samples]  # type: ignore[index]
    ours = followed(body, half, cut)
    arms = [joint for joint in LIMB_JOINTS if "hand" in joint or "arm" in joint]
    assert farthest(body, ours, motions["walk"], arms) < 0.06
    places, _ = world_tracks(body, ours)
    for side in ("left", "right"):
        foot = places[:, body.index_of[f"{side}_foot"]]
        assert np.abs(foot[:, 1] - body.rest_joints[body.index_of[f"{side}_foot"]][1]).max() < 0.05


def test_a_joint_at_another_joints_place_keeps_the_limb_as_it_was(body: BodyModel, motions: dict[str, Motion]) -> None:
    skeleton, samples = mediapipe(body, motions["walk"], image=False)
    positions = samples[3].positions.copy()  # type: ignore[union-attr]
    positions[skeleton.joint_names.index("left_wrist")] = positions[skeleton.joint_names.index("left_elbow")]
    broken = [*samples[:3], Sample(None, positions, None, samples[3].tracked)]
    ours = followed(body, skeleton, broken)
    assert np.isfinite(ours.rotations).all()
    assert (
        farthest(
            body,
            Motion(ours.roots[3:], ours.rotations[3:], 1.0),
            Motion(motions["walk"].roots[3:4], motions["walk"].rotations[3:4], 1.0),
            ["left_hand"],
        )
        < 0.08
    )


def test_random_points_never_give_a_broken_pose(body: BodyModel) -> None:
    rng = np.random.default_rng(11)
    skeleton, samples = mediapipe(
        body, Motion(np.zeros((1, 3)), np.tile(quaternions.IDENTITY, (1, body.joint_count, 1)), 1.0), False
    )
    noise = [
        Sample(None, rng.normal(0.0, 1.0, samples[0].positions.shape), None, samples[0].tracked) for _ in range(200)
    ]  # type: ignore[union-attr]
    noise.append(Sample(None, np.zeros(samples[0].positions.shape), None, samples[0].tracked))  # type: ignore[union-attr]
    ours = followed(body, skeleton, noise)
    for t in range(ours.frame_count):
        ours.pose(t).validate(body)


def test_what_can_not_be_followed_says_why(body: BodyModel, finger: BodyModel) -> None:
    assert fits(body.joint_names)
    assert not fits(finger.joint_names)
    with pytest.raises(TrackingError, match="model-local"):
        Tracker(finger, SourceSkeleton("head-hands", "session", ("viewer",)))
    few = SourceSkeleton("bvh", "session", ("Hips", "Head", "LeftArm"), (-1, 0, 0), np.zeros((3, 3)))
    with pytest.raises(TrackingError, match="left_forearm"):
        Tracker(body, few)
    clip = parse_bvh((DEMO_MOTIONS / "walk.bvh").read_text())
    loop = (-1, 2, 1, *(int(parent) for parent in clip.parents[3:]))
    looped = SourceSkeleton("bvh", "session", clip.joint_names, loop, clip.rest_positions())
    with pytest.raises(TrackingError, match="ancestor") as caught:
        Tracker(body, looped)
    assert caught.value.field == "parents"
    with pytest.raises(TrackingError, match="kinect"):
        Tracker(body, SourceSkeleton("kinect", "session", ("a",)))


@pytest.mark.parametrize(
    ("to", "told"),
    [
        (np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]), "trunk points up along .Z"),  # Z up
        (np.diag([-1.0, 1.0, -1.0]), "left side is on the side of -X"),  # facing -Z
        (np.diag([-1.0, 1.0, 1.0]), "left side is on the side of -X"),  # mirrored
        (np.diag([1.0, -1.0, -1.0]), "trunk points up along -Y"),
        (np.zeros((3, 3)), "trunk points up along nothing"),
    ],
)
def test_a_rest_pose_that_does_not_stand_as_it_must_is_refused(body: BodyModel, to: np.ndarray, told: str) -> None:
    clip = parse_bvh((DEMO_MOTIONS / "walk.bvh").read_text())
    parents, rest = tuple(int(parent) for parent in clip.parents), clip.rest_positions()
    Tracker(body, SourceSkeleton("bvh", "session", clip.joint_names, parents, rest))
    with pytest.raises(TrackingError, match=told) as caught:
        Tracker(body, SourceSkeleton("bvh", "session", clip.joint_names, parents, rest @ to.T))
    assert caught.value.field == "rest_positions"
    watched, _ = webxr(body, Motion(np.zeros((1, 3)), np.tile(body_rest(body), (1, 1, 1)), 1.0), 0)
    assert watched.rest_positions is not None
    with pytest.raises(TrackingError, match=told):
        Tracker(body, replace(watched, rest_positions=watched.rest_positions @ to.T))


def body_rest(body: BodyModel) -> np.ndarray:
    return np.tile(quaternions.IDENTITY, (body.joint_count, 1))
