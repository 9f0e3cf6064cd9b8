"""The BVH reader: kinematics by hand and against scipy, units, and what it says about broken files."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from body_cases import DEMO_MOTIONS
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tryon_solver.body import BvhError, parse_bvh, quaternions
from tryon_solver.body.bvh import decode_bvh

ARM = """HIERARCHY
ROOT Base
{
\tOFFSET 0 0 0
\tCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
\tJOINT Elbow
\t{
\t\tOFFSET 0 80 0
\t\tCHANNELS 3 Yrotation Zrotation Xrotation
\t\tEnd Site
\t\t{
\t\t\tOFFSET 0 60 0
\t\t}
\t}
}
MOTION
Frames: 2
Frame Time: 0.016667
0 0 0 0 0 0 0 0 0
100 200 300 90 0 0 90 90 0
"""


def test_two_bones_by_hand() -> None:
    clip = parse_bvh(ARM)
    assert clip.joint_names == ("Base", "Elbow")
    assert clip.parents.tolist() == [-1, 0]
    assert clip.dt == 0.016667
    positions, turns = clip.world()
    np.testing.assert_allclose(positions[0], [[0, 0, 0], [0, 0.8, 0]], atol=1e-12)
    # base turned 90 about z: its bone points to -x. Elbow: Ry(90) Rz(90) takes y to +z, the base turns that to +z
    np.testing.assert_allclose(positions[1], [[1, 2, 3], [0.2, 2, 3]], atol=1e-12)
    tip = positions[1, 1] + quaternions.rotate(turns[1, 1], clip.end_sites[1])
    np.testing.assert_allclose(tip, [0.2, 2, 3.6], atol=1e-12)


@settings(max_examples=30)
@given(st.sampled_from(list(itertools.permutations("XYZ"))), st.tuples(*[st.floats(-360, 360)] * 3))
def test_any_channel_order_agrees_with_scipy(order: tuple[str, ...], angles: tuple[float, ...]) -> None:
    written = " ".join(f"{axis}rotation" for axis in order)
    text = ARM.replace("Yrotation Zrotation Xrotation", written)
    text = text.replace("0 0 0 0 0 0 0 0 0", "0 0 0 0 0 0 " + " ".join(map(repr, angles)))
    expected = Rotation.from_euler("".join(order), angles, degrees=True).as_matrix()
    np.testing.assert_allclose(quaternions.to_matrix(parse_bvh(text).rotations[0, 1]), expected, atol=1e-9)


def test_position_channels_replace_the_offset_axis_by_axis() -> None:
    text = ARM.replace("CHANNELS 3 Yrotation Zrotation Xrotation", "CHANNELS 1 Xposition")
    text = text.replace("0 0 0 0 0 0 0 0 0", "0 0 0 0 0 0 7").replace("90 0 0 90 90 0", "90 0 0 9")
    np.testing.assert_allclose(parse_bvh(text).positions[0, 1], [0.07, 0.8, 0.0])


def test_lower_case_keywords_and_windows_line_ends_are_read() -> None:
    text = ARM.replace("HIERARCHY", "Hierarchy").replace("Xposition", "XPOSITION").replace("\n", "\r\n")
    assert parse_bvh(text).frame_count == 2


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("Frames: 2", "Frames:2"),
        ("Frames: 2", "Frames : 2"),
        ("Frame Time: 0.016667", "Frame Time:0.016667"),
        ("Frame Time: 0.016667", "FrameTime: 0.016667"),
        ("Frame Time: 0.016667", "\tFrame\t Time\t:\t0.016667 \t"),
        ("JOINT Elbow\n\t{", "JOINT Elbow {"),
        ("ROOT Base\n{", "ROOT Base {"),
        ("End Site\n\t\t{", "End Site {"),
        ("ROOT Base\n{", "ROOT Base{"),
        ("JOINT Elbow\n\t{", "JOINT Elbow{"),
        ("End Site\n\t\t{", "EndSite{"),
        ("{\n\tOFFSET 0 0 0", "{OFFSET 0 0 0"),
        ("OFFSET 0 60 0\n\t\t}\n\t}\n}", "OFFSET 0 60 0}}}"),
        ("\t\t}\n\t}\n}\nMOTION", "} } }MOTION"),
        ("100 200 300 90 0 0 90 90 0\n", "100\t200 300\t90  0 0 90 90 0 \t \r\n \r\n"),
    ],
)
def test_blanks_and_line_ends_that_tell_nothing_are_not_asked_for(old: str, new: str) -> None:
    assert ARM.count(old) == 1
    clip, same = parse_bvh(ARM.replace(old, new)), parse_bvh(ARM)
    assert clip.joint_names == same.joint_names
    assert clip.dt == same.dt
    np.testing.assert_array_equal(clip.positions, same.positions)
    np.testing.assert_array_equal(clip.rotations, same.rotations)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1"])
def test_a_file_of_any_editor_is_read(encoding: str) -> None:
    """With a byte order mark or without; letters beyond ASCII in names may be of any code page."""
    clip = parse_bvh(decode_bvh(ARM.replace("Elbow", "Ellböge").encode(encoding)))
    assert clip.joint_names[0] == "Base"
    assert clip.joint_names[1].startswith("Ellb")
    np.testing.assert_array_equal(clip.positions, parse_bvh(ARM).positions)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be"])
def test_utf_16_is_told_plainly(encoding: str) -> None:
    with pytest.raises(BvhError, match=r"UTF-16.*save it as UTF-8"):
        decode_bvh(ARM.encode(encoding))


def test_units_are_centimetres_unless_told() -> None:
    in_metres = ARM.replace("0 80 0", "0 0.8 0").replace("0 60 0", "0 0.6 0")
    np.testing.assert_allclose(parse_bvh(in_metres, units_per_metre=1.0).offsets, parse_bvh(ARM).offsets)


def test_implausible_height_is_refused_with_the_fitting_units() -> None:
    in_metres = ARM.replace("0 80 0", "0 0.8 0").replace("0 60 0", "0 0.6 0")
    with pytest.raises(BvhError, match=r"0\.014 m tall, .*would be one in metres$"):
        parse_bvh(in_metres)
    with pytest.raises(BvhError, match=r"140 m tall, .*would be one in centimetres$"):
        parse_bvh(ARM, units_per_metre=1.0)


@pytest.mark.parametrize("units", [0.0, -1.0, float("nan")])
def test_senseless_units_are_refused(units: float) -> None:
    with pytest.raises(BvhError, match="units_per_metre"):
        parse_bvh(ARM, units_per_metre=units)


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ("HIERARCHY", "garbage", 1, "starts with the word HIERARCHY"),
        ("ROOT Base", "JOINT Base", 2, "wrong place"),
        ("OFFSET 0 80 0", "OFFSET 0 80", 8, "OFFSET has 2 values, expected 3"),
        ("OFFSET 0 80 0", "OFFSET 0 eighty 0", 8, "'eighty', not a finite number"),
        ("JOINT Elbow", "JOINT Base", 6, "second joint named 'Base'"),
        ("CHANNELS 3 Y", "CHANNELS 4 Y", 9, "a count and that many names"),
        ("3 Yrotation", "3 Wrotation", 9, "unknown channel 'Wrotation'"),
        ("3 Yrotation", "3 Zrotation", 9, "listed twice"),
        ("\t}\n}\nMOTION", "\t}\nMOTION", 15, "brace is open"),
        ("}\nMOTION", "}\n}\nMOTION", 16, "without a matching"),
        ("Frames: 2", "Frames: two", 17, "'two', not a finite number"),
        ("Frames: 2", "Frames: 0", 17, "at least one"),
        ("Frame Time: 0.016667", "60 Hz", 18, "expected 'Frame Time:'"),
        ("0.016667", "-1", 18, "says -1 s; a motion has 0.001 to 1 s"),
        ("0.016667", "0", 18, "says 0 s; a motion has 0.001 to 1 s"),
        ("0.016667", "0.0001", 18, "says 0.0001 s; a motion has 0.001 to 1 s"),
        ("0.016667", "16.667", 18, "says 16.667 s; a motion has 0.001 to 1 s"),
        ("100 200 300 90", "100 200 300", 20, "frame 2 has 8 values, expected 9"),
        ("100 200", "100 nan", 20, "value 2 of frame 2 is 'nan'"),
        ("100 200", "100 1e999", 20, "not a finite number"),
        ("\t\tOFFSET 0 80 0\n", "", 6, "joint 'Elbow' has no OFFSET"),
        ("\t\t\tOFFSET 0 60 0\n", "", 6, "End Site of joint 'Elbow' has no OFFSET"),
    ],
)
def test_broken_file_is_refused_by_line(old: str, new: str, line: int, message: str) -> None:
    assert ARM.count(old) >= 1
    with pytest.raises(BvhError, match=message) as caught:
        parse_bvh(ARM.replace(old, new, 1))
    assert caught.value.line == line
    assert str(caught.value).startswith(f"line {line}: ")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("Frames: 2", "Frames: 3", "promises 3 frames, the file holds 2"),
        (ARM[ARM.index("MOTION") :], "", "ends before the word MOTION"),
    ],
)
def test_inconsistent_file_is_refused(old: str, new: str, message: str) -> None:
    with pytest.raises(BvhError, match=message):
        parse_bvh(ARM.replace(old, new, 1))


@settings(max_examples=200)
@given(st.data())
def test_no_damage_raises_anything_but_a_bvh_error(data: st.DataObject) -> None:
    words = ARM.replace("\n", " \n ").split(" ")
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(words) - 1))
        words[at] = data.draw(st.sampled_from(["", "{", "}", "MOTION", "End", "JOINT", "CHANNELS", "-1", "\n", "x"]))
    try:
        clip = parse_bvh(" ".join(words))
    except BvhError:
        return
    assert np.isfinite(clip.positions).all()


@settings(max_examples=50)
@given(st.text(max_size=200))
def test_arbitrary_text_is_refused(text: str) -> None:
    with pytest.raises(BvhError):
        parse_bvh(text)


def test_written_demo_motion_reads_back_upright() -> None:
    clip = parse_bvh((DEMO_MOTIONS / "squat.bvh").read_text(), name="squat")
    positions, _ = clip.world()
    names = {name: k for k, name in enumerate(clip.joint_names)}
    assert clip.name == "squat"
    assert (positions[:, names["Head"], 1] > positions[:, names["Hips"], 1]).all()
    assert np.ptp(positions[:, names["LeftFoot"]], axis=0).max() < 1e-4, "a squatting foot must stay where it is"


@pytest.mark.parametrize("turn", ["1e300", "-4e5"])
def test_a_turn_that_nobody_makes_is_refused_by_its_line(turn) -> None:
    with pytest.raises(BvhError, match=r"value 8 of frame 2 turns a joint by .* degrees, more than 360000") as caught:
        parse_bvh(ARM.replace("90 90 0\n", f"90 {turn} 0\n"))
    assert "line 20" in str(caught.value)
    parse_bvh(ARM.replace("100 200 300 90", "4e5 200 300 3600"), units_per_metre=100.0)
