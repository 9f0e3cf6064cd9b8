"""A body's motion comes in intervals, each of which begins where the body has come to."""

import numpy as np
from contact_scenes import DT, sleeve_on_limb

from tryon_solver.body.pose import Pose
from tryon_solver.simulation import Simulation, build

FRAMES = 3


def bent_limb() -> tuple[Simulation, list]:
    """A sleeve on a limb, and the stances whose transforms it asks the limb for from now on."""
    case = sleeve_on_limb()
    sim = build(case.scene, pose=case.pose_at(0))
    asked: list = []
    find = sim.body.moving.transforms

    def noted(stance):
        asked.append(stance)
        return find(stance)

    sim.body.moving.transforms = noted
    return sim, asked


def play(sim):
    """Frames of two intervals each, the limb bending by 3 degrees a frame."""
    case = sleeve_on_limb()
    for k in range(1, FRAMES + 1):
        sim.advance(case.pose_at(2 * k), 2 * k * DT)


def test_transforms_of_a_stance_are_found_once_and_serve_twice():
    remembers, asked = bent_limb()
    play(remembers)
    steps = 2 * FRAMES
    assert len(asked) == steps == len({id(stance) for stance in asked})
    forgets, asked = bent_limb()
    forgets.body.transforms = lambda: forgets.body.moving.transforms(forgets.body.pose)
    play(forgets)
    assert len(asked) == 2 * steps
    np.testing.assert_array_equal(remembers.state.x.numpy(), forgets.state.x.numpy())


def test_intervals_lead_to_the_pose():
    sim, _ = bent_limb()
    begin, end = sim.body.pose, sleeve_on_limb().pose_at(9)
    intervals = list(sim.pose_intervals(end, 3 * DT))
    assert len(intervals) == 3
    assert intervals[-1].end is end
    for k, interval in enumerate(intervals, start=1):
        expected = Pose.interpolate(begin, end, k / 3)
        np.testing.assert_allclose(interval.end.rotations, expected.rotations, atol=1e-12)


def test_stance_elsewhere_is_looked_at_anew():
    """After the origin has moved, the limb starts from other transforms than it ended with."""
    sim, asked = bent_limb()
    play(sim)
    sim.move_origin(np.array([1.0, 0.0, 0.0]))
    start = sim.body.transforms()
    assert asked[-1] is sim.body.pose
    np.testing.assert_array_equal(start[0, :3, 3], [-1.0, 0.0, 0.0])
