"""Streams whose axes or origin are not a session's are told so by how they have the body; people's poses are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tryon_protocol import CONVENTIONS, Skeleton, TrackedPose
from tryon_server.runtime.followers import Follower
from tryon_server.runtime.posture import SECONDS, Posture, local_turns
from tryon_server.sessions.commands import UseTrackedPose
from tryon_solver.body import BodyModel, Pose, default_body

RATE = 10
STANDING = 0.93  # m, of a root of SMPL's average person over the floor
X, Y = np.eye(3)[:2]
REST = np.array([0.0, 0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def body() -> BodyModel:
    return default_body()


def about(axis: np.ndarray, degrees: float) -> np.ndarray:
    half = np.radians(degrees) / 2
    return np.append(np.sin(half) * axis, np.cos(half))


def smpl(root, turn=REST, bend: float = 0.0) -> tuple[Skeleton, TrackedPose]:
    """Thighs are bent forward by so many degrees."""
    names = CONVENTIONS["smpl"].known
    turns = np.tile(REST, (len(names), 1))
    turns[0] = turn
    turns[[names.index("left_hip"), names.index("right_hip")]] = about(X, -bend)
    seen = np.ones(len(names), dtype=bool)
    return Skeleton("smpl", names, None, None, None), TrackedPose(np.array(root, dtype=float), None, turns, seen)


def each(turn) -> tuple[Skeleton, TrackedPose]:
    """Every joint, or a joint a row, has this quaternion."""
    skeleton, pose = smpl([0.0, STANDING, 0.0])
    return skeleton, replace(pose, rotations=np.broadcast_to(turn, (len(skeleton.joint_names), 4)))


def people(w_first: bool = False) -> tuple[Skeleton, TrackedPose]:
    """Joints turned about any axes, by 30 degrees on average."""
    rng = np.random.default_rng(3)
    axes = rng.normal(size=(24, 3))
    turns = [about(axis / np.linalg.norm(axis), angle) for axis, angle in zip(axes, rng.uniform(0.0, 60.0, 24))]
    return each(np.roll(turns, 1, axis=1) if w_first else np.array(turns))


def head(height: float) -> tuple[Skeleton, TrackedPose]:
    pose = TrackedPose(None, np.array([[0.0, height, 0.0]]), REST[None], np.ones(1, dtype=bool))
    return Skeleton("head-hands", ("viewer",), None, None, None), pose


def told(body: BodyModel, phases, stream: int = 1, posture: Posture | None = None) -> list[tuple[str, float, str]]:
    """Code, time [s] and text of what is said of poses that last so many seconds each."""
    posture, follower = posture or Posture(body), Follower(body)
    found, k = [], 0
    for seconds, (skeleton, pose) in phases:
        for _ in range(round(seconds * RATE)):
            command = UseTrackedPose(stream, k + 1, k / RATE, "session", skeleton, 1, pose)
            fault = posture.told(stream, k / RATE, follower.pose(command), skeleton.convention, local_turns(command))
            if fault is not None:
                found.append((fault.code, k / RATE, f"{fault.message} {fault.remedy}"))
            k += 1
    return found


@pytest.mark.parametrize(
    ("tracker", "code", "seconds", "words"),
    [
        (smpl([0.3, 0.0, -0.2]), "off_floor", "off_floor", ["under the floor", "root-relative"]),  # about its root
        (smpl([0.3, 2.2, -0.2]), "off_floor", "off_floor", ["over the floor"]),
        (smpl([1.1, -0.4, STANDING], about(X, 90.0)), "lying", "z_up", ["Z is up", "(x, z, -y)"]),  # AMASS
        pytest.param(
            smpl([1.1, 0.3, STANDING], about(X, 130.0), 40.0), "lying", "z_up", ["Z is up"], marks=pytest.mark.long
        ),  # bent forward
        (smpl([1.1, 0.1, -2.0], about(X, -90.0)), "lying", "lying", ["Y up", "who lies need do nothing"]),
        pytest.param(
            smpl([0.0, 0.0, 0.0], about(X, 90.0)), "lying", "lying", ["Y up"], marks=pytest.mark.long
        ),  # Z up, and about its root
        (smpl([0.0, STANDING, 0.0], about(X, 180.0)), "upside_down", "upside_down", ["Y up"]),
        (each([1.0, 0.0, 0.0, 0.0]), "contorted", "contorted", ["by 180 degrees", "by 0 if", "Send x, y, z, w"]),
        pytest.param(people(w_first=True), "contorted", "contorted", ["Send x, y, z, w"], marks=pytest.mark.long),
        (each([0.0, 1.0, 0.0, 0.0]), "contorted", "contorted", ["as nobody's are", "relative to its parent"]),
        (head(0.0), "off_floor", "off_floor", ["local-floor"]),  # WebXR's space `local`
    ],
    ids=[
        *("root-relative", "afloat", "z-up", "z-up-bent", "lies", "z-up-root-relative", "y-down"),
        *("w-first", "w-first-people", "world-turns", "local"),
    ],
)
def test_other_axes_and_origins_are_told_once_by_name_with_what_mends_them(body, tracker, code, seconds, words):
    ((said, when, text),) = told(body, [(15.0, tracker)])
    assert said == code
    assert when == pytest.approx(SECONDS[seconds], abs=0.3)
    for word in words:
        assert word in text


def test_another_sender_is_told_for_itself(body):
    posture = Posture(body)
    for stream in (1, 2):
        assert len(told(body, [(4.0, smpl([0.0, 0.0, 0.0]))], stream, posture)) == 1


@pytest.mark.parametrize(
    "phases",
    [
        pytest.param([(20.0, smpl([0.0, STANDING, 0.0]))], marks=pytest.mark.long),
        [(20.0, people())],
        [(0.6, each([1.0, 0.0, 0.0, 0.0])), (20.0, people())],
        [(20.0, head(1.62))],
        [(20.0, head(0.78))],  # sits on the floor
        pytest.param(
            [(20.0, smpl([0.0, 0.1, 0.85], about(Y, 180.0), 90.0))], marks=pytest.mark.long
        ),  # the same, feet ahead at z = 0
        [(20.0, smpl([0.0, STANDING, 0.0], about(X, 70.0), 70.0))],  # bent forward
        [(3.0, smpl([0.0, STANDING, 0.0])), (1.0, smpl([0.0, 2.0, 0.0])), (5.0, smpl([0.0, STANDING, 0.0]))],  # leaps
        pytest.param([(20.0, smpl([0.0, 1.3, 0.0]))], marks=pytest.mark.long),  # stands on a chair
        [(9.0, smpl([0.0, 0.12, -0.4], about(X, -90.0))), (9.0, smpl([0.0, STANDING, 0.0]))],  # lies for a while
        [(1.0, smpl([0.0, STANDING, 0.0], about(X, angle))) for angle in (0.0, 90.0, 180.0, 270.0)],  # a cartwheel
    ],
    ids=[
        *("stands", "any-turns", "bad-for-a-moment", "head", "sits", "sits-legs-ahead", "bent", "leaps", "chair"),
        *("lies", "cartwheel"),
    ],
)
def test_what_people_do_is_not_told(body, phases):
    assert told(body, phases) == []


def test_quaternions_of_the_bodys_own_joints_that_begin_with_w_are_told_once(body):
    posture, rest = Posture(body), Pose.rest(body)
    turned = Pose(rest.root, np.roll(rest.rotations, 1, axis=1))
    said = [posture.told(1, k / RATE, turned, "model-local", turned.rotations) for k in range(20 * RATE)]
    (fault,) = filter(None, said)
    assert (fault.code, fault.place) == ("contorted", "$.rotations")
    assert fault.remedy == "Send x, y, z, w: the identity is 0, 0, 0, 1."


def test_poses_of_the_bodys_own_joints_are_only_held_to_being_upright(body):
    """Their sender knows where the body's joints are."""
    posture, rest = Posture(body), Pose.rest(body)
    sunk = Pose(rest.root - np.array([0.0, 3.0, 0.0]), rest.rotations)
    assert [posture.told(1, k / RATE, sunk, "model-local") for k in range(20 * RATE)] == [None] * 20 * RATE
