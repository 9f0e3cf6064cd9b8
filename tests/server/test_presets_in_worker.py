"""Another preset in a running session: built beside what is worn and taken up between two frames, which go on; the
newest wish counts, and nothing else that is asked for meanwhile is lost."""

from pathlib import Path

import analytic_drape
import numpy as np
import pytest
from pretended_presets import ITERATIONS
from scripted_worker import allow, frames, work

from tryon_server.runtime.order import GarmentOrder
from tryon_server.sessions.commands import (
    BuyAccuracy,
    ChangeEffect,
    ChangeOutfit,
    ChangePattern,
    MeasureEffects,
    Run,
    WearFabric,
    WornItem,
)
from tryon_server.sessions.events import (
    EditMade,
    EffectsTold,
    OutfitWorn,
    PresetInForce,
    PresetRefused,
    Reported,
    TopologyReady,
)

ASKED = 0.5  # s, when the first command comes
SOON = 0.001  # s later another preset is being built
DRAFT = PresetInForce("draft", None)


def asked(preset, **more):
    return BuyAccuracy(preset=preset, **more)


def edit(ticket, before, after):
    """The first square, so wide [m] before, made so wide after: analytic_drape.py has what that takes."""
    return ChangePattern("edit", ticket, {"kind": "scale_piece", "panel": "front", "factors": [after / before, 1.0]})


def outfit(ticket, *names):
    items = tuple(WornItem(name, "tube", "cotton", 1.0, k) for k, name in enumerate(names, 1))
    order = tuple(GarmentOrder(name, Path("pattern.json"), "cotton") for name in names)
    return ChangeOutfit(ticket, items, names[-1], order)


def told(*commands, until=2.0, seconds_beside=0.0, apart=SOON, **more):
    """A running worker that is told these so long [s] apart; its connection, and the drapes that were dressed."""
    drapes = []

    def remember(order, progress):
        drapes.append(analytic_drape.build(order, progress))
        return drapes[-1]

    script = [(0.001, Run(True)), (0.001, allow(10_000))]
    script += [(ASKED + apart * k, command) for k, command in enumerate(commands)]
    return work(script, until, build=remember, seconds_beside=seconds_beside, **more), drapes


def of(connection, kind):
    return [event for event in connection.events if isinstance(event, kind)]


def in_force(connection):
    return of(connection, PresetInForce)


def reports(connection):
    return [event.report for event in of(connection, Reported)]


def test_frames_go_on_while_another_preset_is_built_and_are_solved_by_it_then():
    connection, (sheet,) = told(asked("fit", accuracy=1e-4, deadline=0.0015))
    assert in_force(connection) == [DRAFT, PresetInForce("fit", "fit")]
    assert sheet.preset == "fit"
    seen = frames(connection)
    assert np.diff([frame.seq for frame in seen]).tolist() == [1] * (len(seen) - 1)
    assert (np.diff([frame.t_sim for frame in seen[1:]]) < 0.03).all(), "none is missed"
    assert len(of(connection, TopologyReady)) == 1, "nothing is dressed anew"
    assert list(dict.fromkeys(report.iterations for report in reports(connection))) == [3, ITERATIONS["fit"]]
    newest = reports(connection)[-1]
    assert (newest.error, newest.late_ms) == (1e-4, pytest.approx(0.5)), "accuracy and deadline stay"


def test_it_takes_no_longer_than_half_a_frame_between_two_of_them():
    """Where each part takes as long as a frame, one is done between two."""
    parts_of, clocks = [], []

    def slow(order, progress):
        sheet = analytic_drape.build(order, progress)
        advance, solve_as = sheet.advance, sheet.solve_as

        def advancing(*args):
            clocks[0].now += 0.01
            parts_of.append(0)
            return advance(*args)

        def building(preset):
            for _ in solve_as(preset):
                clocks[0].now += 0.01
                parts_of[-1] += 1
                yield

        sheet.advance, sheet.solve_as = advancing, building
        return sheet

    connection = work(
        [(0.001, Run(True)), (0.001, allow(1000)), (ASKED, asked("live"))], 2.0, build=slow, begun=clocks.append
    )
    assert in_force(connection)[-1] == PresetInForce("live", "live")
    assert max(parts_of) <= 2
    assert sum(parts_of) == 5
    seen = frames(connection)
    assert np.diff([frame.t_sim for frame in seen[1:]]).max() < 0.045, "one is missed at most"


def test_of_several_wishes_the_newest_counts():
    connection, (sheet,) = told(asked("live"), asked("reference"), asked("fit"))
    assert in_force(connection) == [DRAFT, PresetInForce("fit", "fit")]
    assert of(connection, PresetRefused) == [], "the one that breaks halfway is not built any further"
    assert sheet.preset == "fit"


def test_who_changes_their_mind_has_what_there_was():
    connection, (sheet,) = told(asked("fit"), asked(None))
    assert in_force(connection) == [DRAFT]
    assert sheet.preset == "draft"


def test_the_preset_that_it_was_opened_with_comes_back_with_none_and_by_its_name():
    connection, _ = told(asked("live"), asked(None), asked("draft"), asked("live"), asked(None), apart=0.2)
    named = [("draft", None), ("live", "live"), ("draft", None), ("draft", "draft"), ("live", "live"), ("draft", None)]
    assert in_force(connection) == [PresetInForce(*each) for each in named]


def test_what_is_asked_for_before_it_is_dressed_holds_then():
    script = [(0.0, asked("live")), (0.0, allow(1000)), (0.1, Run(True))]
    assert in_force(work(script, 1.0)) == [DRAFT, PresetInForce("live", "live")]


def test_while_nobody_watches_it_is_built_too():
    assert in_force(work([(0.5, asked("live"))], 1.0))[-1] == PresetInForce("live", "live")


@pytest.mark.parametrize("before", [None, "live"])
def test_one_that_fails_is_told_with_its_remedy_and_the_one_before_goes_on(before):
    connection, (sheet,) = told(asked(before), asked("reference"), apart=0.2)
    (refused,) = of(connection, PresetRefused)
    kept = before or "draft"
    assert (refused.asked, refused.kept) == ("reference", before)
    assert refused.message == (
        f"The preset reference could not be built: RuntimeError('no room is left'); {kept} goes on."
    )
    assert "open a session with it" in refused.remedy
    assert sheet.preset == kept
    assert in_force(connection)[-1] == PresetInForce(kept, before)
    assert frames(connection)[-1].t_published > 1.95
    assert reports(connection)[-1].iterations == ITERATIONS[kept]


def test_effects_that_are_asked_for_meanwhile_act_as_well_and_are_built_one_after_the_other():
    """Two that are built from one garment would each take the place of the other."""
    most = []

    def watched(order, progress):
        sheet, building = analytic_drape.build(order, progress), []

        def noted(make):
            def parts(*args):
                building.append(1)
                most.append(len(building))
                try:
                    yield from make(*args)
                finally:
                    building.pop()

            return parts

        sheet.solve_as, sheet.effects.rebind = noted(sheet.solve_as), noted(sheet.effects.rebind)
        return sheet

    wind, gust = ChangeEffect(1, "wind", "active", {"velocity": [0, 0, 2]}), ChangeEffect(2, "pressure", "active")
    script = [(0.001, Run(True)), (0.001, allow(1000))]
    commands = [asked("fit"), wind, asked("live"), gust]
    script += [(ASKED + SOON * k, command) for k, command in enumerate(commands)]
    connection = work(script, 2.0, build=watched)
    assert in_force(connection)[-1] == PresetInForce("live", "live")
    news = of(connection, EffectsTold)
    assert [ticket for event in news for ticket in event.answers] == [1, 2]
    active = {effect.name for effect in news[-1].effects.effects if effect.state == "active"}
    assert {"wind", "pressure"} <= active
    assert max(most) == 1


def test_what_effects_take_was_measured_by_the_preset_before():
    connection, _ = told(MeasureEffects(1), asked("live"), apart=0.3)
    measured = [any(effect.ms is not None for effect in event.effects.effects) for event in of(connection, EffectsTold)]
    assert measured == [False, True, False]


def test_edits_meanwhile_are_kept_and_another_mesh_is_solved_by_it_too():
    """A value, a cut that is put on where it is worn, and one that is dressed anew as the session was opened."""
    edits = [edit(1, 0.5, 0.6), edit(2, 0.6, 0.38), edit(3, 0.38, 0.32)]
    commands = [asked("fit"), *edits, ChangePattern("undo", 4)]
    connection, _ = told(*commands, apart=0.4, until=6.0, seconds_beside=0.1)
    assert [made.ticket for made in of(connection, EditMade)] == [1, 2, 3, 4]
    assert len(of(connection, TopologyReady)) >= 3
    assert in_force(connection) == [DRAFT, PresetInForce("fit", "fit")]
    assert reports(connection)[-1].iterations == ITERATIONS["fit"]
    at_once, _ = told(asked("fit"), *edits, until=4.0, seconds_beside=0.1)
    assert [made.ticket for made in of(at_once, EditMade)] == [1, 2, 3]
    assert in_force(at_once)[-1] == PresetInForce("fit", "fit")


def test_another_outfit_is_solved_by_it_too():
    commands = [asked("fit"), outfit(1, "", "coat"), outfit(2, "")]
    connection, _ = told(*commands, apart=1.0, until=4.0, seconds_beside=0.2)
    assert [worn.ticket for worn in of(connection, OutfitWorn)] == [1, 2]
    assert in_force(connection) == [DRAFT, PresetInForce("fit", "fit")]
    assert reports(connection)[-1].iterations == ITERATIONS["fit"]
    at_once, _ = told(outfit(1, "", "coat"), asked("fit"), until=4.0, seconds_beside=0.2)
    assert [worn.ticket for worn in of(at_once, OutfitWorn)] == [1]
    assert in_force(at_once)[-1] == PresetInForce("fit", "fit")


def test_a_garment_that_is_dressed_anew_in_place_of_one_that_could_not_be_comes_to_it():
    script = [(0.001, Run(True)), (0.001, allow(1000)), (ASKED, asked("live")), (1.0, WearFabric("cotton"))]
    connection = work(script, 2.0, fabric="tight")
    assert in_force(connection) == [DRAFT, PresetInForce("live", "live")]
