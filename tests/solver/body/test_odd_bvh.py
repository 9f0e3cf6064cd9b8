"""BVH files whose numbers contradict each other: bones that only position channels tell, a root in another unit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from body_cases import DEMO_MOTIONS, shared_clips

from tryon_solver.body import BodyModel, BvhClip, parse_bvh, retarget
from tryon_solver.body.bvh import BvhError, find_units
from tryon_solver.body.root_unit import with_root_unit
from tryon_solver.body.skeletons import find_parts
from tryon_solver.body.stillness import stillness

RADIANS = np.pi / 180.0
WALK = (DEMO_MOTIONS / "walk.bvh").read_text()


def six_channels(factor: float, before: str = "", after: str = "", placed: bool = True) -> str:
    """The walk with position channels in every joint and `factor` times the OFFSETs, below a joint that is `before`.

    Without `placed` these channels are 0.
    """
    skeleton, motion = WALK.split("MOTION\n")
    lines, bones, in_end = [], [], False
    for line in skeleton.splitlines():
        words = line.split()
        in_end = words[:1] == ["End"] or (in_end and words != ["}"])
        if words[:1] == ["OFFSET"] and not in_end:
            bones.append(words[1:])
            line = "OFFSET " + " ".join(f"{factor * float(word):.9g}" for word in words[1:])
        elif words[:1] == ["CHANNELS"]:
            line = "CHANNELS 6 Xposition Yposition Zposition " + " ".join(words[-3:])
        lines.append(line)
    count, rate, *frames = motion.strip().splitlines()
    rows = []
    for frame in frames:
        values = frame.split()
        turns = [values[k : k + 3] for k in range(6, len(values), 3)]
        places = bones[1:] if placed else [["0"] * 3] * len(turns)
        rows.append(" ".join([*values[:6], *(word for place, turn in zip(places, turns) for word in place + turn)]))
    hierarchy = "\n".join(lines)
    if before:
        hierarchy = hierarchy.replace("HIERARCHY\nROOT", f"HIERARCHY\n{before}\nJOINT") + after
    return "\n".join([hierarchy, "MOTION", count, rate, *rows]) + "\n"


@pytest.mark.parametrize(("factor", "told"), [(0.0, "23 of its OFFSETs are 0"), (0.01, "over 3 times off"), (1.0, "")])
def test_bones_are_as_long_as_position_channels_say(body: BodyModel, factor: float, told: str) -> None:
    clip = parse_bvh(six_channels(factor), None)
    assert told in clip.skeleton
    assert bool(clip.skeleton) == bool(told)
    wanted, got = retarget(parse_bvh(WALK), body), retarget(clip, body)
    np.testing.assert_allclose(got.roots, wanted.roots, atol=1e-6)
    np.testing.assert_allclose(got.rotations, wanted.rotations, atol=1e-6)


def test_position_channels_that_are_all_0_leave_the_bones_as_long_as_their_offsets() -> None:
    text = six_channels(1.0, placed=False)
    assert find_units(text)[:2] == (100.0, "centimetres")
    clip = parse_bvh(text, None)
    assert clip.skeleton == (
        "the position channels of 23 joints are all 0, which would put each on its parent: their OFFSETs are taken"
    )
    np.testing.assert_array_equal(clip.positions, parse_bvh(WALK).positions)


def test_a_joint_that_only_carries_the_person_about_is_no_bone() -> None:
    """Its position channels say where the person is."""
    scene = "ROOT scene\n{\nOFFSET 0 0 0\nCHANNELS 0"
    clip = parse_bvh(six_channels(1.0, scene, "}\n"), None)
    assert clip.joint_names[:2] == ("scene", "Hips")
    assert clip.skeleton == ""


def test_bones_that_nothing_gives_a_length_are_refused() -> None:
    lines = [("OFFSET 0 0 0" if line.split()[:1] == ["OFFSET"] else line) for line in WALK.splitlines()]
    with pytest.raises(BvhError, match=r"line .*: all OFFSETs are 0, so no bone has a length"):
        parse_bvh("\n".join(lines), None)


def root_scaled(clip: BvhClip, factor: float) -> BvhClip:
    positions = clip.positions.copy()
    positions[:, 0] *= factor
    return replace(clip, positions=positions)


@pytest.mark.parametrize(("factor", "done"), [(0.01, "multiplied by 100"), (10.0, "divided by 10"), (100.0, "by 100")])
@pytest.mark.parametrize("name", [pytest.param("walk", marks=pytest.mark.long), "squat"])
def test_a_root_in_another_unit_than_the_bones_is_mended_and_told(
    body: BodyModel, name: str, factor: float, done: str
) -> None:
    clip = parse_bvh((DEMO_MOTIONS / f"{name}.bvh").read_text())
    other = root_scaled(clip, factor)
    mended, told = with_root_unit(other, find_parts(clip.joint_names, clip.parents))
    np.testing.assert_allclose(mended.positions, clip.positions, rtol=1e-12)
    assert told.startswith("its root went 10")
    assert told.endswith(done)
    np.testing.assert_allclose(retarget(other, body).roots, retarget(clip, body).roots, atol=1e-9)


@pytest.mark.parametrize("factor", [0.0254, 30.48])
def test_a_root_that_is_off_by_no_power_of_ten_is_told_and_left(factor: float) -> None:
    clip = parse_bvh(WALK)
    other = root_scaled(clip, factor)
    same, told = with_root_unit(other, find_parts(clip.joint_names, clip.parents))
    assert same is other
    assert told.startswith("its root goes about 3")
    assert told.endswith("its unit may be another")


@pytest.mark.parametrize("path", [*sorted(DEMO_MOTIONS.glob("*.bvh")), *shared_clips()], ids=lambda path: path.stem)
def test_the_root_of_people_goes_as_far_as_their_feet_say(path) -> None:
    clip = parse_bvh(path.read_text(), None)
    parts = find_parts(clip.joint_names, clip.parents)
    assert with_root_unit(clip, parts) == (clip, "")
    bound = clip.positions.copy()
    bound[:, 0] = bound[0, 0]
    still = replace(clip, positions=bound)
    assert with_root_unit(still, parts) == (still, ""), "on a treadmill, or bound to a place"
    level = clip.positions.copy()
    level[:, 0, [0, 2]] = level[0, 0, [0, 2]]
    assert with_root_unit(replace(clip, positions=level), parts)[1] == ""


def recast(lengths: float, angles: float) -> BvhClip:
    """The walk with the places and angles of its frames times these."""
    head, motion = WALK.split("MOTION\n")
    count, rate, *frames = motion.strip().splitlines()
    rows = np.array([[float(word) for word in frame.split()] for frame in frames])
    rows *= np.repeat([lengths, angles], [3, rows.shape[1] - 3])
    return parse_bvh("\n".join([f"{head}MOTION", count, rate, *(" ".join(map(str, row)) for row in rows)]))


@pytest.mark.parametrize(
    ("clip", "told"),
    [
        (recast(1.0, RADIANS), "although the body moves by 2.57 m: are its angles in radians? BVH has degrees"),
        (recast(0.0, RADIANS), "0.87 degrees: are its angles in radians? BVH has degrees"),
        (recast(0.0, 0.0), "nothing moves: its 421 frames are all alike"),
        (recast(1.0, 0.0), "nothing moves but its root"),
        (recast(0.0, 1.0), ""),
    ],
    ids=["radians", "treadmill-radians", "zeros", "slides", "treadmill"],
)
def test_joints_that_do_not_turn_are_told(clip: BvhClip, told: str) -> None:
    said = stillness(clip, find_parts(clip.joint_names, clip.parents))
    assert said.endswith(told)
    assert bool(said) == bool(told)


@pytest.mark.parametrize("path", [*sorted(DEMO_MOTIONS.glob("*.bvh")), *shared_clips()], ids=lambda path: path.stem)
def test_the_joints_of_people_turn(path) -> None:
    clip = parse_bvh(path.read_text(), None)
    parts = find_parts(clip.joint_names, clip.parents)
    assert stillness(clip, parts) == ""
    one = replace(clip, positions=clip.positions[:1], rotations=clip.rotations[:1])
    assert stillness(one, parts) == "", "a pose is no motion"
