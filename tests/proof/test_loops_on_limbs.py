"""Linking numbers of loops with the ways through a body."""

import numpy as np
import pytest
from loops_on_limbs import LoopsOnLimbs, fan_crossings

NAMES = ("pelvis", "chest", "head", "left_arm", "left_hand", "left_leg", "right_leg")
PARENTS = np.array([-1, 0, 1, 1, 3, 0, 0])
JOINTS = np.array(
    [[0, 0, 0], [0, 0.4, 0], [0, 0.7, 0], [0.2, 0.4, 0], [0.7, 0.4, 0], [0.1, -0.8, 0], [-0.1, -0.8, 0]], float
)
RING = np.column_stack([np.cos(np.arange(16) * np.pi / 8), np.zeros(16), np.sin(np.arange(16) * np.pi / 8)])


def around(centre, radius, along):
    """A ring of 16 vertices around an axis of space."""
    axes = {"y": [0, 1, 2], "x": [1, 0, 2], "z": [0, 2, 1]}[along]
    return np.array(centre) + radius * RING[:, axes]


LIMBS = LoopsOnLimbs([np.arange(16)], NAMES, PARENTS, JOINTS)


def passes(ring):
    return dict(zip(LIMBS.ends, LIMBS.crossings(ring, JOINTS)[0][0]))


def slide(before, now):
    return LIMBS.slide(*(LIMBS.crossings(ring, JOINTS)[1][0] for ring in (before, now)))


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
    count, places = fan_crossings(wavy, *ends)
    assert np.abs(count).tolist() == [1, 0]
    assert places[:, 0].tolist() == [0]
    assert places[0, 1] == pytest.approx(0.5, abs=0.1)
    assert (fan_crossings(wavy, *ends[::-1])[0] == -count).all()
    assert (fan_crossings(wavy[::-1], *ends)[0] == -count).all()


def test_slide_is_measured_along_the_bones():
    """Up the arm, from there over the chest to the neck, and from the trunk to both legs; off the hand, without end."""
    sleeve = around([0.6, 0.4, 0], 0.1, "x")
    assert slide(sleeve, sleeve) == 0
    assert slide(sleeve, around([0.35, 0.4, 0], 0.1, "x")) == pytest.approx(0.25, abs=0.01)
    assert slide(sleeve, around([0, 0.6, 0], 0.1, "y")) == pytest.approx(0.6 + 0.2, abs=0.01)
    leg = np.hypot(0.1, 0.8)
    assert slide(around([0, 0.2, 0], 0.4, "y"), around([0, -0.4, 0], 0.4, "y")) == pytest.approx(
        0.2 + leg / 2, abs=0.01
    )
    assert slide(sleeve, around([0.8, 0.4, 0], 0.1, "x")) == np.inf


def test_the_edge_of_a_hood_has_no_place_to_slide_from():
    face = around([0, 1.0, 0.2], 0.05, "z")
    assert not len(LIMBS.crossings(face, JOINTS)[1][0])
    assert slide(face, around([0, 0.9, 0.2], 0.05, "z")) == 0
