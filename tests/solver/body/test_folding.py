"""Hips that fold the trunk into the legs are bent less: as far as needed, smoothly, and nothing else is touched."""

from __future__ import annotations

import numpy as np
import pytest
from body_cases import DEMO_MOTIONS, shared_clips
from pinched_skin import PinchedSkin

from tryon_solver.body import BodyModel, BvhClip, parse_bvh, quaternions, retarget, skin
from tryon_solver.body.feet import world_tracks
from tryon_solver.body.folding import ARM, GIVE, LEG, MOST_ABDUCTED, evened, unfolded
from tryon_solver.body.motion import Motion

FRAMES = 121
FOLDED = FRAMES // 2
MEASURED = 0.02  # m: limbs are taken for rods, the skin is not


@pytest.fixture(scope="module")
def bow(body: BodyModel) -> BvhClip:
    """Our own skeleton: it stands, bows until the chest lies in the thighs, and rises again, in two seconds."""
    rotations = np.tile(quaternions.IDENTITY, (FRAMES, body.joint_count, 1))
    bent = np.radians(130.0) * 0.5 * (1.0 - np.cos(np.linspace(0.0, 2.0 * np.pi, FRAMES)))
    forwards = quaternions.from_axis_angle(np.array([1.0, 0.0, 0.0]), bent)
    rotations[:, body.index_of["pelvis"]] = forwards
    for side in ("left", "right"):
        rotations[:, body.index_of[f"{side}_thigh"]] = quaternions.conjugate(forwards)
    offsets = body.rest_joints.copy()
    offsets[1:] -= body.rest_joints[body.parents[1:]]
    positions = np.tile(offsets, (FRAMES, 1, 1))
    return BvhClip(body.joint_names, body.parents, offsets, {}, positions, rotations, 1 / 60)


def depth(body: BodyModel, motion: Motion, frame: int) -> float:
    """How far [m] the deepest skin point inside another part is from that part's skin."""
    return PinchedSkin(body.rest_vertices, body.faces, 0.01).depth(skin(body, motion.pose(frame)))


def test_a_bow_no_longer_folds_the_chest_into_the_thighs(body: BodyModel, bow: BvhClip) -> None:
    assert depth(body, retarget(bow, body, 0.0, give=np.inf), FOLDED) > GIVE + MEASURED
    assert depth(body, retarget(bow, body, 0.0), FOLDED) < GIVE + MEASURED


def test_legs_stay_and_what_is_above_them_turns_as_one(body: BodyModel, bow: BvhClip) -> None:
    plain, bent = (retarget(bow, body, 0.0, give=give) for give in (np.inf, GIVE))
    (before, turned), (after, turned_less) = world_tracks(body, plain), world_tracks(body, bent)
    legs = np.array([name.partition("_")[2] in LEG for name in body.joint_names])
    np.testing.assert_allclose(after[:, legs], before[:, legs], atol=1e-9)
    np.testing.assert_allclose(
        quaternions.to_matrix(turned_less[:, legs]), quaternions.to_matrix(turned[:, legs]), atol=1e-9
    )
    back = quaternions.multiply(turned_less[FOLDED], quaternions.conjugate(turned[FOLDED]))
    angle = np.degrees(quaternions.angle_of(back))
    assert angle[~legs].min() > 10.0
    np.testing.assert_allclose(
        quaternions.to_matrix(back[~legs]), quaternions.to_matrix(back[[0] * (~legs).sum()]), atol=1e-9
    )


def test_it_comes_and_goes_smoothly(body: BodyModel, bow: BvhClip) -> None:
    plain, bent = (world_tracks(body, retarget(bow, body, 0.0, give=give))[1][:, 0] for give in (np.inf, GIVE))
    angle = np.degrees(quaternions.angle_of(quaternions.multiply(bent, quaternions.conjugate(plain))))
    assert angle[0] == angle[-1] == 0.0
    assert angle.max() > 20.0
    assert np.abs(np.diff(angle)).max() < 3.4  # no more than the bow itself turns from frame to frame
    assert np.abs(np.diff(angle, 2)).max() < 1.0


def test_evened_is_nowhere_less_and_has_no_corners() -> None:
    wanted = np.zeros(60)
    wanted[20:24] = [0.2, 0.5, 0.4, 0.1]
    even = evened(wanted, 9)
    assert (even >= wanted).all()
    assert even.max() <= 0.5 + 1e-12
    assert (even[:2] == 0).all()
    assert np.abs(np.diff(even, 2)).max() < 0.5 / 20
    np.testing.assert_allclose(evened(np.full(7, 0.3), 9), 0.3)


def test_motions_that_do_not_fold_are_left_as_they_are(body: BodyModel) -> None:
    clip = parse_bvh((DEMO_MOTIONS / "walk.bvh").read_text())
    _, world = world_tracks(body, retarget(clip, body, give=np.inf))
    assert unfolded(body, world, clip.dt) is world


@pytest.mark.long
def test_captured_motions_fold_no_deeper(body: BodyModel) -> None:
    clips = [path for path in shared_clips() if path.stem.startswith(("bend_scoop", "cartwheel"))]
    if not clips:
        pytest.skip("no captured clips: set TRYON_SHARED_DATA to a folder that holds bvh/*.bvh")
    frames = {"bend_scoop": 70, "cartwheel": 12}
    for path in clips:
        frame = next(k for name, k in frames.items() if path.stem.startswith(name))
        clip = parse_bvh(path.read_text(), name=path.stem)
        assert depth(body, retarget(clip, body, give=np.inf), frame) > GIVE + MEASURED, path.name
        assert depth(body, retarget(clip, body), frame) < GIVE + MEASURED, path.name


def swung_arm(body: BodyModel, degrees: float) -> BvhClip:
    """Our own skeleton: its left arm, swung, comes down by up to `degrees` from our rest pose's, and goes up again."""
    rotations = np.tile(quaternions.IDENTITY, (FRAMES, body.joint_count, 1))
    down = np.radians(degrees) * 0.5 * (1.0 - np.cos(np.linspace(0.0, 2.0 * np.pi, FRAMES)))
    swing = quaternions.from_axis_angle(np.array([1.0, 0.0, 0.0]), np.full(FRAMES, np.radians(30.0)))
    lowered = quaternions.from_axis_angle(np.array([0.0, 0.0, -1.0]), down)
    rotations[:, body.index_of["left_upper_arm"]] = quaternions.multiply(swing, lowered)
    offsets = body.rest_joints.copy()
    offsets[1:] -= body.rest_joints[body.parents[1:]]
    positions = np.tile(offsets, (FRAMES, 1, 1))
    return BvhClip(body.joint_names, body.parents, offsets, {}, positions, rotations, 1 / 60)


def test_a_hand_in_the_thigh_is_led_out_of_it(body: BodyModel) -> None:
    clip = swung_arm(body, 50.0)
    plain, led = (retarget(clip, body, 0.0, give=give) for give in (np.inf, GIVE))
    assert depth(body, led, FOLDED) < depth(body, plain, FOLDED) - MEASURED
    (before, turned), (after, turned_less) = world_tracks(body, plain), world_tracks(body, led)
    arm = np.array([name in {f"left_{part}" for part in ARM} for name in body.joint_names])
    np.testing.assert_allclose(after[:, ~arm], before[:, ~arm], atol=1e-9)
    out = quaternions.multiply(turned_less[:, arm], quaternions.conjugate(turned[:, arm]))
    angle = quaternions.angle_of(out).max(axis=1)
    assert np.radians(1.0) < angle.max() <= MOST_ABDUCTED + 1e-6
    assert angle[[0, -1]].max() < 1e-6
    assert np.abs(np.diff(angle)).max() < np.radians(2.0)


def test_a_hand_beside_the_thigh_is_left_there(body: BodyModel) -> None:
    clip = swung_arm(body, 10.0)
    plain, led = (retarget(clip, body, 0.0, give=give) for give in (np.inf, GIVE))
    np.testing.assert_array_equal(led.rotations, plain.rotations)
