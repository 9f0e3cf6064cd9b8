"""Linking numbers of loops with the ways through a body."""

import numpy as np
from loops_on_limbs import LoopsOnLimbs, fan_crossings

NAMES = ("pelvis", "chest", "head", "left_arm", "left_hand", "left_leg", "right_leg")
PARENTS = np.array([-1, 0, 1, 1, 3, 0, 0])
JOINTS = np.array(
    [[0, 0, 0], [0, 0.4, 0], [0, 0.7, 0], [0.2, 0.4, 0], [0.7, 0.4, 0], [0.1, -0.8, 0], [-0.1, -0.8, 0]], float
)
RING = np.column_stack([np.cos(np.arange(16) * np.pi / 8), np.zeros(16), np.sin(np.arange(16) * np.pi / 8)])


def around(centre, radius, along):
    """A ring of 16 vertices around an axis of space."""
    axes = {"y": [0, 1, 2], "x": [1, 0, 2]}[along]
    return np.array(centre) + radius * RING[:, axes]


def passes(ring, joints=JOINTS):
    return dict(zip(ENDS, LoopsOnLimbs([np.arange(16)], NAMES, PARENTS).passes(ring, joints)[0]))


ENDS = LoopsOnLimbs([], NAMES, PARENTS).ends


def test_a_sleeve_is_passed_by_the_arm_alone():
    found = passes(around([0.4, 0.4, 0], 0.1, "x"))
    assert abs(found["left_hand"]) == 1
    assert found["left_leg"] == found["right_leg"] == 0


def test_a_sleeve_off_the_hand_is_passed_by_nothing():
    assert not any(passes(around([0.8, 0.4, 0], 0.1, "x")).values())


def test_a_collar_is_passed_by_every_way_from_the_head():
    found = passes(around([0, 0.6, 0], 0.1, "y"))
    assert len(set(found.values())) == 1
    assert abs(found["left_hand"]) == 1


def test_a_collar_that_lets_a_shoulder_out_is_told():
    """The loop below the arm on its side: the arm no longer leaves through it."""
    collar = around([0, 0.45, 0], 0.3, "y")
    tilted = collar + np.column_stack([np.zeros(16), -0.3 * (collar[:, 0] > 0.15), np.zeros(16)])
    assert passes(collar) != passes(tilted)


def test_a_hem_may_slide_over_the_pelvis_but_let_no_leg_out():
    above, below = around([0, 0.1, 0], 0.4, "y"), around([0, -0.2, 0], 0.4, "y")
    one_leg = around([-0.3, -0.5, 0], 0.3, "y")
    assert passes(above) == passes(below)
    assert passes(one_leg) != passes(below)


def test_fan_crossings_don_t_depend_on_the_shape_of_the_loop():
    rng = np.random.default_rng(5)
    wavy = around([0, 0, 0], 0.4, "y") + 0.1 * rng.standard_normal((16, 3))
    ends = np.array([[0.05, 1, 0.02], [1.0, 1, 0]]), np.array([[0.03, -1, 0], [1.0, -1, 0]])
    assert np.abs(fan_crossings(wavy, *ends)).tolist() == [1, 0]
    assert (fan_crossings(wavy, *ends) == -fan_crossings(wavy, *ends[::-1])).all()
    assert (fan_crossings(wavy, *ends) == -fan_crossings(wavy[::-1], *ends)).all()
