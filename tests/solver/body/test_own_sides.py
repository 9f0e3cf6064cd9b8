"""A body whose names have left and right the wrong way round is played by the sides that it has, and says so."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from body_cases import DEMO_MOTIONS, shared_clips

from tryon_solver.body import BodyModel, BvhClip, RetargetError, parse_bvh, quaternions, retarget
from tryon_solver.body.feet import world_tracks
from tryon_solver.body.own_sides import with_own_sides, with_told_facing
from tryon_solver.body.skeletons import find_parts
from tryon_solver.body.standing_rest import with_standing_rest

ACROSS = np.array([-1.0, 1.0, 1.0])
OTHER = {"Left": "Right", "Right": "Left"}


def demo(name: str) -> BvhClip:
    return parse_bvh((DEMO_MOTIONS / f"{name}.bvh").read_text())


def misnamed(clip: BvhClip) -> BvhClip:
    names = [next((name.replace(a, b) for a, b in OTHER.items() if a in name), name) for name in clip.joint_names]
    return replace(clip, joint_names=tuple(names))


def mirrored(clip: BvhClip, rotations: bool) -> BvhClip:
    """With all x negated, and the rotations with them or not."""
    return replace(
        clip,
        offsets=clip.offsets * ACROSS,
        end_sites={joint: tip * ACROSS for joint, tip in clip.end_sites.items()},
        positions=clip.positions * ACROSS,
        rotations=clip.rotations * [1.0, -1.0, -1.0, 1.0] if rotations else clip.rotations,
    )


def told(clip: BvhClip) -> str:
    parts = find_parts(clip.joint_names, clip.parents)
    return with_own_sides(with_standing_rest(clip, parts)[0], parts)[1]


def test_sides_that_are_only_named_the_wrong_way_round_change_nothing(body: BodyModel) -> None:
    clip = demo("walk")
    same, other = retarget(clip, body), retarget(misnamed(clip), body)
    np.testing.assert_allclose(other.roots, same.roots, atol=1e-9)
    np.testing.assert_allclose(quaternions.to_matrix(other.rotations), quaternions.to_matrix(same.rotations), atol=1e-9)
    assert told(misnamed(clip)) == (
        "its joints named left, as 'LeftArm', are on its right, by how its knees bend and its toes point: it was "
        "mirrored, or they are named the wrong way round; they move the right side"
    )


@pytest.mark.parametrize("rotations", [True, False])
def test_a_mirrored_body_goes_on_facing_ahead(body: BodyModel, rotations: bool) -> None:
    """Limbs of its left point where the file's joints on its left do, feet are not wrung."""
    clip = mirrored(demo("squat"), rotations)
    assert "'LeftArm', are on its right" in told(clip)
    motion = retarget(clip, body, 0.0, give=np.inf)
    theirs, ours = clip.world()[0], world_tracks(body, motion)[0]
    parts = find_parts(clip.joint_names, clip.parents).joints
    for side, named in (("left", "right"), ("right", "left")):
        for near, far in (("thigh", "shin"), ("shin", "foot"), ("foot", "toes"), ("upper_arm", "forearm")):
            a = theirs[:, parts[f"{named}_{far}"]] - theirs[:, parts[f"{named}_{near}"]]
            b = ours[:, body.index_of[f"{side}_{far}"]] - ours[:, body.index_of[f"{side}_{near}"]]
            cosine = (a * b).sum(axis=1) / np.linalg.norm(a, axis=1) / np.linalg.norm(b, axis=1)
            assert cosine.min() > np.cos(np.radians(3.0 if far != "toes" else 30.0)), (side, far)


def test_a_facing_that_is_told_decides(body: BodyModel) -> None:
    """Also where knees and toes tell otherwise; told along a side of the body it is refused."""
    clip = demo("squat")  # faces +Z
    parts = find_parts(clip.joint_names, clip.parents)
    assert with_told_facing(clip, parts, "z")[0] == parts
    swapped, said = with_told_facing(clip, parts, "-z")
    assert swapped.joints["left_hand"] == parts.joints["right_hand"]
    assert swapped.clavicles == {"left": parts.clavicles["right"], "right": parts.clavicles["left"]}
    assert said.startswith("its joints named left, as 'LeftArm', are on its right, as it faces along -z")
    for axis in ("x", "-x", "y"):
        with pytest.raises(RetargetError, match=f"can't face along {axis}, as told: .* it faces along z, or the other"):
            with_told_facing(clip, parts, axis)
    same, told = retarget(clip, body), retarget(misnamed(clip), body, facing="z")
    np.testing.assert_allclose(told.roots, same.roots, atol=1e-9)
    back = retarget(clip, body, facing="-z")
    assert np.abs(back.rotations - same.rotations).max() > 0.1


def test_knees_alone_tell_where_there_are_no_toes() -> None:
    clip = misnamed(demo("squat"))
    parts = find_parts(clip.joint_names, clip.parents)
    bare = replace(parts, joints={part: joint for part, joint in parts.joints.items() if "toes" not in part})
    ends = {joint: tip for joint, tip in clip.end_sites.items() if joint not in bare.joints.values()}
    assert "by how its knees bend:" in with_own_sides(replace(clip, end_sites=ends), bare)[1]


def test_evidence_that_contradicts_itself_changes_nothing() -> None:
    """Feet on backwards below knees that bend ahead: who is to say which of them is wrong."""
    clip = demo("squat")
    parts = find_parts(clip.joint_names, clip.parents)
    offsets = clip.offsets.copy()
    for side in ("left", "right"):
        offsets[parts.joints[f"{side}_toes"], 2] *= -1.0
    assert with_own_sides(replace(clip, offsets=offsets), parts) == (parts, "")
    assert with_own_sides(misnamed(replace(clip, offsets=offsets)), parts) == (parts, "")


@pytest.mark.parametrize("path", [*sorted(DEMO_MOTIONS.glob("*.bvh")), *shared_clips()], ids=lambda path: path.stem)
def test_sides_of_usual_files_are_left_alone(path: Path) -> None:
    assert told(parse_bvh(path.read_text(), None)) == ""
