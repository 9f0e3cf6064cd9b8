"""A blow at the least budget: conjugate gradients cut short lead a correction astray, and it is done again."""

import math
from dataclasses import replace

import pytest
from frame_judge import principal_stretches
from harness.scene import Ask
from scenes import named

from tryon_solver.materials.fabric import FABRICS
from tryon_solver.settings import PRESETS
from tryon_solver.stepping import correct, fly, overshoot, search

STEPS = 5  # of a 30th of a second; it lands in the second
HASTY = replace(PRESETS["draft"], correction_iterations=1)  # with its own it is not led astray here
LIMIT = FABRICS["cotton_jersey"].strain_limit


def nobody_flies(flight, _sim):
    flight.flies.zero_()
    flight.any.zero_()


@pytest.fixture(autouse=True)
def all_the_way(monkeypatch):
    """What leads astray is stopped before it stretches anything by the list of candidates, where that is held to its
    room, and brought back where the first move has led far uphill; and what flies stops short of the blow as one. None
    of these is done here."""
    monkeypatch.setattr(search, "PER_EDGE", 1e-6)
    monkeypatch.setattr(overshoot, "CALM", math.inf)
    monkeypatch.setattr(fly.Flight, "set_off", nobody_flies)


def landing(settings):
    """A square that falls on the corner of a cube: its largest stretch in any step until it has landed, void steps."""
    run = named("corner").set_up(Ask(900, settings))
    garment, largest, void = run.sim.scene.garment, 0.0, 0
    for k in range(1, STEPS + 1):
        report = run.advance(k * run.dt)
        stretches = principal_stretches(run.sim.cloth_positions(), garment.faces, garment.uv_corners)
        largest, void = max(largest, float(stretches[:, 1].max())), void + report.retries
        assert bool(report.retries) == ("void" in report.advice)
    return largest, void


def test_a_correction_that_was_led_astray_is_done_again():
    largest, void = landing(HASTY)
    assert largest <= 1.02 * LIMIT
    assert void == 0


def test_a_step_that_is_led_astray_again_goes_a_little():
    largest, void = landing(replace(HASTY, second_iterations=0))
    assert largest <= 1.02 * LIMIT
    assert void == 0


def test_a_step_that_no_share_keeps_from_going_astray_is_void(monkeypatch):
    monkeypatch.setattr(correct, "SHARES", ())
    largest, void = landing(replace(HASTY, second_iterations=0))
    assert largest <= 1.02 * LIMIT
    assert 0 < void < STEPS


def test_what_it_is_done_again_for(monkeypatch):
    """Taken as it came the cloth is stretched beyond what it keeps to above: the scene asks for it."""
    monkeypatch.setattr(correct, "led_astray", lambda *_: False)
    assert landing(HASTY)[0] > 1.02 * LIMIT


def test_no_second_budget_is_a_setting_and_less_than_none_an_error():
    with pytest.raises(ValueError, match=r"settings\.second_iterations"):
        replace(HASTY, second_iterations=-1)
