"""Edits in the worker's loop: shown, kept, taken back, refused, and dressed anew where the mesh does not serve."""

import json
from pathlib import Path

import analytic_drape
import numpy as np
import pytest
from analytic_drape import LATE_WIDTH, squares, width_of
from scripted_worker import allow, frames, work

import tryon_server
from tryon_server.runtime.design import design_of
from tryon_server.runtime.pattern_worker import REST_SECONDS
from tryon_server.runtime.remaking import JUMP
from tryon_server.sessions.commands import ChangePattern, Run
from tryon_server.sessions.events import (
    Designed,
    EditMade,
    EditRefused,
    FrameReady,
    PhaseChanged,
    Reported,
    TakenOn,
    TopologyReady,
)
from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.edits import OpenSeam
from tryon_solver.redesign.history import History

RESTING = {"kind": "change_fabric", "fabric": "resting"}


def scale(width: float) -> dict:
    """The first square made `width` m wide, of the half metre that it begins with."""
    return {"kind": "scale_piece", "panel": "front", "factors": [width / 0.5, 1.0]}


def edit(ticket: int, width: float, **more) -> ChangePattern:
    return ChangePattern("edit", ticket, scale(width), **more)


def hold(width: float | None) -> ChangePattern:
    return ChangePattern("edit", 0, None if width is None else scale(width), hold=True)


def changed(*commands, fabric="cotton", until=1.0):
    """A running worker that is told these one after the other; its connection, and the drapes that were built."""
    drapes = []

    def build(order, progress):
        drapes.append(analytic_drape.build(order, progress))
        return drapes[-1]

    script = [(0.001, Run(True)), (0.001, allow(1000))]
    script += [(0.1 + 0.1 * k, command) for k, command in enumerate(commands)]
    return work(script, until, fabric=fabric, build=build), drapes


def events(connection, kind):
    return [event for event in connection.events if isinstance(event, kind)]


def widths(connection):
    """Of the first square's lower edge, as clients are told it [m], and whether that is only held."""
    told = [event.design for event in events(connection, Designed)]
    return [(round(d.panels[0].vertices[1][0] - d.panels[0].vertices[0][0], 6), d.held) for d in told]


def test_the_pattern_is_told_once_it_is_worn():
    connection, _ = changed()
    (told,) = [event.design for event in events(connection, Designed)]
    assert [panel.name for panel in told.panels] == ["front", "back"]
    assert [(seam.first, seam.second) for seam in told.seams] == [((0, 1), (1, 1)), ((0, 3), (1, 3))]
    assert (told.done, told.undone, told.held) == ((), 0, False)
    order = [type(event) for event in connection.events if isinstance(event, (TopologyReady, Designed))]
    assert order == [TopologyReady, Designed]


def test_an_edit_is_worn_and_told():
    connection, (drape,) = changed(edit(7, 0.6))
    (made,) = events(connection, EditMade)
    assert (made.ticket, made.step, made.id, made.last, made.change) == (7, "edit", 1, 1, "value")
    assert made.edit == {"kind": "scale_piece", "panel": "front", "factors": [1.2, 1.0]}
    assert width_of(made.specification) == 0.6
    assert drape.shapes == [0.6]
    assert widths(connection) == [(0.5, False), (0.6, False)]
    assert [(e.id, e.kind, e.panel) for e in events(connection, Designed)[-1].design.done] == [
        (1, "scale_piece", "front")
    ]


def test_what_is_held_is_shown_and_counts_from_what_is_kept():
    connection, (drape,) = changed(hold(0.6), hold(0.8), hold(None), hold(0.75), edit(1, 0.9))
    assert drape.shapes == [0.6, 0.8, 0.5, 0.75, 0.9]
    assert widths(connection)[1:] == [(0.6, True), (0.8, True), (0.5, False), (0.75, True), (0.9, False)]
    assert [made.id for made in events(connection, EditMade)] == [1]
    assert connection.beside.begun == 3, "what is held is worked out beside the simulation"


def test_where_nothing_is_held_any_more_nothing_is_told_to_be():
    """Also of what needs another mesh, which was never shown, and where nothing was held."""
    connection, _ = changed(hold(0.36), hold(None), hold(None))
    assert widths(connection) == [(0.5, False), (0.36, True), (0.5, False), (0.5, False)]
    assert events(connection, Designed)[-1].design.notes == ()


def test_edits_are_taken_back_and_made_again():
    steps = [edit(1, 0.6), edit(2, 0.7), *(ChangePattern(step, k) for k, step in ((3, "undo"), (4, "undo")))]
    connection, (drape,) = changed(*steps, ChangePattern("redo", 5), ChangePattern("redo", 6))
    made = events(connection, EditMade)
    assert [(m.ticket, m.step, m.id, m.last) for m in made] == [
        (1, "edit", 1, 1),
        (2, "edit", 2, 2),
        (3, "undo", 2, 1),
        (4, "undo", 1, 0),
        (5, "redo", 1, 1),
        (6, "redo", 2, 2),
    ]
    assert drape.shapes == [0.6, 0.84, 0.6, 0.5, 0.6, 0.84]  # the second edit is one of the first one's pattern
    assert all(m.edit is None and m.specification is None for m in made[2:])


@pytest.mark.parametrize(
    ("command", "place"),
    [
        (ChangePattern("undo", 3), "history"),
        (ChangePattern("redo", 3), "history"),
        (ChangePattern("edit", 3, {"kind": "move_vertex", "panel": "frond", "vertex": 0, "by": [0, 0.01]}), "panel"),
        (ChangePattern("edit", 3, {"kind": "knit"}), "kind"),
        (ChangePattern("edit", 3, {"kind": "scale_piece", "panel": "front", "factors": [9, 1]}), "factors[0]"),
    ],
)
def test_what_can_not_be_done_is_refused_and_nothing_changes(command, place):
    connection, (drape,) = changed(command)
    (refused,) = events(connection, EditRefused)
    assert (refused.ticket, refused.place) == (3, place)
    assert refused.message
    assert refused.remedy
    assert drape.shapes == []
    assert events(connection, EditMade) == []
    assert events(connection, PhaseChanged)[-1].phase == "ready"


@pytest.mark.parametrize("by", [0.0, 1e-13])
def test_what_leaves_the_pattern_as_it_is_is_no_edit(by):
    """Held it shows what is kept: a drag may come back to where it began."""
    nothing = {"kind": "lengthen", "panel": "front", "edge": 1, "by": by}
    connection, _ = changed(hold(0.6), ChangePattern("edit", 0, nothing, hold=True), ChangePattern("edit", 3, nothing))
    (refused,) = events(connection, EditRefused)
    assert (refused.ticket, refused.place) == (3, "edit")
    assert "as it is" in refused.message
    assert events(connection, EditMade) == []
    assert widths(connection)[1:] == [(0.6, True), (0.5, True)]


def test_a_garment_without_a_pattern_refuses_edits():
    connection, _ = changed(edit(3, 0.6), fabric="mesh")
    (refused,) = events(connection, EditRefused)
    assert "no sewing pattern" in refused.message
    assert events(connection, Designed) == []


def test_another_mesh_is_put_on_from_where_the_old_one_was():
    """The body goes on where it is, and so does the clock."""
    connection, drapes = changed(edit(1, 0.35), edit(2, 0.6))
    assert [made.change for made in events(connection, EditMade)] == ["topology", "value"]
    assert len(drapes) == 1  # nothing was dressed
    assert [event.topology_id for event in events(connection, TopologyReady)] == [1, 2]
    assert widths(connection)[1:] == [(0.35, False), (0.42, False)]
    shown = frames(connection)
    times = [frame.t_sim for frame in shown[1:]]  # the first shows the garment as it was dressed
    assert times == sorted(times)
    assert np.diff(times).max() < 0.1
    assert [event.phase for event in events(connection, PhaseChanged)].count("ready") == 1


def test_another_mesh_that_hangs_far_from_the_old_one_takes_its_place_once_that_was_drawn_there(monkeypatch):
    """The body and the clock go on meanwhile; so it is where nobody watches, too."""
    kept, unseen = [], []
    for went in (0.9 * JUMP, 1.1 * JUMP):
        monkeypatch.setattr(analytic_drape.WavingSheet, "went", went)
        connection, drapes = changed(edit(1, 0.35))
        assert len(drapes) == 1  # nothing was dressed
        assert [event.topology_id for event in events(connection, FrameReady)].count(2) > 5
        times = [frame.t_sim for frame in frames(connection)[1:]]
        assert times == sorted(times)
        assert np.diff(times).max() < 0.1
        kept += times_of(connection, EditMade)
        unseen += times_of(unwatched(edit(1, 0.35))[0], EditMade)
    for at_once, drawn in (kept, unseen):
        assert drawn - at_once == pytest.approx(analytic_drape.DRAWN, abs=0.05)


def test_with_all_edits_taken_back_it_is_the_mesh_that_it_began_with():
    """The second mesh would take on the first shape: it was made for that of the second edit."""
    undo = [ChangePattern("undo", ticket) for ticket in (3, 4)]
    connection, drapes = changed(edit(1, 0.6), edit(2, 0.3), *undo)
    assert [width for width, _ in widths(connection)] == [0.5, 0.6, 0.36, 0.6, 0.5]
    assert [made.change for made in events(connection, EditMade)] == ["value", "topology", "value", "topology"]
    assert [event.topology_id for event in events(connection, TopologyReady)] == [1, 2, 3]
    assert len(drapes) == 1  # nothing was dressed


def test_another_mesh_that_can_not_be_carried_over_is_dressed_anew():
    connection, drapes = changed(edit(1, 0.31))
    (made,) = events(connection, EditMade)
    assert made.change == "topology"
    assert [width_of(drape.specification) for drape in drapes] == [0.5, 0.31]
    assert [event.topology_id for event in events(connection, TopologyReady)] == [1, 2]
    assert connection.events.index(made) > connection.events.index(events(connection, TopologyReady)[1])
    assert [event.topology_id for event in events(connection, FrameReady)].count(2) > 5


def test_another_mesh_is_not_shown_while_it_is_held():
    connection, drapes = changed(hold(0.35))
    assert len(drapes) == 1
    held = events(connection, Designed)[-1].design
    assert held.held
    assert any("once it is let go" in note for note in held.notes)


def test_what_can_not_be_put_on_is_refused_and_the_old_garment_worn_on():
    connection, (drape,) = changed(edit(1, 0.55), edit(2, 0.25), edit(3, 0.45))
    (refused,) = events(connection, EditRefused)
    assert refused.ticket == 2
    assert "too tight" in refused.message
    assert [made.id for made in events(connection, EditMade)] == [1, 2]
    assert widths(connection)[-1] == (0.495, False)
    assert drape.shapes == [0.55, 0.495]
    assert events(connection, PhaseChanged)[-1].phase == "ready"
    assert drape.steps > 30


def test_a_shape_that_needs_another_mesh_on_the_way_gets_it():
    connection, drapes = changed(edit(1, LATE_WIDTH))
    assert len(drapes) == 1
    assert [event.topology_id for event in events(connection, TopologyReady)] == [1, 2]
    assert events(connection, EditMade)[0].change == "value"
    assert events(connection, FrameReady)[-1].topology_id == 2


def test_a_shape_that_needs_another_mesh_on_the_way_is_let_go_where_it_is_only_held():
    connection, (drape,) = changed(hold(LATE_WIDTH))
    assert drape.shapes == [LATE_WIDTH, 0.5]
    assert widths(connection) == [(0.5, False), (LATE_WIDTH, True), (0.5, True)]
    assert any("once it is let go" in note for note in events(connection, Designed)[-1].design.notes)


def test_another_fabric_is_worn_in_the_pattern_as_edited():
    script = [(0.001, Run(True)), (0.001, allow(10**6)), (1.0, edit(1, 0.6)), (2.0, ChangePattern("edit", 2, RESTING))]
    connection = work(script, 4.0)
    assert [event.topology_id for event in events(connection, TopologyReady)] == [1, 2]
    assert widths(connection)[-1] == (0.6, False)
    assert [event.report.asleep for event in events(connection, Reported)][-1]


def test_a_new_fabric_s_mesh_is_that_of_the_edited_pattern_and_all_edits_can_be_taken_back():
    undone = [ChangePattern("undo", 3), ChangePattern("undo", 4)]
    connection, drapes = changed(edit(1, 0.6), ChangePattern("edit", 2, RESTING), *undone)
    assert [width_of(drape.specification) for drape in drapes] == [0.5]
    assert widths(connection)[-1] == (0.5, False)


def test_a_body_that_stands_is_simulated_again_after_an_edit():
    def frames_after(*commands):
        script = [(0.001, Run(True)), (0.001, allow(10**6)), *((20.0, command) for command in commands)]
        connection = work(script, 40.0, motion=None)
        return [t for t, event in zip(connection.times, connection.events) if isinstance(event, FrameReady) and t > 20]

    assert frames_after() == []
    after = frames_after(edit(1, 0.6))
    assert 11.0 < after[-1] - 20.0 < 13.5


def unwatched(*commands, first=()):
    """A worker that is told these 1 s after it was dressed, and that nobody watches: when what happened [s], by kind;
    and what was worn."""
    drapes = []

    def build(order, progress):
        drapes.append(analytic_drape.build(order, progress))
        return drapes[-1]

    script = [(0.001, each) for each in (allow(10**6), *first)] + [(1.0, each) for each in commands]
    connection = work(script, 5.0, build=build)
    return connection, drapes[0]


def times_of(connection, kind):
    return [t for t, event in zip(connection.times, connection.events) if isinstance(event, kind)]


def test_a_shape_that_is_kept_is_taken_on_while_nobody_watches_on_the_body_as_it_stands():
    connection, sheet = unwatched(edit(1, 0.6))
    (kept,), (there,) = times_of(connection, EditMade), times_of(connection, TakenOn)
    assert kept < 1.1
    assert there - kept == pytest.approx(analytic_drape.RAMP, abs=0.1), "it is there once its way is gone"
    last = times_of(connection, FrameReady)[-1]
    assert last - there == pytest.approx(REST_SECONDS, abs=0.1), "the cloth rests, and then nothing is simulated"
    assert len({frame.root.tobytes() for frame in frames(connection)}) == 1
    assert not sheet.on_the_way


@pytest.mark.parametrize("commands", [(), (edit(1, 0.6), Run(False, settle=False))], ids=["unedited", "then held"])
def test_nothing_is_simulated_that_nobody_watches_and_no_edit_needs(commands):
    connection, sheet = unwatched(*commands)
    assert times_of(connection, TakenOn) == []
    assert sheet.steps == 0


def test_what_is_edited_while_a_client_holds_is_taken_on_once_it_plays():
    connection, sheet = unwatched(edit(1, 0.6), first=(Run(False, settle=False),))
    assert len(times_of(connection, EditMade)) == 1
    assert times_of(connection, TakenOn) == []
    assert sheet.steps == 0
    connection, _ = unwatched(edit(1, 0.6), Run(True), first=(Run(False, settle=False),))
    assert len(times_of(connection, TakenOn)) == 1


def test_who_leaves_before_a_shape_is_there_leaves_it_to_be_taken_on():
    connection, sheet = unwatched(edit(1, 0.6), Run(False), first=(Run(True),))
    assert len(times_of(connection, TakenOn)) == 1
    assert not sheet.on_the_way
    assert times_of(connection, FrameReady)[-1] < 1.0 + analytic_drape.RAMP + REST_SECONDS + 0.2


def test_what_is_only_held_is_not_told_to_be_worn():
    """Held over what is kept and on its way; let go of, that is come to."""
    held, let_go = hold(0.55), hold(None)
    connection, _ = unwatched(edit(1, 0.6), held, first=(Run(True),))
    assert times_of(connection, TakenOn) == []
    connection, _ = unwatched(edit(1, 0.6), held, let_go, first=(Run(True),))
    assert len(times_of(connection, TakenOn)) == 1


def test_another_mesh_is_told_to_be_taken_on_after_it_is_kept():
    connection, _ = unwatched(edit(1, 0.39))
    assert [event.change for event in events(connection, EditMade)] == ["topology"]
    assert [event.garment for event in events(connection, TakenOn)] == [""]
    assert times_of(connection, TakenOn) >= times_of(connection, EditMade)


def test_the_pattern_of_the_tests_is_one():
    from tryon_solver.geometry.pattern import parse_pattern

    assert parse_pattern(squares()).panel_names == ("front", "back")


def test_clients_are_told_the_numbers_that_the_seams_keep():
    first = json.loads((Path(tryon_server.__file__).parent / "demo" / "patterns" / "tshirt.json").read_text())
    opened = apply(first, OpenSeam("front", 8)).specification
    before, after = ([seam.number for seam in design_of(each, History(each)).seams] for each in (first, opened))
    assert before == list(range(1, 13))
    assert after == [1, *range(3, 13)]
