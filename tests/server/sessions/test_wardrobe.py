"""Changes of what is worn as the session's machine sees them: one at a time, ordered, answered."""

import pytest
from session_driver import RULES

from tryon_protocol import DesignMessage, ProtocolError
from tryon_server.sessions import Order, WardrobeSession
from tryon_server.sessions.actions import Answer
from tryon_server.sessions.commands import WornItem
from tryon_server.sessions.events import Designed, OutfitRefused, OutfitWorn, PhaseChanged, TopologyReady

SHIRT = WornItem("shirt", "tshirt", "cotton", 1.0, 1)
SKIRT = WornItem("skirt", "skirt", "denim", 1.0, 2)
NOW = 100.0


@pytest.fixture
def session():
    session = WardrobeSession("s", RULES, "walk", "cotton", lambda: "token", NOW)
    session.begin_with([SHIRT], "shirt")
    session.simulated(TopologyReady(1, b"topology", b"plain", ("hips",)), NOW)
    return session


def test_an_outfit_is_ordered_and_worn_once_the_simulation_says_so(session):
    ticket, actions = session.change_outfit([SHIRT, SKIRT], "skirt", ("how",))
    (order,) = actions
    assert isinstance(order, Order)
    assert (order.command.items, order.command.edited, order.command.order) == ((SHIRT, SKIRT), "skirt", ("how",))
    assert session.items == (SHIRT,)
    assert session.simulated(OutfitWorn(ticket), NOW) == [Answer(ticket, OutfitWorn(ticket))]
    assert (session.items, session.edited) == ((SHIRT, SKIRT), "skirt")
    assert (session.number_of("skirt"), session.number_of("coat")) == (2, None)


def test_a_refused_outfit_leaves_what_is_worn_and_another_may_be_asked_for(session):
    ticket, _ = session.change_outfit([SHIRT, SKIRT], "skirt", ())
    (answer,) = session.simulated(OutfitRefused(ticket, "garments.skirt", "it is too tight", "Enlarge it"), NOW)
    assert isinstance(answer.outcome, ProtocolError)
    assert (answer.outcome.code, answer.outcome.place) == ("edit_refused", "garments.skirt")
    assert (session.items, session.edited) == ((SHIRT,), "shirt")
    assert session.change_outfit([SKIRT], "skirt", ())[0] > ticket


def test_one_change_is_under_way_at_a_time_and_none_before_anything_is_worn(session):
    ticket, _ = session.change_outfit([SHIRT, SKIRT], "skirt", ())
    with pytest.raises(ProtocolError, match="under way"):
        session.change_outfit([SKIRT], "skirt", ())
    assert session.simulated(OutfitWorn(ticket + 1), NOW) == []
    undressed = WardrobeSession("s", RULES, "walk", "cotton", lambda: "token", NOW)
    with pytest.raises(ProtocolError, match="still being dressed"):
        undressed.change_outfit([SKIRT], "skirt", ())


def test_who_asked_for_an_outfit_over_http_and_waits_for_it_keeps_the_session(session):
    ticket, _ = session.change_outfit([SHIRT, SKIRT], "skirt", ())
    for k in range(100):
        session.tick(NOW + 10.0 * k)
    assert not session.ended
    session.simulated(OutfitWorn(ticket), NOW + 1000.0)
    session.tick(NOW + 990.0 + RULES.grace_seconds - 1.0)
    assert not session.ended
    session.tick(NOW + 990.0 + RULES.grace_seconds + 1.0)
    assert session.ended


def test_a_pattern_that_is_told_says_which_garment_is_edited_and_of_what_it_is(session):
    ticket, _ = session.change_outfit([SHIRT, SKIRT], "shirt", ())
    session.simulated(OutfitWorn(ticket), NOW)
    design = DesignMessage(held=False, panels=(), seams=(), done=(), undone=0, garment="skirt")
    session.simulated(Designed(design, "linen"), NOW)
    assert session.edited == "skirt"
    assert [item.fabric for item in session.items] == ["cotton", "linen"]


def test_while_an_outfit_is_made_the_status_tells_how_far_it_is(session):
    session.simulated(PhaseChanged("ready", "Dressed"), NOW)
    state = session.status(NOW).state
    session.simulated(PhaseChanged("ready", "Sewing the seams", 0.25), NOW)
    told = session.status(NOW)
    assert (told.state, told.detail, told.progress) == (state, "Sewing the seams", 0.25)
    session.simulated(PhaseChanged("ready", "Dressed"), NOW)
    assert session.status(NOW).progress is None
    assert session.status(NOW).detail != "Sewing the seams"
