"""Other outfits in the worker's loop: what is worn streams on until they are there, and what is refused changes
nothing."""

from pathlib import Path

import analytic_drape
import numpy as np
import pytest
from scripted_worker import allow, frames, work

from tryon_server.runtime.order import GarmentOrder
from tryon_server.sessions.commands import (
    ChangeEffect,
    ChangeOutfit,
    ChangePattern,
    FollowMotion,
    GiveUp,
    Run,
    WornItem,
)
from tryon_server.sessions.events import (
    Designed,
    EditMade,
    EditRefused,
    EffectsTold,
    OutfitRefused,
    OutfitWorn,
    PhaseChanged,
    TopologyReady,
)

WIDER = {"kind": "scale_piece", "panel": "front", "factors": [1.2, 1.0]}


def outfit(ticket, *names, fabric="cotton"):
    items = tuple(WornItem(name, "tube", fabric, 1.0, k) for k, name in enumerate(names, 1))
    order = tuple(GarmentOrder(name, Path("pattern.json"), fabric if name else "cotton") for name in names)
    return ChangeOutfit(ticket, items, names[-1], order)


def changed(*commands, until=4.0, seconds_beside=0.2, apart=1.2, asked=0.1):
    script = [(0.001, Run(True)), (0.001, allow(1000))]
    script += [(asked + apart * k, command) for k, command in enumerate(commands)]
    return work(script, until, build=analytic_drape.build, seconds_beside=seconds_beside)


def events(connection, kind):
    return [event for event in connection.events if isinstance(event, kind)]


def test_a_garment_is_put_on_over_the_other_while_that_streams_on():
    connection = changed(outfit(7, "", "coat"), until=2.0)
    assert [event.ticket for event in events(connection, OutfitWorn)] == [7]
    at = [connection.times[k] for k, event in enumerate(connection.events) if isinstance(event, OutfitWorn)]
    assert at[0] >= 0.3, "no sooner than it is made"
    seen = frames(connection)
    assert [event.topology_id for event in events(connection, TopologyReady)] == [1, 2]
    assert sum(frame.topology_id == 1 for frame in seen) > 5
    assert sum(frame.topology_id == 2 for frame in seen) > 5
    assert events(connection, Designed)[-1].design.garment == "coat"


def test_what_is_newly_dressed_takes_over_in_the_pose_of_the_moment():
    """The body sways on: neither it nor its clock goes back, and the frames before and after are a step apart."""
    seen = frames(changed(outfit(7, "", "coat"), until=2.0, asked=0.8))
    swap = next(k for k, frame in enumerate(seen) if frame.topology_id == 2)
    assert abs(seen[swap].root[0]) > 1e-3, "the body is elsewhere than in the stance for dressing"
    times = [frame.t_sim for frame in seen]
    assert times == sorted(times)
    assert seen[swap].root == pytest.approx(seen[swap - 1].root, abs=2 * np.pi * 0.1 / 30 + 1e-6)
    assert seen[swap].t_sim > 0.0, "the motion has begun"
    for frame in seen[swap:]:
        assert frame.root[0] == pytest.approx(analytic_drape.sway_at(frame.t_sim), abs=1e-3)
    moved = np.diff([frame.body[0, 0] for frame in seen])
    assert np.abs(moved).max() < 0.1, "the drape itself follows, not only what is told of it"


def test_it_follows_a_body_that_stands_and_one_that_nobody_watches():
    """What is worn is drawn to where it hangs in the other outfit, for which it is advanced while its clock stands."""
    connection = changed(Run(False), outfit(7, "", "coat"), until=3.0)
    assert [event.ticket for event in events(connection, OutfitWorn)] == [7]
    times = [frame.t_sim for frame in frames(connection)]
    assert times == sorted(times)
    connection = changed(outfit(7, "", "coat"), Run(False), until=3.0, seconds_beside=1.15)
    assert [event.ticket for event in events(connection, OutfitWorn)] == [7], "it is held in the midst of it"
    standing = changed(FollowMotion(None), outfit(7, "", "coat"), until=18.0, apart=14.0)
    assert [event.ticket for event in events(standing, OutfitWorn)] == [7], "the cloth had come to rest"


def test_one_is_taken_off_where_it_is_worn_and_nothing_begins_again():
    connection = changed(outfit(1, "", "coat"), outfit(2, "coat"))
    assert [event.ticket for event in events(connection, OutfitWorn)] == [1, 2]
    assert len([event for event in events(connection, PhaseChanged) if event.phase == "ready"]) == 2  # not a third
    assert connection.beside.begun == 1
    times = [frame.t_sim for frame in frames(connection) if frame.topology_id >= 2]
    assert times == sorted(times)
    assert len(set(times)) > 10


def test_effects_are_told_as_they_are_on_what_is_left_before_it_is_told_to_be_worn():
    """Whoever hears that something is off may ask for them at once."""
    pair = {"first": "coat/front", "second": "hat/front", "static": 0.9}
    rubbing = ChangeEffect(5, "friction", "active", {"body": 0.4, "cloth": 0.3, "pairs": [pair]})
    connection = changed(outfit(1, "hat", "coat"), rubbing, outfit(2, "hat"))
    why = []
    for event in connection.events:
        if isinstance(event, EffectsTold):
            (said,) = (effect.why for effect in event.effects.effects if effect.name == "friction")
            why.append(said)
        if isinstance(event, OutfitWorn):
            why.append(event.ticket)
    assert 5 in [ticket for event in events(connection, EffectsTold) for ticket in event.answers]
    told = "asked for; without pairs of coat, which was taken off"
    assert why.index(told) < why.index(2)


def test_edits_are_of_the_garment_that_they_name_or_the_edited_one():
    connection = changed(
        outfit(1, "", "coat"),
        ChangePattern("edit", 2, WIDER, garment=""),
        ChangePattern("undo", 5, garment="coat"),
        ChangePattern("edit", 6, WIDER, garment="hat"),
    )
    assert [(made.ticket, made.garment) for made in events(connection, EditMade)] == [(2, "coat"), (5, "coat")]
    (refused,) = events(connection, EditRefused)
    assert refused.ticket == 6
    assert "no garment 'hat'" in refused.message


def test_while_an_outfit_is_made_other_outfits_are_refused_and_edits_wait():
    commands = [
        outfit(1, "", "coat"),
        ChangePattern("edit", 2, WIDER),
        outfit(3, "", "hat"),
        ChangePattern("edit", 4, WIDER, garment="coat"),
        ChangePattern("undo", 5, garment=""),
    ]
    connection = changed(*commands, seconds_beside=1.6, apart=0.3)
    assert events(connection, EditRefused) == []
    assert [(made.ticket, made.last) for made in events(connection, EditMade)] == [(2, 1), (4, 2), (5, 1)]
    assert [event.ticket for event in events(connection, OutfitRefused)] == [3]
    assert [event.ticket for event in events(connection, OutfitWorn)] == [1]


def test_an_outfit_that_can_t_be_put_on_is_refused_and_what_is_worn_goes_on():
    tight = outfit(1, "", "coat", fabric="tight")
    connection = changed(tight)
    (refused,) = events(connection, OutfitRefused)
    assert (refused.ticket, refused.place) == (1, "garments.coat")
    assert "can't be put on over" in refused.message
    assert len(events(connection, TopologyReady)) == 1
    assert frames(connection)[-1].t_sim > 1.0


def test_in_another_order_what_has_to_pass_through_the_other_is_taken_off_and_put_on_again():
    """Edits and effects are of all that is worn again in a moment: nothing of what was asked is forgotten."""
    wind = ChangeEffect(5, "wind", "active", {"velocity": [0.0, 0.0, 2.0]})
    wait = ChangePattern("edit", 4, WIDER, garment="coat")
    connection = changed(outfit(1, "hat", "coat"), wind, outfit(3, "coat", "hat"), wait, until=6.0, apart=0.9)
    assert events(connection, OutfitRefused) == []
    assert [(event.ticket, event.again) for event in events(connection, OutfitWorn)] == [(1, ()), (3, ("hat",))]
    told = [event.topology_id for event in events(connection, TopologyReady)]
    assert told[:4] == [1, 2, 3, 4], "both, then the coat alone, then both"
    said = [(event.detail, event.progress) for event in events(connection, PhaseChanged)]
    assert ("Taking hat off, to be put on again in the new order", 1.0) in said, "told while it has progress"
    assert said[-1] == ("Dressed", None)
    assert [made.ticket for made in events(connection, EditMade)] == [4], "it waited"
    effects = {effect.name: effect for effect in events(connection, EffectsTold)[-1].effects.effects}
    assert effects["wind"].state == "active"
    seen = frames(connection)
    bared = [frame.t_sim for frame in seen if frame.topology_id == 3]
    assert len(bared) >= 3, "the others go on meanwhile"
    times = [frame.t_sim for frame in seen]
    assert times == sorted(times)


def test_in_another_order_also_while_nobody_watches():
    """What is left is advanced while the clock stands, and the motion goes on from there."""
    connection = changed(outfit(1, "hat", "coat"), Run(False), outfit(3, "coat", "hat"), Run(True), until=8.0)
    assert [(event.ticket, event.again) for event in events(connection, OutfitWorn)] == [(1, ()), (3, ("hat",))]
    assert [event.topology_id for event in events(connection, TopologyReady)] == [1, 2, 3, 4]
    times = [frame.t_sim for frame in frames(connection)]
    assert times == sorted(times)


def test_one_that_is_given_up_is_refused_unless_something_is_off_for_it():
    """Whenever that comes, what is worn in the end is one outfit or the other, whole."""
    answers = set()
    for seconds in (0.15, 0.35, 0.5, 0.65, 2.5):
        script = [outfit(1, "hat", "coat"), outfit(3, "coat", "hat")]
        connection = work(
            [(0.001, Run(True)), (0.001, allow(1000)), (0.1, script[0]), (1.3, script[1]), (1.3 + seconds, GiveUp(3))],
            6.0,
            build=analytic_drape.build,
            seconds_beside=0.2,
        )
        refused = [event.ticket for event in events(connection, OutfitRefused)]
        worn = [event.ticket for event in events(connection, OutfitWorn)]
        assert (worn, refused) in (([1, 3], []), ([1], [3]))
        answers.add(bool(refused))
        told = [event.topology_id for event in events(connection, TopologyReady)]
        assert told == ([1, 2] if refused else [1, 2, 3, 4])
        assert frames(connection)[-1].t_sim > 2.0
    assert answers == {True, False}


def test_an_edit_that_waits_for_an_outfit_is_given_up_alone():
    commands = [outfit(1, "", "coat"), ChangePattern("edit", 2, WIDER), ChangePattern("edit", 4, WIDER), GiveUp(2)]
    connection = changed(*commands, seconds_beside=2.0, apart=0.3)
    assert [event.ticket for event in events(connection, EditRefused)] == [2]
    assert [made.ticket for made in events(connection, EditMade)] == [4]
    assert [event.ticket for event in events(connection, OutfitWorn)] == [1]
