"""The demo's motions are ours: a script reproduces them to the byte, they loop, and they ask for nothing wild."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from body_cases import DEMO_MOTIONS, REPOSITORY

from tryon_solver.body import BodyModel, Motion, parse_bvh, quaternions, retarget
from tryon_solver.body.feet import world_tracks
from tryon_solver.body.report import report_motion

NAMES = ("jumping_jack", "squat", "turn", "walk")


@pytest.fixture(scope="module")
def motions() -> dict[str, Motion]:
    from tryon_solver.body import default_body

    model = default_body()
    return {name: retarget(parse_bvh((DEMO_MOTIONS / f"{name}.bvh").read_text(), name=name), model) for name in NAMES}


def test_script_reproduces_the_committed_files_to_the_byte(tmp_path: Path) -> None:
    script = REPOSITORY / "scripts" / "make_demo_motions.py"
    subprocess.run([sys.executable, str(script), "--out", str(tmp_path)], check=True, capture_output=True)
    written = sorted(path.name for path in tmp_path.iterdir())
    assert written == sorted(path.name for path in DEMO_MOTIONS.glob("*.bvh")) == [f"{name}.bvh" for name in NAMES]
    for name in written:
        assert (tmp_path / name).read_bytes() == (DEMO_MOTIONS / name).read_bytes(), name


@pytest.mark.parametrize("name", NAMES)
def test_motion_loops_at_60_hertz_for_some_seconds(motions: dict[str, Motion], name: str) -> None:
    motion = motions[name]
    assert motion.dt == pytest.approx(1 / 60, rel=1e-4)
    assert 4.0 <= motion.duration <= 8.0
    np.testing.assert_allclose(motion.roots[-1], motion.roots[0], atol=1e-4)
    difference = quaternions.multiply(quaternions.conjugate(motion.rotations[-1]), motion.rotations[0])
    assert np.degrees(quaternions.angle_of(difference)).max() < 0.01


@pytest.mark.parametrize("name", NAMES)
def test_motion_moves_continuously_across_the_seam_too(body: BodyModel, motions: dict[str, Motion], name: str) -> None:
    positions, _ = world_tracks(body, motions[name])
    velocities = np.diff(np.concatenate([positions, positions[1:3]]), axis=0) / motions[name].dt
    changes = np.linalg.norm(np.diff(velocities, axis=0), axis=2) / motions[name].dt
    assert np.linalg.norm(velocities, axis=2).max() < 5.0
    assert changes.max() < 100.0, "m/s^2, some ten times gravity: a foot that lands, not a jump in the data"


@pytest.mark.parametrize("name", NAMES)
def test_motion_stays_within_two_metres(motions: dict[str, Motion], name: str) -> None:
    assert np.abs(motions[name].roots[:, [0, 2]]).max() < 2.0


@pytest.mark.parametrize("name", NAMES)
def test_knees_and_elbows_bend_the_human_way(body: BodyModel, motions: dict[str, Motion], name: str) -> None:
    positions, turns = world_tracks(body, motions[name])
    for side in ("left", "right"):
        hip, knee, ankle, shoulder, elbow, wrist = (
            positions[:, body.index_of[f"{side}_{joint}"]]
            for joint in ("thigh", "shin", "foot", "upper_arm", "forearm", "hand")
        )
        ahead = quaternions.rotate(turns[:, body.index_of[f"{side}_foot"]], np.tile([0.0, 0.0, 1.0], (len(hip), 1)))
        assert ((knee - 0.5 * (hip + ankle)) * ahead).sum(axis=1).min() > -0.01, "a knee bends backwards"
        rest = [body.rest_joints[body.index_of[f"{side}_{joint}"]] for joint in ("upper_arm", "forearm", "hand")]
        hinge = np.cross(rest[1] - rest[0], rest[2] - rest[1])
        upper = turns[:, body.index_of[f"{side}_upper_arm_twist"]]
        hinge = quaternions.rotate(upper, np.tile(hinge / np.linalg.norm(hinge), (len(hip), 1)))
        bend = (np.cross(elbow - shoulder, wrist - elbow) * hinge).sum(axis=1)
        assert bend.min() > 0.0, "an elbow bends backwards"


def test_standing_feet_do_not_slide() -> None:
    for name in NAMES:
        clip = parse_bvh((DEMO_MOTIONS / f"{name}.bvh").read_text())
        positions, turns = clip.world()
        for side in ("Left", "Right"):
            foot = clip.joint_names.index(f"{side}Foot")
            ball = np.tile([0.0, -0.07, 0.13], (clip.frame_count, 1))
            ball = positions[:, foot] + quaternions.rotate(turns[:, foot], ball)
            heel = np.tile([0.0, -0.07, -0.05], (clip.frame_count, 1))
            heel = positions[:, foot] + quaternions.rotate(turns[:, foot], heel)
            for point in (ball, heel):
                down = point[:, 1] < 5e-4
                planted = down[1:] & down[:-1]
                assert planted.sum() > 0.2 * clip.frame_count
                slid = np.linalg.norm(np.diff(point[:, [0, 2]], axis=0), axis=1)[planted] / clip.dt
                assert np.percentile(slid, 95) < 0.1, f"{name}: {side} slides at {slid.max():.3f} m/s"


@pytest.mark.parametrize("name", NAMES)
def test_arms_never_cut_trunk_or_legs(body: BodyModel, motions: dict[str, Motion], name: str) -> None:
    found = report_motion(body, motions[name], every=30)
    assert found.frames_looked_at >= 10
    assert not [parts for parts in found.crossings if "arm" in parts], found
    assert found.largest_step == pytest.approx(found.largest_speed * motions[name].dt)
