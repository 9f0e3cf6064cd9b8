"""What is armed, and which effects a garment and its motion call for."""

from dataclasses import replace

import pytest
import tasks
from pretended_effects import CALM, Compiled
from scripted_worker import InThisProcess

from tryon_server.runtime.arming import Armoury
from tryon_server.runtime.beside import NotMade
from tryon_server.runtime.effect_choice import called_for


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
        ({"off_body": 0.06}, {"wind"}),
        ({"stretch": 1.15}, {"stretch_curves", "adhesion"}),
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
    why = called_for(replace(CALM, speed=2.0, off_body=0.06))["wind"]
    assert "2.0 m/s" in why
    assert "6 cm" in why
