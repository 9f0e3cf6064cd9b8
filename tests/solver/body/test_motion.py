"""Motions: sampling, closing loops, entering from another pose."""

from __future__ import annotations

import numpy as np
import pytest
from body_cases import DEMO_MOTIONS

from tryon_solver.body import BodyModel, Motion, MotionError, Pose, blend_in, parse_bvh, quaternions, retarget
from tryon_solver.body import motion as motion_module

X_AXIS = np.array([1.0, 0.0, 0.0])


def swinging(frames: int = 61, open_by: float = 0.0, travel: float = 0.0) -> Motion:
    """One joint swinging once in a second at 60 Hz; it ends `open_by` radians and `travel` metres off its beginning."""
    t = np.linspace(0.0, 1.0, frames)
    angles = 0.5 * np.sin(2.0 * np.pi * t) + open_by * t
    roots = np.stack([np.zeros_like(t), np.ones_like(t), travel * t], axis=1)
    return Motion(roots, quaternions.from_axis_angle(X_AXIS, angles)[:, None], 1.0 / (frames - 1), "swing")


def angle(pose: Pose) -> float:
    return 2.0 * float(np.arctan2(pose.rotations[0, 0], pose.rotations[0, 3]))


def test_sampling_at_frames_returns_them_and_between_interpolates() -> None:
    motion = swinging()
    for frame in (0, 1, 30, 60):
        np.testing.assert_allclose(motion.sample(frame * motion.dt).rotations, motion.rotations[frame], atol=1e-12)
    halfway = motion.sample(10.5 * motion.dt)
    expected = 0.5 * (angle(motion.pose(10)) + angle(motion.pose(11)))
    assert angle(halfway) == pytest.approx(expected, abs=1e-9)


def test_outside_the_clip_the_end_poses_hold() -> None:
    motion = swinging(open_by=0.3, travel=1.0)
    np.testing.assert_array_equal(motion.sample(-1.0).root, motion.roots[0])
    np.testing.assert_allclose(motion.sample(99.0).root, motion.roots[-1], atol=1e-12)


def test_closed_loop_is_played_unchanged() -> None:
    motion = swinging()
    for t in np.linspace(0.0, 0.999, 50):
        np.testing.assert_allclose(motion.sample(t, loop=True).rotations, motion.sample(t).rotations, atol=1e-9)
        np.testing.assert_allclose(motion.sample(t + 3.0, loop=True).rotations, motion.sample(t).rotations, atol=1e-9)


@pytest.mark.parametrize(("open_by", "travel"), [(0.4, 0.0), (0.0, 0.5), (-2.0, 2.0)])
def test_open_loop_closes_without_a_jump(open_by: float, travel: float) -> None:
    motion = swinging(open_by=open_by, travel=travel)
    times = np.arange(0.0, 2.5, 0.001)
    poses = [motion.sample(t, loop=True) for t in times]
    roots = np.array([pose.root for pose in poses])
    turns = np.array([pose.rotations[0] for pose in poses])
    steps = quaternions.angle_of(quaternions.multiply(quaternions.conjugate(turns[:-1]), turns[1:]))
    # own speed up to pi + |open_by| rad/s; a smooth fade peaks at 15/8 of its mean
    way, turning = motion.fades()
    peak = np.pi + abs(open_by) + 1.875 * abs(open_by) / turning
    assert steps.max() / 0.001 < 1.01 * peak
    peak = abs(travel) + 1.875 * abs(travel) / way
    assert np.linalg.norm(np.diff(roots, axis=0), axis=1).max() / 0.001 <= 1.01 * peak + 1e-9
    np.testing.assert_allclose(motion.sample(motion.duration - 1e-9, loop=True).root, motion.roots[0], atol=1e-6)


def test_fades_are_as_long_as_what_they_close_takes() -> None:
    assert swinging().fades() == pytest.approx((0.4, 0.4))
    assert swinging(travel=0.6).fades() == pytest.approx((0.8, 0.4))
    assert swinging(open_by=1.5).fades() == pytest.approx((0.4, 1.5 / np.radians(120.0)))
    assert swinging(open_by=3.0, travel=30.0).fades() == pytest.approx((1.0, 1.0)), "no longer than the clip"


def test_a_long_way_back_bends_nobody_in_the_middle_of_the_motion() -> None:
    motion = swinging(open_by=0.3, travel=30.0)
    for t in np.linspace(0.0, 0.6, 13):
        np.testing.assert_allclose(motion.sample(t, loop=True).rotations, motion.sample(t).rotations, atol=1e-12)
    assert np.linalg.norm(motion.sample(0.5, loop=True).root - motion.sample(0.5).root) > 1.0


def test_blend_starts_at_the_pose_and_ends_at_the_first_frame(body: BodyModel) -> None:
    rest = Pose.rest(body)
    rotations = np.tile(rest.rotations, (5, 1, 1))
    rotations[:, 3] = quaternions.from_axis_angle(X_AXIS, np.linspace(1.0, 1.2, 5))
    motion = Motion(np.tile([1.0, 0.9, 0.0], (5, 1)), rotations, 1 / 60)
    blend = blend_in(rest, motion, 0.75)
    assert blend.duration == pytest.approx(0.75)
    np.testing.assert_allclose(blend.roots[0], rest.root)
    np.testing.assert_allclose(blend.rotations[0], rest.rotations, atol=1e-12)
    np.testing.assert_allclose(blend.roots[-1], motion.roots[0], atol=1e-12)
    np.testing.assert_allclose(blend.rotations[-1], motion.rotations[0], atol=1e-12)


def test_blend_starts_at_rest_and_takes_up_the_velocity_of_the_motion() -> None:
    motion = swinging(travel=2.0)
    blend = blend_in(Pose(np.array([0.5, 1.0, 0.0]), quaternions.IDENTITY[None]), motion, 1.0)
    speeds = np.diff(blend.roots, axis=0) / blend.dt
    turning = np.diff([angle(pose) for pose in map(blend.pose, range(blend.frame_count))]) / blend.dt
    assert np.abs(speeds[0]).max() < 0.02
    assert abs(turning[0]) < 0.02
    np.testing.assert_allclose(speeds[-1], [0.0, 0.0, 2.0], atol=0.05)
    assert turning[-1] == pytest.approx(np.pi, rel=0.05)


def begun(speed: float, turning: float) -> Motion:
    """Three joints, the root under way at `speed` [m/s] and one joint turning at `turning` [rad/s] from the start."""
    t = np.arange(30) / 60.0
    rotations = np.tile(quaternions.IDENTITY, (30, 3, 1))
    rotations[:, 1] = quaternions.from_axis_angle(X_AXIS, turning * t)
    return Motion(np.stack([0 * t, 0 * t + 1.0, speed * t], axis=1), rotations, 1.0 / 60.0, "begun")


@pytest.mark.parametrize(("speed", "turning"), [(0.0, 75.0), (0.0, 185.0), (40.0, 0.0), (60.0, 100.0)])
def test_no_limb_whirls_and_no_body_is_thrown_back_to_take_up_a_velocity(speed: float, turning: float) -> None:
    motion = begun(speed, turning)
    blend = blend_in(motion.pose(0), motion, 1.0)
    turned = quaternions.angle_of(blend.rotations[:, 1])
    assert turned.max() < 1.5 + 1e-6
    assert np.linalg.norm(blend.roots - motion.roots[0], axis=1).max() < 0.5 + 1e-6
    assert np.abs(np.diff(turned)).max() <= 1.05 * turning * blend.dt
    np.testing.assert_allclose(blend.roots[-1], motion.roots[0], atol=1e-12)
    np.testing.assert_allclose(blend.rotations[-1], motion.rotations[0], atol=1e-12)


def test_ordinary_motions_are_entered_over_the_whole_onset(body: BodyModel, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither the demo's motions nor a fast run reaches a limit: without any they are entered as exactly."""
    motions = [retarget(parse_bvh(path.read_text()), body) for path in sorted(DEMO_MOTIONS.glob("*.bvh"))]
    assert len(motions) >= 3
    cases = [(Pose.rest(body), motion) for motion in motions]
    run = begun(6.0, 15.0)
    cases.append((run.pose(0), run))
    limited = [blend_in(pose, motion, 1.0) for pose, motion in cases]
    monkeypatch.setattr(motion_module, "ONSET_TURN", np.inf)
    monkeypatch.setattr(motion_module, "ONSET_STEP", np.inf)
    for (pose, motion), entered in zip(cases, limited):
        free = blend_in(pose, motion, 1.0)
        np.testing.assert_array_equal(entered.roots, free.roots)
        np.testing.assert_array_equal(entered.rotations, free.rotations)


@pytest.mark.parametrize("seconds", [0.0, -1.0, float("nan")])
def test_blend_needs_a_time(seconds: float) -> None:
    with pytest.raises(MotionError, match="positive time"):
        blend_in(swinging().pose(0), swinging(), seconds)


@pytest.mark.parametrize(
    ("roots", "rotations", "dt", "message"),
    [
        (np.zeros((0, 3)), np.zeros((0, 1, 4)), 0.1, "with a frame"),
        (np.zeros((2, 3)), np.zeros((3, 1, 4)), 0.1, "with 2 frames"),
        (np.full((2, 3), np.nan), np.zeros((2, 1, 4)), 0.1, "not finite"),
        (np.zeros((2, 3)), np.zeros((2, 1, 4)), 0.0, "dt"),
    ],
)
def test_malformed_motion_is_refused(roots: np.ndarray, rotations: np.ndarray, dt: float, message: str) -> None:
    with pytest.raises(MotionError, match=message):
        Motion(roots, rotations, dt)


def test_time_that_is_not_finite_is_refused() -> None:
    with pytest.raises(MotionError, match="asked for the time nan"):
        swinging().sample(float("nan"), loop=True)


def test_single_frame_is_a_still() -> None:
    still = swinging(2)
    still = Motion(still.roots[:1], still.rotations[:1], 1 / 60)
    np.testing.assert_array_equal(still.sample(5.0, loop=True).root, still.roots[0])
    assert blend_in(still.pose(0), still, 0.5).frame_count == 31
