"""Who asks for effects is answered, everybody is told, and what was asked for is kept."""

import pytest
from session_driver import Driver

from tryon_protocol import (
    EffectsMessage,
    EffectState,
    ErrorMessage,
    MeasureEffectsMessage,
    ProtocolError,
    RemoveEffectMessage,
    SetEffectMessage,
)
from tryon_server.sessions.actions import AnswerEffects, KeepEffects
from tryon_server.sessions.commands import ChangeEffect, MeasureEffects
from tryon_server.sessions.effect_talk import MOST_WAITING
from tryon_server.sessions.events import EffectRefused, EffectsTold

WISHES = {"auto": False, "effects": {"wind": {"state": "active", "parameters": {}, "why": "asked for"}}}


def told(state="absent", *answers, wishes=None):
    message = EffectsMessage(effects=(EffectState(name="wind", state=state),))
    return EffectsTold(message, {} if wishes is None else wishes, answers)


@pytest.fixture
def driver():
    """A session whose effects were told, with two clients."""
    driver = Driver()
    driver.dressed()
    driver.simulation(told())
    driver.connect(1)
    driver.connect(2)
    return driver


def test_who_joins_is_told_the_effects(driver):
    assert driver.last(1, EffectsMessage).effects[0].state == "absent"


def test_what_clients_ask_is_ordered_with_tickets_of_its_own(driver):
    driver.say(1, SetEffectMessage(name="wind", parameters={"gusts": 0.5}, state="armed"))
    driver.say(2, RemoveEffectMessage(name="sleep"))
    driver.say(2, MeasureEffectsMessage())
    first, second = driver.ordered(ChangeEffect)
    (third,) = driver.ordered(MeasureEffects)
    assert (first.name, first.state, first.parameters) == ("wind", "armed", {"gusts": 0.5})
    assert (second.name, second.state) == ("sleep", "absent")
    assert len({first.ticket, second.ticket, third.ticket}) == 3


def test_a_refusal_is_for_who_asked(driver):
    driver.say(1, SetEffectMessage(name="wnd", request=9))
    driver.simulation(EffectRefused(driver.ordered(ChangeEffect)[0].ticket, "name", "there is none", "Use wind"))
    error = driver.last(1, ErrorMessage)
    assert (error.code, error.place, error.request) == ("effect_refused", "$.name", 9)
    assert (error.message, error.remedy) == ("there is none.", "Use wind.")
    assert driver.messages(2, ErrorMessage) == []


def test_news_are_for_all_and_who_asked_over_rest_is_answered(driver):
    ticket, actions = driver.session.effects.change("wind", "active", None)
    assert len(actions) == 1
    actions = driver.session.simulated(told("active", ticket, wishes=WISHES), driver.now)
    assert [action.wishes for action in actions if isinstance(action, KeepEffects)] == [WISHES]
    (answer,) = (action for action in actions if isinstance(action, AnswerEffects))
    assert (answer.ticket, answer.outcome.effects[0].state) == (ticket, "active")
    driver._note(actions)
    assert [driver.last(client, EffectsMessage).effects[0].state for client in (1, 2)] == ["active", "active"]
    again = driver.session.simulated(told("active", wishes=WISHES), driver.now)
    assert not [action for action in again if isinstance(action, KeepEffects)], "it is kept already"


def undressed():
    """A session whose garment is being put on, with two clients."""
    early = Driver()
    early.connect(1)
    early.connect(2)
    return early


def kept(driver, client=1):
    told_last = driver.last(client, EffectsMessage).kept
    return [(one.name, one.state, one.parameters, bool(one.refused)) for one in told_last]


def test_what_is_asked_before_the_garment_is_worn_is_kept_until_it_is():
    early = undressed()
    early.say(1, SetEffectMessage(name="wind", parameters={"velocity": [0, 0, 3]}, request=3))
    assert early.messages(1, ErrorMessage) == []
    assert early.last(1, EffectsMessage).effects == ()
    assert kept(early) == kept(early, 2) == [("wind", "active", {"velocity": [0, 0, 3]}, False)]
    ticket, actions = early.session.effects.change("gravity", "absent", None)
    (answer,) = (action for action in actions if isinstance(action, AnswerEffects))
    assert [one.name for one in answer.outcome.kept] == ["wind", "gravity"]
    early._note(actions)
    assert early.ordered(ChangeEffect) == [], "nothing is there yet that could be changed"
    assert list(early.stored) == [1, ticket], "it outlives the server"
    early.connect(3)
    assert kept(early, 3) == kept(early, 1), "who joins is told"
    early.simulation(told("absent"))
    ordered = early.ordered(ChangeEffect)
    assert [(one.name, one.state) for one in ordered] == [("wind", "active"), ("gravity", "absent")]
    assert len(kept(early)) == 2, "they are not so yet"
    early.simulation(told("active", ordered[0].ticket))
    assert kept(early) == [("gravity", "absent", None, False)]
    assert list(early.stored) == [ticket]
    early.simulation(told("active", ticket))
    assert (kept(early), early.stored) == ([], {})
    assert len(early.ordered(ChangeEffect)) == 2, "each is ordered once"


def test_what_an_earlier_session_kept_is_asked_for_in_the_one_that_continues_it():
    early = undressed()
    early._note(early.session.begin_with_changes([ChangeEffect(0, "wind", "armed", {"velocity": [0, 0, 3]})], 100.0))
    assert kept(early) == [("wind", "armed", {"velocity": [0, 0, 3]}, False)]
    early.simulation(told("absent"))
    assert [(one.name, one.state) for one in early.ordered(ChangeEffect)] == [("wind", "armed")]


def test_of_one_effect_the_newest_is_kept_with_the_parameters_that_stand():
    early = undressed()
    early.say(1, SetEffectMessage(name="wind", parameters={"velocity": [0, 0, 3]}, state="armed"))
    early.say(2, SetEffectMessage(name="wind"))
    assert kept(early) == [("wind", "active", {"velocity": [0, 0, 3]}, False)]
    early.say(1, RemoveEffectMessage(name="wind"))
    early.simulation(told("absent"))
    assert [one.state for one in early.ordered(ChangeEffect)] == ["absent"]
    assert len(early.stored) == 1


def test_what_the_worn_garment_cannot_have_is_refused_then_and_listed_so_until_it_is_asked_anew():
    early = undressed()
    early.say(1, SetEffectMessage(name="wind", request=4))
    early.simulation(told("absent"))
    (order,) = early.ordered(ChangeEffect)
    early.simulation(EffectRefused(order.ticket, "parameters", "It is calm", "Go out"))
    assert early.last(1, ErrorMessage).request == 4
    assert kept(early, 2) == [("wind", "active", None, True)]
    assert early.last(2, EffectsMessage).kept[0].refused == "It is calm. Go out."
    assert early.stored == {}
    early.say(2, SetEffectMessage(name="wind"))
    early.simulation(told("active", early.ordered(ChangeEffect)[-1].ticket))
    assert kept(early) == []


def test_what_is_refused_then_changes_nothing_of_what_was_asked_before_it():
    early = undressed()
    for speed in (4, 99, 98):
        early.say(1, SetEffectMessage(name="wind", parameters={"velocity": [0, 0, speed]}))
    early.simulation(told("absent"))
    for speed in (98, 99):
        order = early.ordered(ChangeEffect)[-1]
        assert order.parameters == {"velocity": [0, 0, speed]}
        early.simulation(EffectRefused(order.ticket, "parameters.velocity", "That is a storm", "Go in"))
    order = early.ordered(ChangeEffect)[-1]
    assert order.parameters == {"velocity": [0, 0, 4]}
    assert [one[2:] for one in kept(early)] == [({"velocity": [0, 0, 4]}, False), ({"velocity": [0, 0, 99]}, True)]
    assert list(early.stored) == [order.ticket], "it outlives the server"
    early.simulation(told("active", order.ticket))
    assert early.stored == {}
    assert len(early.ordered(ChangeEffect)) == 3


def test_what_there_is_none_of_is_refused_before_anything_is_worn():
    early = undressed()
    early.say(1, SetEffectMessage(name="snow", request=3))
    assert (early.last(1, ErrorMessage).code, early.last(1, ErrorMessage).request) == ("effect_refused", 3)
    assert early.messages(1, EffectsMessage) == []
    early.say(1, SetEffectMessage(name="auto", state="armed"))
    assert kept(early) == [("auto", "armed", None, False)]


@pytest.mark.parametrize("dressed", [False, True])
def test_what_is_no_number_is_refused_at_once_worn_or_not(dressed):
    driver = Driver()
    if dressed:
        driver.dressed()
        driver.simulation(told())
    effects = driver.session.effects
    rows = [{"ratio": 0.9}, {"ratio": float("nan")}]
    for parameters, place in (
        ({"velocity": [0.0, float("nan"), 4.0]}, "$.parameters.velocity[1]"),
        ({"density": float("inf")}, "$.parameters.density"),
        ({"lines": rows}, "$.parameters.lines[1].ratio"),
    ):
        with pytest.raises(ProtocolError, match="not a finite number") as caught:
            effects.change("wind", "active", parameters)
        assert (caught.value.code, caught.value.place) == ("effect_refused", place)
        assert caught.value.remedy
    assert driver.ordered(ChangeEffect) == []
    assert dressed or effects.newest is None, "nothing is kept"


def test_nothing_is_measured_before_the_garment_is_worn_nor_too_much_asked_at_once(driver):
    early = undressed()
    early.say(1, MeasureEffectsMessage(request=3))
    assert early.last(1, ErrorMessage).code == "unexpected_message"
    with pytest.raises(ProtocolError, match="dressed"):
        early.session.effects.measure()
    for _ in range(MOST_WAITING):
        driver.say(1, MeasureEffectsMessage())
    driver.say(1, MeasureEffectsMessage(request=5))
    assert (driver.last(1, ErrorMessage).code, driver.last(1, ErrorMessage).request) == ("rate_limited", 5)
    driver.simulation(told("absent", *(command.ticket for command in driver.ordered(MeasureEffects))))
    driver.say(1, MeasureEffectsMessage(request=6))
    assert len(driver.ordered(MeasureEffects)) == MOST_WAITING + 1
