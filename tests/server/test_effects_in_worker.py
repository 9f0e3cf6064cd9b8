"""Effects of a running session: from absent over armed to active, at most one frame missed, and nothing changed where
one is refused."""

from dataclasses import replace

import analytic_drape
import numpy as np
import pytest
from pretended_effects import CALM
from scripted_worker import allow, frames, work

from tryon_server.sessions.commands import ChangeEffect, ChangePattern, MeasureEffects, Run, WearFabric
from tryon_server.sessions.events import EditMade, EffectRefused, EffectsTold, FrameReady, TopologyReady, Troubled
from tryon_solver.effect_words.table import live

ASKED = 0.5  # s, when the first command comes
INTERVAL = 0.02  # s, between frames
COMPILING = 0.4  # s, that compiling takes


def told(*commands, apart=0.05, until=3.0, seconds_beside=COMPILING, build=analytic_drape.build, **more):
    """A running worker that is told these so long [s] apart; its connection, and what was dressed."""
    drapes = []

    def remember(order, progress):
        drapes.append(build(order, progress))
        return drapes[-1]

    script = [(0.001, Run(True)), (0.001, allow(10_000))]
    script += [(ASKED + apart * k, command) for k, command in enumerate(commands)]
    return work(script, until, build=remember, seconds_beside=seconds_beside, **more), drapes


def news(connection):
    return [event for event in connection.events if isinstance(event, EffectsTold)]


def states(event):
    return {state.name: state for state in event.effects.effects}


def last(connection, name):
    return states(news(connection)[-1])[name]


def refusals(connection):
    return [event for event in connection.events if isinstance(event, EffectRefused)]


def answered(connection):
    return [ticket for event in news(connection) for ticket in event.answers]


def wind(ticket, **parameters):
    return ChangeEffect(ticket, "wind", "active", parameters)


def test_what_is_worn_is_told_once_it_is_dressed():
    connection, _ = told()
    (first,) = news(connection)
    found = states(first)
    assert {name for name, state in found.items() if state.state == "active"} == set(live())
    assert found["wind"].state == "absent"
    assert found["gravity"].parameters == {"acceleration": [0.0, -9.81, 0.0], "ramp": 0.1}
    assert found["elastic"].parameters == {}, "its lines are nobody's yet"
    assert first.wishes == {}


def test_an_effect_is_compiled_beside_and_bound_between_two_frames():
    connection, (sheet,) = told(wind(7, velocity=[1, 0, 0]))
    seen = [(states(event)["wind"].state, states(event)["wind"].pending) for event in news(connection)]
    assert seen == [("absent", ""), ("absent", "compiling"), ("armed", "binding"), ("active", "")]
    assert answered(connection) == [7]
    assert sheet.effects.bound == 1
    assert states(news(connection)[-1])["air_drag"].state == "armed", "wind takes its place"
    assert "takes its place" in last(connection, "air_drag").why
    times = [t for t, event in zip(connection.times, connection.events) if isinstance(event, FrameReady)]
    between = np.diff([t for t in times if t > ASKED - 0.1])
    assert between.max() < 2 * INTERVAL + 0.005, "at most one frame is missed"
    assert len(frames(connection)) > 100
    assert len([e for e in connection.events if isinstance(e, TopologyReady)]) == 1, "it is the same garment"


def test_values_are_written_at_once_and_nothing_is_bound():
    connection, (sheet,) = told(wind(1, velocity=[1, 0, 0]), wind(2, velocity=[0, 0, 2]), apart=1.0)
    assert answered(connection) == [1, 2]
    assert (sheet.effects.bound, sheet.effects.written) == (1, 1)
    assert last(connection, "wind").parameters["velocity"] == [0.0, 0.0, 2.0]
    assert sheet.effects.asked["wind"]["velocity"] == [0.0, 0.0, 2.0]


def test_changes_that_come_meanwhile_are_made_at_once():
    connection, (sheet,) = told(
        wind(1), wind(2, velocity=[0, 0, 1]), ChangeEffect(3, "sleep", "absent"), seconds_beside=1.0
    )
    assert answered(connection) == [1, 2, 3]
    assert sheet.effects.bound == 1
    assert last(connection, "sleep").state == "absent"
    assert last(connection, "sleep").why == "taken off"


@pytest.mark.parametrize("ends", [True, False])
def test_what_is_put_on_where_nothing_moved_any_more_is_seen(ends):
    """A session without poses rests after 12 s. What acts then moves the cloth, and gusts as long as they blow."""
    gusts = {} if ends else {"gusts": 0.3}
    connection, _ = told(MeasureEffects(1), wind(2, velocity=[3, 0, 0], **gusts), apart=20.0, until=50.0, motion=None)
    when = np.array([t for t, event in zip(connection.times, connection.events) if isinstance(event, FrameReady)])
    put_on = ASKED + 20.0
    assert not ((when > 13.0) & (when < put_on)).any(), "it rested"
    assert ((when > put_on) & (when < put_on + 10.0)).sum() > 400
    assert (when > put_on + 14.0).any() != ends


def test_armed_is_compiled_and_no_more():
    connection, (sheet,) = told(ChangeEffect(1, "pressure", "armed"), until=2.0)
    assert answered(connection) == [1]
    assert last(connection, "pressure").state == "armed"
    assert sheet.effects.bound == 0
    assert "pressure" not in sheet.effects.asked


def test_null_parameters_are_as_they_stand():
    connection, (sheet,) = told(
        wind(1, velocity=[0, 0, 2]), ChangeEffect(2, "wind", "absent"), ChangeEffect(3, "wind", "active"), apart=0.8
    )
    assert answered(connection) == [1, 2, 3]
    assert sheet.effects.asked["wind"]["velocity"] == [0.0, 0.0, 2.0]


@pytest.mark.parametrize(
    ("command", "place"),
    [
        (ChangeEffect(1, "wnd", "active"), "name"),
        (ChangeEffect(1, "body_contact", "absent"), "name"),
        (ChangeEffect(1, "self_contact", "armed"), "name"),
        (wind(1, velocity=[1, 2]), "parameters.velocity"),
        (ChangeEffect(1, "elastic", "active"), "parameters.lines"),
        (ChangeEffect(1, "pressure", "active", {"panels": ["x"]}), "parameters.panels[0]"),
        (ChangeEffect(1, "pressure", "active", {"pressure": 666}), "parameters.pressure"),
        (ChangeEffect(1, "pressure", "active", {"pressure": 13}), "name"),
    ],
)
def test_what_is_refused_changes_nothing(command, place):
    connection, (sheet,) = told(command)
    (refused,) = refusals(connection)
    assert (refused.ticket, refused.place) == (1, place)
    assert refused.message
    assert refused.remedy
    assert answered(connection) == []
    assert sheet.effects.asked == live()
    assert news(connection)[-1].wishes == {}
    assert [e for e in connection.events if isinstance(e, Troubled)] == []


def test_nothing_is_asked_of_what_is_not_worn():
    connection, _ = told(wind(1), fabric="tight")
    assert refusals(connection)[0].place == "name"


def test_times_are_measured_when_they_are_asked_for():
    connection, (sheet,) = told(MeasureEffects(5))
    assert sheet.effects.measured == 1
    assert answered(connection) == [5]
    gravity = last(connection, "gravity")
    assert gravity.ms == 2.625
    assert gravity.stages == {"add_gradient": 0.25, "start_step": 0.125}
    assert last(connection, "wind").ms is None
    assert "9 measured" in news(connection)[-1].effects.plan


def test_what_is_asked_for_holds_for_the_next_garment_and_the_next_session():
    edit = ChangePattern("edit", 9, {"kind": "scale_piece", "panel": "front", "factors": [0.7, 1.0]})
    connection, _ = told(wind(1, velocity=[0, 0, 2]), edit, apart=1.0, until=4.0)
    assert [e.ticket for e in connection.events if isinstance(e, EditMade)] == [9]
    assert last(connection, "wind").state == "active"
    wishes = news(connection)[-1].wishes
    assert wishes["effects"]["wind"]["parameters"]["velocity"] == [0.0, 0.0, 2.0]
    again, (sheet,) = told(effects=wishes)
    assert sheet.effects.asked["wind"]["velocity"] == [0.0, 0.0, 2.0]
    assert news(again)[-1].wishes == wishes


def test_a_garment_that_is_dressed_anew_comes_to_have_them_too():
    mesh = {"fabric": "mesh", "motion": "sway"}
    connection, drapes = told(wind(1), WearFabric("resting"), apart=1.0, until=4.0, **mesh)
    assert len(drapes) == 2
    assert drapes[1].effects.bound == 1
    assert last(connection, "wind").state == "active"


def test_what_a_garment_can_not_be_worn_with_is_armed_and_says_why():
    wishes = {"effects": {"pressure": {"state": "active", "parameters": {"pressure": 666.0, "panels": []}, "why": "x"}}}
    connection, (sheet,) = told(effects=wishes)
    state = last(connection, "pressure")
    assert state.state == "armed"
    assert "it would burst" in state.why
    assert sheet.effects.bound == 0


def test_what_the_pattern_has_says_so_and_can_be_taken_off_and_back():
    pressed = {"lines": [{"along": [{"panel": "front", "edge": 1}], "angle": 60.0}]}

    def creased(order, progress):
        sheet = analytic_drape.build(order, progress)
        sheet.effects.own = {"creases": pressed}
        sheet.effects.asked = {**sheet.effects.asked, "creases": pressed}
        return sheet

    off, on = (ChangeEffect(ticket, "creases", state) for ticket, state in ((1, "absent"), (2, "active")))
    connection, (sheet,) = told(off, on, apart=1.0, build=creased)
    first, *_ = news(connection)
    assert states(first)["creases"].why == "the pattern has it"
    off_then = next(event for event in news(connection) if 1 in event.answers)
    assert states(off_then)["creases"].why == "taken off"
    assert states(off_then)["creases"].state == "absent"
    assert sheet.effects.asked["creases"] == pressed
    assert answered(connection) == [1, 2]


def brisk(order, progress):
    """A sheet in layers that goes at 2 m/s."""
    sheet = analytic_drape.build(order, progress)
    sheet.effects.now = replace(CALM, speed=2.0, layered=True)
    return sheet


def test_by_itself_it_arms_what_garment_and_motion_may_call_for_and_says_why():
    on, off = (ChangeEffect(ticket, "auto", state) for ticket, state in ((1, "active"), (2, "absent")))
    connection, (sheet,) = told(on, off, apart=1.5, build=brisk)
    during = [states(event) for event in news(connection) if event.effects.auto][-1]
    assert during["wind"].state == during["adhesion"].state == "armed"
    assert "2.0 m/s" in during["wind"].why
    assert "lies on another" in during["adhesion"].why
    assert during["pressure"].state == "absent"
    assert sheet.effects.bound == 0, "what is armed acts in nothing"
    assert answered(connection) == [1, 2]
    assert not news(connection)[-1].effects.auto
    assert last(connection, "wind").state == "absent"


def test_what_somebody_has_taken_off_is_not_armed_by_itself_and_that_is_said():
    put, taken = ChangeEffect(1, "wind", "active", {"velocity": [2.0, 0.0, 0.0]}), ChangeEffect(2, "wind", "absent")
    connection, _ = told(put, taken, ChangeEffect(3, "auto", "active"), apart=1.0, until=6.0, build=brisk)
    wind = states(news(connection)[-1])["wind"]
    assert wind.state == "absent"
    assert wind.why.startswith("taken off by who asked for that")
    assert last(connection, "adhesion").state == "armed"


def test_where_it_arms_nothing_it_says_what_it_looked_at():
    connection, _ = told(ChangeEffect(1, "auto", "active"))
    found = states(news(connection)[-1])
    looked = {name for name, effect in found.items() if effect.why.startswith("looked for by itself: ")}
    assert looked == {"wind", "stretch_curves", "adhesion", "pressure"}
    assert {found[name].state for name in looked} == {"absent"}
    assert "hangs 1 cm off the body, where over 8 call for it" in found["wind"].why
    assert answered(connection) == [1]
    assert len(news(connection)) <= 3, "it is told once, not each time it looks"


def test_nothing_is_told_and_nothing_is_looked_at_while_nothing_is_asked():
    connection, (sheet,) = told(until=2.0)
    assert len(news(connection)) == 1
    assert (sheet.effects.bound, sheet.effects.written, sheet.effects.measured) == (0, 0, 0)
