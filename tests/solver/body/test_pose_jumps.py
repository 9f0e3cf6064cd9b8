"""Poses that can't follow each other: a calibration pose ahead of a motion is left out, jumps in its midst refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from body_cases import DEMO_MOTIONS, shared_clips

from tryon_solver.body import BodyModel, BvhClip, parse_bvh, quaternions, retarget
from tryon_solver.body.pose_jumps import find_start, refuse_jumps
from tryon_solver.body.skeletons import RetargetError, SkeletonParts, find_parts
from tryon_solver.body.standing_rest import upward_axis, with_standing_rest

Z_AXIS = np.array([0.0, 0.0, 1.0])


def demo(name: str) -> tuple[BvhClip, SkeletonParts]:
    clip = parse_bvh((DEMO_MOTIONS / f"{name}.bvh").read_text())
    return clip, find_parts(clip.joint_names, clip.parents)


def calibrated(clip: BvhClip, frames: int = 1, root: tuple[float, ...] | None = None) -> BvhClip:
    """The clip behind so many frames of its rest pose, its root at `root` [m] or where the motion begins."""
    positions, rotations = clip.positions[:1].copy(), np.zeros_like(clip.rotations[:1])
    rotations[..., 3] = 1.0
    positions[0, 0] = clip.positions[0, 0] if root is None else root
    return replace(
        clip,
        positions=np.concatenate([np.repeat(positions, frames, axis=0), clip.positions]),
        rotations=np.concatenate([np.repeat(rotations, frames, axis=0), clip.rotations]),
    )


@pytest.mark.long
@pytest.mark.parametrize("root", [None, (0.0, 0.0, 0.0), (4.0, 0.0, 7.0)])
@pytest.mark.parametrize("frames", [1, 3])
@pytest.mark.parametrize("every", [1, 2])
def test_a_calibration_pose_ahead_of_the_motion_is_left_out(
    body: BodyModel, root: tuple[float, ...] | None, frames: int, every: int
) -> None:
    """At 60 and at 30 frames a second, at the place of the motion, at the origin or far away."""
    clip, parts = demo("walk")
    clip = replace(clip, positions=clip.positions[::every], rotations=clip.rotations[::every], dt=every * clip.dt)
    other = calibrated(clip, frames, root)
    start, told = find_start(other, parts)
    assert start == frames
    assert told.startswith("its first frame is" if frames == 1 else f"its first {frames} frames are")
    assert "jumps" in told
    assert told.endswith(f"it begins with frame {frames + 1}")
    one, same = retarget(clip, body), retarget(other, body)
    np.testing.assert_array_equal(one.roots, same.roots)
    np.testing.assert_array_equal(one.rotations, same.rotations)


def test_the_calibration_pose_does_not_tell_the_floor_but_may_serve_as_the_rest_pose() -> None:
    clip, parts = demo("squat")
    rng = np.random.default_rng(3)
    rolls = quaternions.normalise(rng.normal(size=(len(clip.joint_names), 4)))
    other = calibrated(clip, 1, (0.0, -40.0, 0.0))
    positions, rotations = other.world()
    world = quaternions.multiply(rotations, rolls)
    local, moved, offsets = world.copy(), positions.copy(), clip.offsets.copy()
    for joint, parent in enumerate(clip.parents[1:], start=1):
        back = quaternions.conjugate(world[:, parent])
        local[:, joint] = quaternions.multiply(back, world[:, joint])
        moved[:, joint] = quaternions.rotate(back, positions[:, joint] - positions[:, parent])
        offsets[joint] = moved[0, joint]
    heap = replace(other, positions=moved, rotations=local, offsets=offsets)
    start, _ = find_start(heap, parts)
    stood, told = with_standing_rest(heap, parts, None, start)
    assert told.endswith("its frame 1 is taken for its rest pose")
    assert stood.frame_count == clip.frame_count
    np.testing.assert_allclose(np.ptp(stood.rest_positions(), axis=0), np.ptp(clip.rest_positions(), axis=0), atol=1e-9)
    assert upward_axis(other.since(1), parts) == upward_axis(clip, parts)


@pytest.mark.parametrize("path", [*sorted(DEMO_MOTIONS.glob("*.bvh")), *shared_clips()], ids=lambda path: path.stem)
def test_motions_of_people_begin_with_their_first_frame_and_jump_nowhere(path) -> None:
    clip = parse_bvh(path.read_text(), None)
    parts = find_parts(clip.joint_names, clip.parents)
    for since in range(0, clip.frame_count - 20, 7):
        assert find_start(clip.since(since), parts) == (0, "")
    refuse_jumps(clip, parts)


def test_a_still_and_a_pose_that_is_held_long_are_left_as_they_are() -> None:
    clip, parts = demo("walk")
    still = replace(clip, positions=clip.positions[:1], rotations=clip.rotations[:1])
    assert find_start(still, parts) == (0, "")
    refuse_jumps(still, parts)
    long = calibrated(clip, 90)
    assert find_start(long, parts) == (0, "")
    with pytest.raises(RetargetError, match="from frame 90 to frame 91 the joint 'LeftHand' jumps"):
        refuse_jumps(long, parts)


def test_key_poses_far_apart_are_no_jumps() -> None:
    clip, parts = demo("walk")
    keys = replace(calibrated(clip), dt=0.1)
    assert find_start(keys, parts) == (0, "")
    refuse_jumps(keys, parts)


def test_a_limb_that_is_elsewhere_in_the_next_frame_is_refused_by_frame_and_joint(body: BodyModel) -> None:
    clip, _ = demo("walk")
    arm = clip.joint_names.index("LeftArm")
    rotations = clip.rotations.copy()
    rotations[30, arm] = quaternions.from_axis_angle(Z_AXIS, np.pi / 2)
    glitch = replace(clip, rotations=rotations)
    told = r"from frame 30 to frame 31 the joint 'LeftHand' jumps 0\.\d+ m about the pelvis in 0\.0167 s, at 5\d.* m/s"
    with pytest.raises(RetargetError, match=told):
        retarget(glitch, body)
    with pytest.raises(RetargetError, match="from frame 33 to frame 34"):
        retarget(calibrated(glitch, 3), body)
    slow = replace(glitch, dt=0.1)
    assert retarget(slow, body).frame_count == clip.frame_count


RATES = (10.0, 24.0, 30.0, 60.0, 120.0)


def resampled(clip: BvhClip, fps: float) -> BvhClip:
    """The same motion at another rate."""
    times = np.arange(0.0, (clip.frame_count - 1) * clip.dt, 1.0 / fps) / clip.dt
    first = np.minimum(times.astype(int), clip.frame_count - 2)
    share = (times - first)[:, None, None]
    turns = quaternions.slerp(clip.rotations[first], clip.rotations[first + 1], share[..., 0])
    places = (1.0 - share) * clip.positions[first] + share * clip.positions[first + 1]
    return replace(clip, positions=places, rotations=turns, dt=1.0 / fps)


def leaping(clip: BvhClip, frames: slice, metres: float) -> BvhClip:
    positions = clip.positions.copy()
    positions[frames, 0, 0] += metres
    return replace(clip, positions=positions)


def turned(clip: BvhClip, degrees: np.ndarray) -> BvhClip:
    """The clip turned about the vertical by degrees (T,)."""
    turns = quaternions.from_axis_angle(np.array([0.0, 1.0, 0.0]), np.radians(degrees))
    rotations = clip.rotations.copy()
    rotations[:, 0] = quaternions.multiply(turns, rotations[:, 0])
    return replace(clip, rotations=rotations)


@pytest.mark.parametrize("fps", RATES)
@pytest.mark.parametrize("name", ["walk", "squat"])
@pytest.mark.parametrize("count", [1, 1000], ids=["one frame", "to the end"])
def test_a_person_who_is_elsewhere_in_the_next_frame_is_refused_at_any_rate(name: str, fps: float, count: int) -> None:
    clip, parts = demo(name)
    clip = resampled(clip, fps)
    refuse_jumps(clip, parts)
    at = clip.frame_count // 2
    with pytest.raises(RetargetError, match=rf"from frame {at} to frame {at + 1} the pelvis jumps 1\.[12]\d* m in "):
        refuse_jumps(leaping(clip, slice(at, at + count), 1.2), parts)


@pytest.mark.parametrize("fps", [12.0, *RATES[1:]])  # half a turn in a tenth of a second is no faster than a skater
@pytest.mark.parametrize("name", ["walk", "squat"])
@pytest.mark.parametrize("count", [1, 1000], ids=["one frame", "to the end"])
def test_a_person_who_is_turned_round_in_the_next_frame_is_refused_at_any_rate(
    name: str, fps: float, count: int
) -> None:
    clip, parts = demo(name)
    clip = resampled(clip, fps)
    at = clip.frame_count // 2
    degrees = np.zeros(clip.frame_count)
    degrees[at : at + count] = 180.0
    with pytest.raises(RetargetError, match=rf"from frame {at} to frame {at + 1} the trunk turns by 1[78]\d degrees"):
        refuse_jumps(turned(clip, degrees), parts)


@pytest.mark.parametrize("fps", RATES)
def test_who_spins_or_sets_off_as_fast_as_people_can_is_played(fps: float) -> None:
    """A skater's five turns a second, taken up in a second; twelve metres a second, in three."""
    clip, parts = demo("squat")
    clip = resampled(clip, fps)
    time = np.arange(clip.frame_count) * clip.dt
    spin = np.where(time < 1.0, 900.0 * time**2, 900.0 + 1800.0 * (time - 1.0))
    assert find_start(turned(clip, spin), parts) == (0, "")
    refuse_jumps(turned(clip, spin), parts)
    positions = clip.positions.copy()
    positions[:, 0, 2] += np.where(time < 3.0, 2.0 * time**2, 18.0 + 12.0 * (time - 3.0))
    refuse_jumps(replace(clip, positions=positions), parts)


@pytest.mark.parametrize("fps", RATES)
@pytest.mark.parametrize("path", shared_clips(), ids=lambda path: path.stem)
def test_captured_motions_jump_nowhere_at_any_rate(path, fps: float) -> None:
    clip = resampled(parse_bvh(path.read_text(), None), fps)
    parts = find_parts(clip.joint_names, clip.parents)
    assert find_start(clip, parts) == (0, "")
    refuse_jumps(clip, parts)


def test_a_pose_that_is_held_too_long_to_be_left_out_is_refused_at_low_rates_too() -> None:
    """At 24 frames a second its hands come down at less than 30 m/s, as they do in no motion out of a standstill."""
    clip, parts = demo("walk")
    long = calibrated(resampled(clip, 24.0), 36)
    assert find_start(long, parts) == (0, "")
    with pytest.raises(RetargetError, match=r"from frame 36 to frame 37 the joint '\w+' jumps .* m/s; cut the motion"):
        refuse_jumps(long, parts)


def test_a_limb_that_is_elsewhere_for_one_frame_is_refused_at_low_rates_too() -> None:
    clip, parts = demo("walk")
    slow = resampled(clip, 24.0)
    arm = slow.joint_names.index("LeftArm")
    rotations = slow.rotations.copy()
    rotations[12, arm] = quaternions.from_axis_angle(Z_AXIS, np.pi / 2)
    with pytest.raises(RetargetError, match="from frame 12 to frame 13 the joint 'LeftHand' jumps"):
        refuse_jumps(replace(slow, rotations=rotations), parts)
