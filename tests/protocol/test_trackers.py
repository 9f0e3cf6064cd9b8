"""What trackers send: skeletons and poses in their own joints, and what is wrong with those that can't be used."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tryon_protocol import (
    CONVENTIONS,
    PoseMessage,
    ProtocolError,
    Skeleton,
    SkeletonMessage,
    decode_client,
    encode,
    validate_skeleton,
    validate_tracked_pose,
)

NAMES = CONVENTIONS["webxr"].required
K = len(NAMES)
HERE = ((0.0, 1.0, 0.0),) * K
JOINTS = tuple(f"joint {k}" for k in range(14))
STILL = ((0.0, 0.0, 0.0, 1.0),) * K


def skeleton(**changes: object) -> SkeletonMessage:
    fields: dict[str, object] = {"subject": "wearer", "convention": "webxr", "joint_names": NAMES}
    return SkeletonMessage(**{**fields, **changes})  # type: ignore[arg-type]


def pose(**changes: object) -> PoseMessage:
    fields: dict[str, object] = {
        "subject": "wearer",
        "convention": "webxr",
        "frame": "session",
        "t": 1.0,
        "seq": 1,
        "positions": HERE,
        "rotations": STILL,
    }
    return PoseMessage(**{**fields, **changes})  # type: ignore[arg-type]


def sound(**changes: object) -> Skeleton:
    return validate_skeleton(skeleton(**changes), ("wearer",))


def refused_skeleton(**changes: object) -> ProtocolError:
    with pytest.raises(ProtocolError) as caught:
        sound(**changes)
    assert caught.value.remedy
    return caught.value


def refused(**changes: object) -> ProtocolError:
    with pytest.raises(ProtocolError) as caught:
        validate_tracked_pose(pose(**changes), sound(), ("wearer",))
    assert caught.value.remedy
    return caught.value


@pytest.mark.parametrize("convention", [name for name in CONVENTIONS if name != "bvh"])
def test_a_skeleton_of_all_a_conventions_names_is_sound(convention: str) -> None:
    names = CONVENTIONS[convention].known
    told = sound(convention=convention, joint_names=names)
    assert (told.convention, told.joint_names, told.rest_positions, told.rest_rotations) == (
        convention,
        names,
        None,
        None,
    )
    assert set(CONVENTIONS[convention].required) <= set(names)
    assert len(set(names)) == len(names)


def test_the_conventions_have_as_many_joints_as_their_sources_say() -> None:
    webxr = CONVENTIONS["webxr"].known
    both_spellings = {name for name in webxr if "middle" in name and "metacarpal" in name}
    assert len(both_spellings) == 4
    assert len(webxr) == 83 + 2 + 1  # both spellings of the middle metacarpals, and the viewer
    assert len(CONVENTIONS["mediapipe"].known) == 33
    assert len(CONVENTIONS["smpl"].known) == 24


@pytest.mark.parametrize(
    ("changes", "code", "place", "said"),
    [
        ({"subject": "somebody"}, "unknown_subject", "$.subject", "somebody"),
        ({"convention": "kinect"}, "unsupported_convention", "$.convention", "kinect"),
        ({"joint_names": (*NAMES, "tail")}, "invalid_skeleton", f"$.joint_names[{K}]", "'tail'"),
        ({"joint_names": (*NAMES, "hips")}, "invalid_skeleton", f"$.joint_names[{K}]", "'hips' stands twice"),
        ({"joint_names": NAMES[1:]}, "invalid_skeleton", "$.joint_names", "'hips' is missing"),
        ({"parents": (-1, 0)}, "invalid_skeleton", "$.parents", "2 entries"),
        ({"parents": (-1, K, *(0,) * (K - 2))}, "invalid_skeleton", "$.parents[1]", NAMES[1]),
        ({"parents": (-1, 2, 1, *(0,) * (K - 3))}, "invalid_skeleton", "$.parents[1]", "its own ancestor"),
        ({"parents": (0,) * K}, "invalid_skeleton", "$.parents[0]", "'hips'"),
        ({"rest_positions": HERE[1:]}, "invalid_skeleton", "$.rest_positions", f"{K - 1} entries"),
        ({"rest_positions": ((math.inf, 0.0, 0.0), *HERE[1:])}, "invalid_pose", "$.rest_positions[0]", "'hips'"),
        ({"rest_rotations": ((0.0,) * 4, *STILL[1:])}, "invalid_pose", "$.rest_rotations[0]", "'hips'"),
        ({"convention": "bvh", "joint_names": ("Hips", "Head")}, "invalid_skeleton", "$.joint_names", "14 joints"),
        ({"convention": "bvh", "joint_names": JOINTS}, "invalid_skeleton", "$.parents", "0 entries"),
    ],
)
def test_a_skeleton_that_is_wrong_says_where(changes: dict[str, object], code: str, place: str, said: str) -> None:
    error = refused_skeleton(**changes)
    assert (error.code, error.place) == (code, place)
    assert said in error.message


def test_a_tracked_pose_comes_back_as_arrays() -> None:
    turned = ((0.0, 0.0, 0.0, 1.005), *STILL[1:])
    checked = validate_tracked_pose(
        pose(rotations=turned, confidence=(1.0, 0.5, *(0.9,) * (K - 2))), sound(), ("wearer",)
    )
    assert checked.root is None
    assert checked.positions is not None
    assert checked.rotations is not None
    np.testing.assert_array_equal(checked.positions, HERE)
    np.testing.assert_allclose(checked.rotations, STILL, atol=1e-15)
    assert checked.tracked.all()


def test_what_is_not_seen_may_be_anything() -> None:
    nowhere = ((math.nan,) * 3, *HERE[1:])
    turned = ((math.nan,) * 4, *STILL[1:])
    hidden = (0.49, *(1.0,) * (K - 1))
    checked = validate_tracked_pose(pose(positions=nowhere, rotations=turned, confidence=hidden), sound(), ("wearer",))
    assert checked.tracked.tolist() == [False, *(True,) * (K - 1)]
    assert np.isfinite(checked.positions).all()  # type: ignore[arg-type]
    assert np.isfinite(checked.rotations).all()  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("changes", "code", "place", "said"),
    [
        ({"positions": ((math.nan,) * 3, *HERE[1:])}, "invalid_pose", "$.positions[0]", "'hips'"),
        ({"positions": (*HERE[:-1], (0.0, 2e5, 0.0))}, "invalid_pose", f"$.positions[{K - 1}]", repr(NAMES[-1])),
        ({"positions": HERE[1:]}, "invalid_pose", "$.positions", repr(NAMES[-1])),
        ({"rotations": (STILL[0], (0.0,) * 4, *STILL[2:])}, "invalid_pose", "$.rotations[1]", repr(NAMES[1])),
        ({"rotations": ()}, "invalid_pose", "$.rotations", "'hips'"),
        ({"confidence": (1.0,)}, "invalid_pose", "$.confidence", repr(NAMES[1])),
        ({"frame": "mediapipe-world"}, "unsupported_frame", "$.frame", "mediapipe-world"),
        ({"clock": "wall"}, "unsupported_clock", "$.clock", "wall"),
        ({"smoothing": "much"}, "invalid_pose", "$.smoothing", "much"),
        ({"subject": "somebody"}, "unknown_subject", "$.subject", "somebody"),
        ({"t": math.inf}, "invalid_pose", "$.t", "inf"),
    ],
)
def test_a_tracked_pose_that_is_wrong_names_the_joint_or_field(
    changes: dict[str, object], code: str, place: str, said: str
) -> None:
    error = refused(**changes)
    assert (error.code, error.place) == (code, place)
    assert said in error.message


def test_a_convention_of_local_rotations_needs_a_root() -> None:
    names = CONVENTIONS["smpl"].known
    told = sound(convention="smpl", joint_names=names)
    turns = ((0.0, 0.0, 0.0, 1.0),) * len(names)
    good = pose(convention="smpl", positions=(), root=(0.0, 0.9, 0.0), rotations=turns)
    checked = validate_tracked_pose(good, told, ("wearer",))
    assert checked.positions is None
    assert checked.root is not None
    with pytest.raises(ProtocolError) as caught:
        validate_tracked_pose(pose(convention="smpl", positions=(), rotations=turns), told, ("wearer",))
    assert (caught.value.place, "'pelvis'" in caught.value.message) == ("$.root", True)


def test_a_pose_of_an_older_client_means_what_it_meant() -> None:
    """Fields that came later have defaults, so a map without them is a whole message."""
    import msgspec

    old = {
        "type": "pose",
        "subject": "wearer",
        "convention": "model-local",
        "frame": "session",
        "t": 1.0,
        "seq": 1,
        "root": [0.0, 1.0, 0.0],
        "rotations": [[0.0, 0.0, 0.0, 1.0]],
    }
    message = decode_client(msgspec.msgpack.encode(old))
    assert isinstance(message, PoseMessage)
    assert (message.clock, message.smoothing, message.positions, message.confidence) == ("sender", None, (), ())
    assert decode_client(encode(message)) == message
