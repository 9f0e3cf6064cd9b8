"""Poses that the simulation must never see."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tryon_protocol import PoseMessage, ProtocolError, validate_pose

NAMES = ("pelvis", "spine", "head")
REST = ((0.0, 0.0, 0.0, 1.0),) * 3


def pose(**changes: object) -> PoseMessage:
    fields: dict[str, object] = {
        "subject": "wearer",
        "convention": "model-local",
        "frame": "session",
        "t": 1.0,
        "seq": 1,
        "root": (0.0, 0.9, 0.0),
        "rotations": REST,
    }
    return PoseMessage(**{**fields, **changes})  # type: ignore[arg-type]


def refuse(**changes: object) -> ProtocolError:
    with pytest.raises(ProtocolError) as caught:
        validate_pose(pose(**changes), NAMES, ("wearer",))
    assert caught.value.remedy
    return caught.value


def test_a_good_pose_comes_back_as_arrays_with_unit_quaternions() -> None:
    root, rotations = validate_pose(
        pose(rotations=(*REST[:2], (0.0, 0.0, 1.005, 0.0)), root=(1.0, 2.0, 3.0)), NAMES, ("x", "wearer")
    )
    assert root.tolist() == [1.0, 2.0, 3.0]
    np.testing.assert_allclose(rotations, [*REST[:2], (0.0, 0.0, 1.0, 0.0)], atol=1e-15)


@pytest.mark.parametrize(
    "quaternion",
    [
        (0.0, 0.0, 0.0, 0.0),
        (math.nan, 0.0, 0.0, 1.0),
        (0.0, math.inf, 0.0, 1.0),
        (0.0, 0.0, 0.0, 1.02),
        (0.0, 0.0, 0.0, 0.98),
        (1e200, 0.0, 0.0, 0.0),
    ],
)
def test_a_bad_quaternion_names_the_joint(quaternion: tuple[float, float, float, float]) -> None:
    error = refuse(rotations=(REST[0], quaternion, REST[0]))
    assert (error.code, error.place) == ("invalid_pose", "$.rotations[1]")
    assert "'spine'" in error.message


def test_a_missing_joint_is_named() -> None:
    error = refuse(rotations=REST[:2])
    assert error.place == "$.rotations"
    assert "'head'" in error.message
    assert "3 joints" in error.message


def test_a_joint_too_many_is_refused() -> None:
    assert "4 rotations" in refuse(rotations=(*REST, REST[0])).message


@pytest.mark.parametrize("value", [math.nan, math.inf, 2e5])
def test_a_root_out_of_space_is_refused(value: float) -> None:
    error = refuse(root=(0.0, 0.9, value))
    assert error.place == "$.root[2]"
    assert "pelvis" in error.message


def test_a_time_that_is_none_is_refused() -> None:
    assert refuse(t=math.nan).place == "$.t"


@pytest.mark.parametrize(
    ("change", "code"),
    [
        ({"subject": "someone"}, "unknown_subject"),
        ({"convention": "smpl"}, "unsupported_convention"),
        ({"frame": "local-floor"}, "unsupported_frame"),
    ],
)
def test_what_the_session_does_not_know_is_answered_by_what_it_knows(change: dict[str, str], code: str) -> None:
    error = refuse(**change)
    assert error.code == code
    assert error.remedy.startswith("Send one of: ")
