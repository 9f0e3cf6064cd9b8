"""Cases do what their names say: hands meet, sleeves go into each other, a hem reaches the floor, turns stay wound."""

import numpy as np
import pytest
from harness.scene import Ask
from harness.wearer import BODY, REST, posed
from scenes import named
from scenes.poses import ARMS_CROSSED, CLASPED
from scenes.twists import linked
from scipy.spatial import cKDTree


def skin(turns, *bones):
    """(K, 3) m of the skin that goes with these bones more than with others, in a pose."""
    most = BODY.skin_joints[np.arange(BODY.vertex_count), BODY.skin_weights.argmax(1)]
    return BODY.surface(posed(turns))[np.isin(most, [BODY.index_of[bone] for bone in bones])]


@pytest.mark.parametrize("bones", [("hand", "fingers"), ("forearm", "forearm_twist")], ids=lambda bones: bones[0])
def test_clasped_hands_and_forearms_meet_before_the_belly(bones):
    left, right = (skin(CLASPED, *(f"{side}_{bone}" for bone in bones)) for side in ("left", "right"))
    assert cKDTree(left).query(right)[0].min() < 0.01
    assert 0.85 < left[:, 1].mean() < 1.2
    assert left[:, 2].mean() > BODY.rest_joints[0, 2]


@pytest.mark.long
def test_sleeves_are_led_into_each_other():
    """Past the middle: what the sleeves cover of one arm lies where the other's lies, as in a mirror."""
    cloth = named("arms_through_each_other").set_up(Ask(150)).sim.cloth_positions()
    bones = ("left_upper_arm", "left_upper_arm_twist", "left_forearm")
    covered = cKDTree(cloth).query(skin({}, *bones))[0] < 0.03
    assert covered.sum() > 50
    assert skin(ARMS_CROSSED, *bones)[covered][:, 0].min() < -0.01


@pytest.mark.long
def test_the_hem_of_the_long_skirt_is_at_the_ankles():
    x = named("heavy_long_skirt").set_up(Ask(300)).sim.cloth_positions()
    assert 0.02 < x[:, 1].min() < 0.12
    assert REST.root[1] - x[:, 1].min() > 0.8


def test_links_are_counted():
    angle = np.linspace(0, 6 * np.pi, 200)  # three turns about a straight line
    helix = np.column_stack([0.01 * np.cos(angle), np.linspace(0, 1, 200), 0.01 * np.sin(angle)])
    straight = np.column_stack([0 * angle, np.linspace(0, 1, 200), 0 * angle])
    assert abs(linked(helix, straight)) == 3
    assert linked(helix, straight) == linked(straight, helix) == -linked(helix * [1, 1, -1], straight)
    assert linked(helix + [0.05, 0, 0], straight) == 0
