"""`tryon headset-sim`: a simulated tracker errs as it is told to, and the ages of the frames are those there were."""

from __future__ import annotations

import re

import numpy as np
import pytest
from studio import Studio

from tryon_client.frame_ages import FrameAges
from tryon_client.simulated_tracker import WEBXR, SimulatedTracker, TrackerErrors, world_joints
from tryon_protocol import (
    CONVENTIONS,
    BodySurface,
    DecodedFrame,
    PongMessage,
    ProtocolError,
    validate_pose,
    validate_skeleton,
    validate_tracked_pose,
)
from tryon_server.cli import main
from tryon_solver.body.feet import world_tracks
from tryon_solver.body.model import default_body
from tryon_solver.body.motion import Motion

PERFECT = TrackerErrors(rate=60.0, latency=0.0, place_noise=0.0, turn_noise=0.0, lost=0.0, outages=0.0)
FRAMES = 600


def surface() -> BodySurface:
    body = default_body()
    return BodySurface(
        rest_vertices=body.rest_vertices.astype(np.float32),
        faces=body.faces.astype(np.uint32),
        joint_names=body.joint_names,
        parents=body.parents,
        rest_joints=body.rest_joints.astype(np.float32),
        skin_joints=body.skin_joints.astype(np.uint16),
        skin_weights=body.skin_weights,
    )


def swaying() -> tuple[np.ndarray, np.ndarray]:
    """Ten seconds of every joint turning a little about another axis."""
    body = default_body()
    times = np.arange(FRAMES) / 60.0
    axes = np.random.default_rng(1).normal(size=(body.joint_count, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    half = 0.1 * np.sin(times)[:, None] * np.ones(body.joint_count)
    rotations = np.concatenate([np.sin(half)[..., None] * axes, np.cos(half)[..., None]], axis=-1)
    return body.rest_joints[0] + np.stack([0.2 * times, 0 * times, 0 * times], axis=-1), rotations


def poses_with(convention: str = "webxr", **changes) -> list:
    errors = TrackerErrors(**({name: getattr(PERFECT, name) for name in PERFECT.__dataclass_fields__} | changes))
    return SimulatedTracker(surface(), *swaying(), errors, convention).poses("wearer", 100.0)


def test_a_perfect_tracker_tells_where_the_joints_are():
    roots, rotations = swaying()
    body = default_body()
    places, turns = world_tracks(body, Motion(roots, rotations, 1 / 60))
    told_places, told_turns = world_joints(surface(), roots, rotations)
    np.testing.assert_allclose(told_places, places, atol=1e-6)
    np.testing.assert_allclose(np.abs((told_turns * turns).sum(axis=-1)), 1.0, atol=1e-12)
    tracker = SimulatedTracker(surface(), roots, rotations, PERFECT, "webxr")
    skeleton = validate_skeleton(tracker.skeleton("wearer"), ("wearer",))
    poses = tracker.poses("wearer", 100.0)
    assert len(poses) == FRAMES
    ours = [body.index_of[joint] for joint in WEBXR.values()]
    for k in (0, 17, FRAMES - 1):
        checked = validate_tracked_pose(poses[k].message, skeleton, ("wearer",))
        np.testing.assert_allclose(checked.positions, places[k, ours], atol=1e-6)
        assert poses[k].message.t == pytest.approx(100.0 + k / 60.0)
    assert set(WEBXR) <= set(CONVENTIONS["webxr"].known)


def test_poses_of_the_body_itself_are_valid_too():
    told = poses_with("model-local")
    validate_pose(told[-1].message, default_body().joint_names, ("wearer",))
    assert [pose.message.seq for pose in told] == list(range(1, FRAMES + 1))


def test_noise_has_the_size_and_the_length_that_was_asked_for():
    clean = np.array([pose.message.positions for pose in poses_with()])
    white = np.array([pose.message.positions for pose in poses_with(place_noise=0.003)]) - clean
    assert white.std() == pytest.approx(0.003, rel=0.03)
    assert abs(np.mean(white[1:] * white[:-1])) < 0.05 * white.var()
    slow = np.array([pose.message.positions for pose in poses_with(place_noise=0.003, noise_seconds=0.1)]) - clean
    assert slow.std() == pytest.approx(0.003, rel=0.1)
    assert np.mean(slow[1:] * slow[:-1]) / slow.var() == pytest.approx(np.exp(-1 / 6), abs=0.05)
    still = np.array([pose.message.rotations for pose in poses_with()])
    shaken = np.array([pose.message.rotations for pose in poses_with(turn_noise=np.radians(0.5))])
    angles = 2 * np.arccos(np.clip(np.abs((still * shaken).sum(axis=-1)), 0, 1))
    assert np.degrees(np.sqrt((angles**2).mean() / 3)) == pytest.approx(0.5, rel=0.03)


def test_poses_are_late_lost_and_missing_for_a_while_as_asked():
    assert {round(pose.leaves - pose.captured, 9) for pose in poses_with(latency=0.045)} == {0.045}
    assert len(poses_with(lost=0.25)) == pytest.approx(0.75 * FRAMES, rel=0.1)
    told = poses_with(outages=0.5, outage_seconds=0.2)
    gaps = np.diff([pose.captured for pose in told])
    assert gaps.max() >= 0.2
    assert len(told) < FRAMES - 12
    assert [pose.message.seq for pose in told] == list(range(1, len(told) + 1))
    again = poses_with(outages=0.5, outage_seconds=0.2)
    assert [pose.message for pose in again] == [pose.message for pose in told]


def test_what_can_not_be_tracked_is_refused():
    roots, rotations = swaying()
    with pytest.raises(ProtocolError):
        SimulatedTracker(surface(), roots, rotations[:, :5], PERFECT, "webxr")


def frame(t_sim: float, t_published: float, pose_seq: int = 1) -> DecodedFrame:
    values = dict.fromkeys(DecodedFrame.__dataclass_fields__)
    return DecodedFrame(**(values | {"t_sim": t_sim, "t_published": t_published, "pose_seq": pose_seq}))


def test_ages_are_counted_from_capture_and_from_publishing_on_the_servers_clock():
    ages = FrameAges(count_from=10.0)
    ages.pong(PongMessage(t=9.0, clock=1009.5), 9.4)  # a slow answer, whose offset is wrong by 0.3 s
    ages.pong(PongMessage(t=9.5, clock=1009.51), 9.52)  # ours + 1000 s
    ages.frame(frame(9.0, 1009.0), 9.9)
    ages.frame(frame(9.0, 1009.0, pose_seq=0), 10.0)
    for k in range(101):
        ages.frame(frame(10.0 + 0.1 * k - 0.001 * k, 1010.0 + 0.1 * k - 0.02), 10.0 + 0.1 * k)
    assert ages.count == 101
    assert ages.rate() == pytest.approx(10.0)
    np.testing.assert_allclose(ages.since_capture().values, [0.05, 0.095, 0.099, 0.1], atol=1e-9)
    np.testing.assert_allclose(ages.since_publishing().values, 0.02, atol=1e-9)
    np.testing.assert_allclose(ages.between().values, 0.1, atol=1e-9)
    assert re.search(r"capture to decoded frame +50\.0 +95\.0 +99\.0 +100\.0", ages.table())
    assert np.isnan(FrameAges(0.0).since_capture().values).all()


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    """Sessions that dress the default body, without a solver and without a page."""
    server = Studio(tmp_path_factory.mktemp("sim"), tmp_path_factory.mktemp("no web"), "mannequin")
    yield server
    server.kill()


@pytest.mark.parametrize("convention", ["webxr", pytest.param("model-local", marks=pytest.mark.long)])
def test_the_command_streams_a_motion_and_prints_the_ages(server, capsys, convention):
    options = ["--server", server.url, "--seconds", "6", "--motion", "squat", "--convention", convention]
    assert main(["headset-sim", *options, "--rate", "30", "--lost-percent", "5"]) == 0
    out = capsys.readouterr().out
    found = re.search(r"180 poses captured, (\d+) sent; (\d+) frames counted", out)
    assert found, out
    assert 150 < int(found[1]) < 180
    assert int(found[2]) > 10
    assert "the server objected" not in out
    assert "motion: units: centimetres" in out
    assert "motion: up: Y" in out
    row = re.search(r"capture to decoded frame((?: +[\d.]+){4})", out)
    assert row, out
    ages = [float(value) for value in row[1].split()]
    assert ages == sorted(ages)
    assert ages[0] >= 45.0, "a frame can't be younger than the tracker's latency"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--server", "http://127.0.0.1:9"], "doesn't answer"),
        (["--server", "nowhere"], "no http or https address"),
        (["--motion", "moonwalk"], "moonwalk"),
        (["--motion-units", "mm"], "not a human's"),
        (["--motion-joint", "head=Nobody"], "Nobody"),
        (["--garment", "armour"], "armour"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(server, capsys, options, said):
    where = [] if "--server" in options else ["--server", server.url]
    assert main(["headset-sim", "--seconds", "1", *where, *options]) == 2
    err = capsys.readouterr().err
    assert said in err
    assert err.count("\n") == 1


def test_a_motion_is_read_as_it_is_told_and_what_was_found_is_told(capsys):
    nowhere = ["--server", "http://127.0.0.1:9"]
    assert main(["headset-sim", *nowhere, "--motion-units", "cm", "--motion-up", "x", "--motion-facing", "z"]) == 2
    out = capsys.readouterr().out
    for note in ("units: centimetres, as told", "up: X, as told"):
        assert f"motion: {note}" in out
