"""A body that is elsewhere from one frame to the next takes its garment along; limbs that are, are followed."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from contact_scenes import DT, sleeve_on_limb
from frame_judge import FrameJudge
from scipy.spatial.transform import Rotation

from tryon_solver.body.pose import Pose
from tryon_solver.scene import AirDrag
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build
from tryon_solver.stepping.leap import feel_motion

SETTINGS = PRESETS["live"]
LEAPS = 3  # the frame of it
PLAY = 14e-3  # m, from one side of the limb to the other


def elsewhere(pose: Pose, far: float, turned: float) -> Pose:
    """The pose `far` m away across the limb, turned as a whole by so many degrees."""
    root = Rotation.from_euler("y", turned, degrees=True) * Rotation.from_quat(pose.rotations[0])
    return Pose(pose.root + [0.0, 0.0, far], np.vstack([root.as_quat(), pose.rotations[1:]]))


@pytest.mark.parametrize(("far", "turned"), [(0.1, 0.0), (3.0, 180.0)])
def test_who_is_elsewhere_wears_the_same(far, turned):
    case = sleeve_on_limb()
    sims = [build(case.scene, SETTINGS, "cpu", case.pose_at(0)) for _ in range(2)]
    scene = case.scene
    judge = FrameJudge(scene.garment.faces, scene.body.faces, sims[0].cloth_positions(), sims[0].body_positions())
    there = elsewhere(case.pose_at(0), far, turned)
    for k in range(1, LEAPS + 12):
        stays, leaps = sims
        report = leaps.advance(there if k >= LEAPS else case.pose_at(0), k * DT)
        stays.advance(case.pose_at(0), k * DT)
        assert judge.judge(leaps.cloth_positions(), leaps.body_positions()).clean, k
        assert report.body_lag < 1e-3
        assert np.linalg.norm(leaps.state.v.numpy(), axis=1).max() < SETTINGS.hardest_kick
    about = Rotation.from_euler("y", turned, degrees=True)
    expected = about.apply(sims[0].cloth_positions()) + [0.0, 0.0, far]
    assert np.linalg.norm(sims[1].cloth_positions() - expected, axis=1).max() < PLAY


def test_what_is_felt_of_a_kick():
    """All of it up to the hardest, (h/k)^2 of it beyond; what is not felt, the start has moved along with."""
    case = sleeve_on_limb()
    sim = build(case.scene, replace(SETTINGS, hardest_kick=2.0), "cpu", case.pose_at(0))
    x = sim.state.x.numpy()
    kicks = np.zeros((len(x), 3), np.float32)
    kicks[0], kicks[1], kicks[2] = [1.9, 0.0, 0.0], [0.0, -8.0, 0.0], [0.0, 0.0, 400.0]
    before = np.zeros_like(kicks)
    before[:3] = [0.5, 0.0, 0.0]
    sim.body.felt.assign(before)
    sim.state.x_start.assign(x - DT * (before + kicks))
    start = sim.state.x_start.numpy()
    feel_motion(sim)
    felt, moved = sim.body.felt.numpy(), sim.state.x_start.numpy()
    np.testing.assert_array_equal(moved[[0, *range(3, len(x))]], start[[0, *range(3, len(x))]])
    for vertex, share in ((0, 1.0), (1, (2 / 8) ** 2), (2, (2 / 400) ** 2)):
        np.testing.assert_allclose(felt[vertex], before[vertex] + share * kicks[vertex], atol=1e-3)
        np.testing.assert_allclose((x[vertex] - moved[vertex]) / DT, felt[vertex], atol=1e-3)


def test_a_body_that_goes_on_fast_is_followed_in_the_end():
    case = sleeve_on_limb()
    sim = build(case.scene, replace(SETTINGS, hardest_kick=2.0), "cpu", case.pose_at(0))
    x, felt = sim.state.x.numpy(), []
    for _ in range(8):
        sim.state.x_start.assign(x - np.float32(DT) * np.array([5.0, 0.0, 0.0], np.float32))
        feel_motion(sim)
        felt.append(sim.body.felt.numpy()[:, 0].max())
    assert felt[0] == pytest.approx(0.8, abs=1e-3)
    assert np.all(np.diff(felt) >= -1e-3)
    assert felt[-1] == pytest.approx(5.0, abs=1e-3)


def test_who_comes_along_feels_nothing_and_has_the_body_s_speed_in_the_end():
    """At 15 m/s sideways, which would fling it off: it lies where it lay on the body, which goes on at that speed. No
    air is about: it would hold it up."""
    case = sleeve_on_limb()
    scene = replace(case.scene, effects=tuple(it for it in case.scene.effects if not isinstance(it, AirDrag)))
    sim, stays = (build(scene, SETTINGS, "cpu", case.pose_at(0)) for _ in range(2))
    speed = 15.0
    sim.come_along()
    for k in (1, 2):
        sim.advance(elsewhere(case.pose_at(0), speed * k * DT, 0.0), k * DT)
        stays.advance(case.pose_at(0), k * DT)
        np.testing.assert_allclose(
            sim.cloth_positions() - [0.0, 0.0, speed * k * DT], stays.cloth_positions(), rtol=0, atol=1e-5
        )
        np.testing.assert_allclose(sim.state.v.numpy() - [0.0, 0.0, speed], stays.state.v.numpy(), rtol=0, atol=1e-3)
    assert not sim.comes_along


def test_who_comes_along_goes_as_the_limb_goes_around_which_it_lies():
    """Both go on with the limb; what it did before is forgotten by the one that comes along."""
    case = sleeve_on_limb()
    sim = build(case.scene, SETTINGS, "cpu", case.pose_at(0))
    sim.state.v.fill_(1.0)
    before = sim.cloth_positions()
    sim.come_along()
    sim.advance(case.pose_at(3), DT)
    moved, v = (sim.cloth_positions() - before) / DT, sim.state.v.numpy()
    assert np.linalg.norm(moved, axis=1).max() > 0.5, "the limb moves"
    assert np.linalg.norm(v - moved, axis=1).max() < 0.05
    assert not np.allclose(v, 1.0, atol=0.1)


def test_a_limb_that_leaps_is_followed_as_far_as_the_sub_steps_reach():
    """The root is where it is told to be at once; how far the limb is short of it is said until it is there."""
    case = sleeve_on_limb()
    settings = replace(SETTINGS, substep_travel=2e-3)
    sim = build(case.scene, settings, "cpu", case.pose_at(0))
    scene = case.scene
    judge = FrameJudge(scene.garment.faces, scene.body.faces, sim.cloth_positions(), sim.body_positions())
    goal = elsewhere(case.pose_at(40), 1.5, 0.0)
    lags, said = [], []
    for k in range(1, 10):
        report = sim.advance(case.pose_at(0) if k < LEAPS else goal, k * DT)
        assert judge.judge(sim.cloth_positions(), sim.body_positions()).clean, k
        assert report.substeps <= settings.most_substeps
        np.testing.assert_array_equal(sim.body.pose.root, goal.root if k >= LEAPS else case.pose_at(0).root)
        skin = scene.body.surface(goal if k >= LEAPS else case.pose_at(0))
        true = np.linalg.norm(sim.body_positions() - skin, axis=1).max()
        assert report.body_lag == pytest.approx(true, abs=1e-5), k
        lags.append(report.body_lag)
        said.append("the pose leaps" in report.advice)
    begun = lags[LEAPS - 1 :]
    assert said == [False] * (LEAPS - 1) + [lag > 0.01 for lag in begun]
    assert sum(said) >= 2
    assert max(lags[: LEAPS - 1]) < 1e-3
    assert all(before - after > 0.02 for before, after in pairwise(begun) if after > 0.01)
    assert sim.body.pose is goal
    assert lags[-1] < 5e-3
