"""A garment that is caught for good is put on anew beside what is worn, and nobody has to ask for it."""

from dataclasses import replace
from pathlib import Path

import analytic_drape
import pytest
from scripted_worker import allow, frames, work

from tryon_server.problems import problem_error
from tryon_server.runtime.caught import BEHIND, PAUSE, SECONDS, STRETCHED, CaughtWatch
from tryon_server.runtime.order import GarmentOrder
from tryon_server.sessions.commands import ChangeOutfit, ChangePattern, Run, WornItem
from tryon_server.sessions.events import EditMade, FabricWorn, OutfitWorn, PhaseChanged, TopologyReady, Troubled

FRAME = 0.125  # s
WIDER = {"kind": "scale_piece", "panel": "front", "factors": [1.2, 1.0]}


def seen(watch, frames, stretch=STRETCHED + 1, behind=BEHIND + 0.1):
    return [watch.see(stretch, behind, FRAME) for _ in range(frames)]


def test_it_is_caught_where_every_frame_of_a_second_says_so():
    watch, enough = CaughtWatch(), round(SECONDS / FRAME)
    assert seen(watch, enough) == [False] * (enough - 1) + [True]
    assert seen(watch, 1) == [True], "and goes on to be"
    assert seen(watch, 1, stretch=STRETCHED) == [False]
    assert seen(watch, enough - 1) == [False] * (enough - 1)
    assert seen(watch, 1, behind=BEHIND) == [False]
    assert seen(watch, enough) == [False] * (enough - 1) + [True]


def test_who_goes_on_crossing_himself_is_not_dressed_over_and_over():
    watch = CaughtWatch()
    seen(watch, 20)
    watch.relieved()
    again = seen(watch, round((PAUSE + 2 * SECONDS) / FRAME)).index(True)
    assert again * FRAME == pytest.approx(PAUSE + SECONDS, abs=2 * FRAME)


class Built:
    """Builds sheets, of which the first is caught from the start of its motion on; a second can't be dressed, if so."""

    def __init__(self, unfit=False):
        self.orders, self.unfit = [], unfit

    def __call__(self, order, progress):
        self.orders.append(order)
        if len(self.orders) > 1:
            if self.unfit:
                raise problem_error("garment.unfit", "a seam stayed open", "Enlarge the pieces.", place="garment")
            return analytic_drape.build(order, progress)
        sheet = analytic_drape.build(order, progress)
        advance = sheet.advance
        sheet.advance = lambda *a, **more: replace(advance(*a, **more), max_stretch=2.4, body_lag=0.31)
        return sheet


def worn(build, *commands, until=4.0):
    script = [(0.001, Run(True)), (0.001, allow(1000)), *commands]
    return work(script, until, build=build, seconds_beside=0.2)


def events(connection, kind):
    return [event for event in connection.events if isinstance(event, kind)]


def test_it_is_put_on_anew_while_it_streams_on():
    build = Built()
    connection = worn(build)
    assert [order.fabric for order in build.orders] == ["cotton", "cotton"]
    assert build.orders[1].size == build.orders[0].size
    (said,) = events(connection, Troubled)
    assert (said.code, said.place) == ("caught", "$")
    assert said.message.startswith("The garment is caught: it is stretched to 2.4 times its length and holds")
    assert "31 cm back" in said.message
    assert [event.topology_id for event in events(connection, TopologyReady)] == [1, 2]
    assert not events(connection, FabricWorn) + events(connection, OutfitWorn), "nobody has asked for anything"
    shown = frames(connection)
    assert {frame.topology_id for frame in shown} == {1, 2}
    times = [frame.t_sim for frame in shown]
    assert times == sorted(times)


def test_where_it_cannot_be_put_on_it_is_worn_on():
    connection = worn(Built(unfit=True), until=6.0)
    began, ended = events(connection, Troubled)
    assert began.code == ended.code == "caught"
    assert ended.message == "The garment is worn on as it is: a seam stayed open."
    assert ended.remedy == "Enlarge the pieces."
    assert {frame.topology_id for frame in frames(connection)} == {1}
    assert frames(connection)[-1].t_sim > 4.0
    assert events(connection, PhaseChanged)[-1].phase == "ready"


def test_another_outfit_that_is_asked_for_meanwhile_goes_first():
    items = tuple(WornItem(name, "tube", "cotton", 1.0, k) for k, name in enumerate(("", "coat"), 1))
    order = tuple(GarmentOrder(name, Path("pattern.json"), "cotton") for name in ("", "coat"))
    connection = worn(Built(), (1.3, ChangeOutfit(7, items, "coat", order)))
    assert [event.code for event in events(connection, Troubled)] == ["caught"]
    assert [event.ticket for event in events(connection, OutfitWorn)] == [7]
    assert frames(connection)[-1].topology_id == 2


def test_where_another_garment_is_only_edited_meanwhile_it_is_seen_again():
    """Nothing else is put on: it is still caught, and a second later it is put on anew after all."""
    items = (WornItem("", "tube", "cotton", 1.0, 1),)
    connection = worn(Built(), (1.3, ChangeOutfit(7, items, "", (GarmentOrder("", Path("pattern.json"), "cotton"),))))
    assert [event.ticket for event in events(connection, OutfitWorn)] == [7]
    assert [event.code for event in events(connection, Troubled)] == ["caught", "caught"]
    assert frames(connection)[-1].topology_id == 2


def test_an_edit_that_is_asked_for_meanwhile_is_made_of_what_is_put_on():
    connection = worn(Built(), (1.3, ChangePattern("edit", 3, WIDER)))
    (made,) = events(connection, EditMade)
    assert made.ticket == 3
    worn_at = [k for k, event in enumerate(connection.events) if isinstance(event, TopologyReady)]
    assert connection.events.index(made) > worn_at[1]
