"""What is armed, and which effects a garment and its motion call for."""

from dataclasses import replace

import pytest
import tasks
from pretended_effects import CALM, Compiled
from scripted_worker import InThisProcess

from tryon_server.app import BUILT_IN_PATTERNS
from tryon_server.runtime.arming import Armoury
from tryon_server.runtime.beside import NotMade
from tryon_server.runtime.effect_choice import called_for
from tryon_server.runtime.motions import load_motion
from tryon_server.runtime.order import DrapeOrder
from tryon_server.runtime.production import build_drape
from tryon_server.runtime.sources import MotionSource


class Clock:
    now = 0.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


def armoury(clock, task=Compiled):
    return Armoury(InThisProcess(clock, 1.0), "cpu", task)


def test_what_is_wanted_is_compiled_one_after_the_other_and_what_is_held_never(clock):
    arms = armoury(clock)
    arms.hold(["gravity"])
    arms.want(["gravity", "wind"])
    arms.want(["wind", "pressure"])
    assert arms.compiling == ("wind",)
    assert not arms.is_ready("wind")
    assert arms.look() is None
    clock.now = 1.5
    assert arms.look() is None
    assert arms.is_ready("wind")
    arms.want(["wind", "pressure"])
    assert arms.compiling == ("pressure",)
    clock.now = 3.0
    arms.look()
    assert arms.compiling == ()


def test_what_could_not_be_compiled_is_left_to_who_binds_it(clock):
    arms = armoury(clock, lambda _names, _device: tasks.fail)
    arms.want(["wind"])
    clock.now = 1.5
    assert isinstance(arms.look(), NotMade)
    assert arms.is_ready("wind")
    assert arms.look() is None


@pytest.mark.parametrize(
    ("what", "names"),
    [
        ({}, set()),
        ({"speed": 2.0}, {"wind"}),
        ({"speed": 1.0}, set()),  # 0.72 Pa on 1.8 Pa
        ({"speed": 1.0, "weight": 0.8}, {"wind"}),  # silk, which leans at 0.75 m/s
        ({"off_body": 0.09}, {"wind"}),
        ({"off_body": 0.06}, set()),
        ({"stretch": 1.15}, {"stretch_curves", "adhesion"}),
        ({"stretch": 1.15, "close": 0.3}, {"stretch_curves"}),
        ({"layered": True}, {"adhesion"}),
        ({"closed": True}, {"pressure"}),
        ({"limit": 1.0, "stretch": 1.3}, set()),
    ],
)
def test_each_trait_calls_for_its_effects_and_says_why(what, names):
    found = called_for(replace(CALM, **what))
    assert set(found) == names
    assert all(found.values())


def test_reasons_add_up():
    why = called_for(replace(CALM, speed=2.0, off_body=0.096))["wind"]
    assert "2.0 m/s" in why
    assert "10 cm" in why


def test_a_walking_skirt_calls_for_wind_and_for_nothing_else():
    """It is not tight: single triangles at its seams and its elastic are stretched far, a tenth of the cloth is not."""
    order = DrapeOrder(BUILT_IN_PATTERNS / "skirt.json", "cotton_jersey", "draft", "cpu", 0.05)
    drape = build_drape(order, lambda *_: None)
    walk = MotionSource(load_motion("walk", drape.outfit.body), drape.pose)
    t, found, farthest = 0.0, {}, 1.0
    for frame in range(70):
        move = walk.next(1 / 30)
        t += move.dt
        drape.leap(move.leap)
        farthest = max(farthest, drape.advance(move.pose, t).max_stretch)
        if frame >= 40 and frame % 10 == 0:
            found |= called_for(drape.effects.character())
    assert set(found) == {"wind"}, found
    tenth = drape.effects.character().stretch
    assert farthest - 1 > 2 * (tenth - 1), "some triangle of it is stretched twice as far as a tenth"
