"""Poses in another unit, or of nobody, are told by the lengths of their limbs; a single limb that is wrong is not."""

from __future__ import annotations

import numpy as np
import pytest

from tryon_protocol import CONVENTIONS, ProtocolError, Skeleton, TrackedPose
from tryon_server.sessions.measures import LENGTH_FACTOR, ROOT_STATURES_MAX, SMPL_STATURE, Measures

STANDING = {  # a person of 1.7 m, arms hanging
    "mediapipe": {
        "left_shoulder": (0.18, 1.4, 0.0),
        "left_elbow": (0.2, 1.1, 0.0),
        "left_wrist": (0.2, 0.86, 0.0),
        "left_hip": (0.1, 0.9, 0.0),
        "left_knee": (0.1, 0.48, 0.0),
        "left_ankle": (0.1, 0.07, 0.0),
    },
    "webxr": {
        "left-arm-upper": (0.18, 1.4, 0.0),
        "left-arm-lower": (0.2, 1.1, 0.0),
        "left-hand-wrist": (0.2, 0.86, 0.0),
    },
}


def person(convention: str) -> tuple[tuple[str, ...], np.ndarray]:
    """Names and places (K, 3) [m] of both sides."""
    places = dict(STANDING[convention])
    for name, (x, y, z) in STANDING[convention].items():
        places[name.replace("left", "right")] = (-x if name.startswith("left") else x, y, z)
    return tuple(places), np.array(list(places.values()))


def checked(convention: str, positions: np.ndarray, rest: np.ndarray | None = None, lost: tuple[int, ...] = ()) -> None:
    names, _ = person(convention)
    tracked = np.ones(len(names), dtype=bool)
    tracked[list(lost)] = False
    Measures(Skeleton(convention, names, None, rest, None)).check(TrackedPose(None, positions, None, tracked))


@pytest.mark.parametrize("convention", STANDING)
@pytest.mark.parametrize("scale", [0.7, 1.0, 1.25])
def test_people_of_any_size_are_taken(convention, scale):
    _, places = person(convention)
    checked(convention, scale * places + [3.0, 0.0, -8.0])


@pytest.mark.parametrize("convention", STANDING)
@pytest.mark.parametrize("scale", [0.0, 100.0, 640.0])
def test_nobody_centimetres_and_pixels_are_refused_by_joint_and_unit(convention, scale):
    names, places = person(convention)
    with pytest.raises(ProtocolError) as caught:
        checked(convention, scale * places)
    fault = caught.value
    assert fault.code == "invalid_pose"
    joint = int(fault.place.removeprefix("$.positions[").removesuffix("]"))
    assert repr(names[joint]) in fault.message
    assert "metres" in fault.remedy


@pytest.mark.parametrize("factor", [0.9 * LENGTH_FACTOR, 1.1 * LENGTH_FACTOR, 1 / 1.1 / LENGTH_FACTOR])
def test_a_skeleton_that_tells_its_own_lengths_is_held_to_them(factor):
    _, places = person("webxr")
    if 1 / LENGTH_FACTOR < factor < LENGTH_FACTOR:
        checked("webxr", factor * places, rest=places)
    else:
        with pytest.raises(ProtocolError):
            checked("webxr", factor * places, rest=places)


def test_one_limb_that_is_wrong_is_noise_and_what_is_not_seen_does_not_count():
    names, places = person("mediapipe")
    wrong = places.copy()
    wrong[names.index("left_wrist")] = wrong[names.index("left_elbow")]
    wrong[names.index("left_ankle")] += 50.0
    checked("mediapipe", wrong)
    left = tuple(k for k, name in enumerate(names) if name.startswith("left"))
    wrong[list(left)] = 0.0
    checked("mediapipe", wrong, lost=left)


@pytest.mark.parametrize("rest_height", [None, 1.8])
def test_a_root_in_centimetres_is_refused(rest_height):
    names = CONVENTIONS["smpl"].known
    rest = None
    if rest_height is not None:
        rest = np.zeros((len(names), 3))
        rest[-1, 1] = rest_height
    measures = Measures(Skeleton("smpl", names, None, rest, None))
    limit = ROOT_STATURES_MAX * (rest_height or SMPL_STATURE)
    seen = np.ones(len(names), dtype=bool)
    measures.check(TrackedPose(np.array([9e3, 0.99 * limit, 0.0]), None, None, seen))
    with pytest.raises(ProtocolError, match="pelvis"):
        measures.check(TrackedPose(np.array([0.0, 91.0, 0.0]), None, None, seen))


def test_controllers_laid_aside_are_no_fault_of_the_head():
    names = ("viewer", "left-hand-wrist", "right-hand-wrist")
    places = np.array([[3.0, 1.6, 0.0], [0.2, 0.7, 0.0], [0.3, 0.7, 0.0]])
    seen = np.ones(3, dtype=bool)
    Measures(Skeleton("head-hands", names, None, None, None)).check(TrackedPose(None, places, None, seen))


def rig(convention: str) -> tuple[tuple[str, ...], np.ndarray]:
    """Names and rest places (K, 3) [m] of a person of 1.7 m; of `bvh` from toes to head, by names of its own."""
    if convention != "bvh":
        names, places = person("mediapipe" if convention == "smpl" else convention)
        return names, places
    return ("Hips", "Head", "Toe"), np.array([[0.0, 0.95, 0.0], [0.0, 1.55, 0.0], [0.1, 0.02, 0.1]])


@pytest.mark.parametrize("convention", [*STANDING, "smpl", "bvh"])
@pytest.mark.parametrize(
    ("factor", "unit"),
    [(100.0, "centimetres"), (39.37, "inches"), (1000.0, "millimetres"), (3.2808, "feet"), (0.2, None), (1e6, None)],
)
def test_a_rest_pose_of_nobody_is_refused_with_the_unit_in_which_it_is_somebody(convention, factor, unit):
    names, rest = rig(convention)
    with pytest.raises(ProtocolError) as caught:
        Measures(Skeleton(convention, names, None, factor * rest, None))
    fault = caught.value
    assert (fault.code, fault.place) == ("invalid_skeleton", "$.rest_positions")
    assert "Send metres" in fault.remedy
    assert unit is None or f"in {unit} " in fault.remedy


@pytest.mark.parametrize("convention", [*STANDING, "smpl", "bvh"])
@pytest.mark.parametrize("stature", [0.7, 1.0, 1.7, 2.6])
def test_a_rest_pose_of_a_child_and_of_a_giant_is_taken(convention, stature):
    names, rest = rig(convention)
    Measures(Skeleton(convention, names, None, stature / 1.7 * rest, None))


@pytest.mark.parametrize(("height", "refused"), [(1.6, False), (12.0, False), (63.0, True), (160.0, True)])
def test_a_head_in_centimetres_or_inches_is_refused(height, refused):
    pose = TrackedPose(None, np.array([[0.0, height, 0.0]]), None, np.ones(1, dtype=bool))
    measures = Measures(Skeleton("head-hands", ("viewer",), None, None, None))
    if not refused:
        measures.check(pose)
        return
    with pytest.raises(ProtocolError, match="viewer") as caught:
        measures.check(pose)
    assert caught.value.place == "$.positions[0]"
    assert "metres" in caught.value.remedy


def test_landmarks_of_the_picture_are_no_world_landmarks():
    names, places = person("mediapipe")
    hips = places[[names.index("left_hip"), names.index("right_hip")]].mean(axis=0)
    world = (places - hips) * [1.0, -1.0, -1.0]
    seen = np.ones(len(names), dtype=bool)
    measures = Measures(Skeleton("mediapipe", names, None, None, None))
    noise = np.random.default_rng(3).normal(0.0, 0.03, world.shape)
    measures.check(TrackedPose(None, world + noise, None, seen), "mediapipe-world")
    measures.check(TrackedPose(None, places, None, seen), "session")
    picture = 0.5 * world + [0.5, 0.55, 0.0]
    with pytest.raises(ProtocolError, match="pose_world_landmarks") as caught:
        measures.check(TrackedPose(None, picture, None, seen), "mediapipe-world")
    assert caught.value.place == f"$.positions[{names.index('left_hip')}]"
