"""While the garment of an edit is made, the old one streams; what comes in the meantime is answered, in its order."""

import gc
import weakref
from typing import ClassVar

import analytic_drape
import numpy as np
import pytest
from analytic_drape import LATE_WIDTH, width_of
from scripted_worker import allow, frames, work

from tryon_server.problems import problem_error
from tryon_server.runtime import outfit_worker
from tryon_server.runtime.waiting import PATIENCE
from tryon_server.sessions.commands import ChangePattern, Run
from tryon_server.sessions.events import (
    ChangesTold,
    Designed,
    EditMade,
    EditRefused,
    FrameReady,
    PhaseChanged,
    Reported,
    TopologyReady,
    Troubled,
)

SECONDS = 0.5  # that each task takes beside the simulation
ASKED = 0.5  # s, when the first edit comes
INTERVAL = 0.02  # s, between frames


def scale(factor: float) -> dict:
    return {"kind": "scale_piece", "panel": "front", "factors": [factor, 1.0]}


def edit(ticket: int, factor: float) -> ChangePattern:
    """The first square's width, 0.5 m at the start, times this. 0.7 needs another mesh, 0.62 to be dressed anew."""
    return ChangePattern("edit", ticket, scale(factor))


def fabric(ticket: int, name: str) -> ChangePattern:
    return ChangePattern("edit", ticket, {"kind": "change_fabric", "fabric": name})


def changed(*commands, apart=0.1, until=4.0, build=analytic_drape.build, **more):
    """A running worker that is told these so long [s] apart, from ASKED on; its connection, and what was dressed."""
    drapes = []

    def remember(order, progress):
        drapes.append(build(order, progress))
        return drapes[-1]

    script = [(0.001, Run(True)), (0.001, allow(1000))]
    script += [(ASKED + apart * k, command) for k, command in enumerate(commands)]
    return work(script, until, build=remember, seconds_beside=SECONDS, **more), drapes


def events(connection, *kinds):
    return [event for event in connection.events if isinstance(event, kinds)]


def answers(connection):
    """Tickets in the order in which they were answered; those of refusals negative."""
    told = events(connection, EditMade, EditRefused)
    return [event.ticket if isinstance(event, EditMade) else -event.ticket for event in told]


def times_of(connection, kind, **having):
    return [
        t
        for t, event in zip(connection.times, connection.events)
        if isinstance(event, kind) and all(getattr(event, name) == value for name, value in having.items())
    ]


def sleeps(connection):
    """Is what is worn in the end of the fabric that is asleep?"""
    return events(connection, Reported)[-1].report.asleep


def last_design(connection):
    design = events(connection, Designed)[-1].design
    (x0, _), (x1, _) = design.panels[0].vertices[:2]
    return round(x1 - x0, 6), design.held


@pytest.mark.parametrize(("factor", "tasks"), [(0.7, 1), (0.62, 2)])
def test_the_old_garment_streams_while_the_next_one_is_made(factor, tasks):
    """Carried over where it is worn, which takes a mesh; or dressed anew, which takes more."""
    connection, drapes = changed(edit(1, factor))
    assert connection.beside.begun == tasks
    (answered,) = times_of(connection, EditMade)
    assert answered > ASKED + tasks * SECONDS
    old = np.array(times_of(connection, FrameReady, topology_id=1))
    meanwhile = old[(old > ASKED) & (old < answered)]
    assert len(meanwhile) > 0.8 * tasks * SECONDS / INTERVAL
    assert np.diff([ASKED, *meanwhile, answered]).max() < 2 * INTERVAL
    assert [event.topology_id for event in events(connection, TopologyReady)] == [1, 2]
    assert min(times_of(connection, FrameReady, topology_id=2)) < answered + 2 * INTERVAL
    assert [event.phase for event in events(connection, PhaseChanged)][-tasks:] == ["ready"] * tasks
    assert len(drapes) == tasks
    assert drapes[0].steps > 1.5 * ASKED / INTERVAL


@pytest.mark.parametrize(
    ("commands", "made"),
    [((edit(1, 0.62),), 2), ((edit(1, 0.62), edit(2, 1.22), ChangePattern("undo", 3)), 4)],
    ids=["dressed anew", "as worn before"],
)
def test_what_is_put_on_in_another_stance_takes_over_in_the_pose_of_the_moment(commands, made):
    """The body sways on: neither it nor its clock goes back, and the frames before and after are a step apart."""
    connection, _ = changed(*commands, apart=1.5, until=6.0)
    seen = frames(connection)[1:]  # the first is of the stance for dressing
    swap = next(k for k, frame in enumerate(seen) if frame.topology_id == made)
    assert abs(seen[swap].root[0]) > 1e-3, "the body is elsewhere than in the stance for dressing"
    times = [frame.t_sim for frame in seen]
    assert times == sorted(times)
    moved = np.diff([frame.root[0] for frame in seen])
    assert np.abs(moved).max() < 2 * np.pi * 0.1 * np.diff(times).max() + 1e-6
    assert np.abs(np.diff([frame.body[0, 0] for frame in seen])).max() < 0.1, "the drape itself follows"


class Ringed(analytic_drape.WavingSheet):
    """A sheet whose parts refer to each other, as a simulation's do: only a look for garbage lets go of it. Remembers
    which others are there when the mesh of its next cut is begun."""

    there: ClassVar[list] = []  # weak references to all of them
    others: ClassVar[list] = []  # how many are there besides, at each beginning

    def __init__(self, behaviour):
        super().__init__(behaviour)
        self.ring = [self]
        self.there.append(weakref.ref(self))

    def cutting(self, specification, fabric):
        self.others.append(sum(sheet() not in (None, self) for sheet in self.there))
        return super().cutting(specification, fabric)

    def packed(self):
        return "kept"


def test_the_mesh_of_before_is_let_go_when_the_next_one_is_begun(monkeypatch):
    """Its memory is there for the next one: two meshes at a time, and not as many as were made since the last look for
    garbage, which may come much later or never, as here."""
    monkeypatch.setattr(Ringed, "there", [])
    monkeypatch.setattr(Ringed, "others", [])
    monkeypatch.setattr(analytic_drape, "WavingSheet", Ringed)
    gc.collect()
    gc.disable()
    try:
        commands = [edit(1, 0.7), edit(2, 1.05), edit(3, 0.98), edit(4, 0.97)]
        connection = work(
            [(0.001, Run(True)), (0.001, allow(1000)), *((ASKED + k, each) for k, each in enumerate(commands))],
            ASKED + len(commands),
            seconds_beside=0.1,
        )
    finally:
        gc.enable()
    assert answers(connection) == [1, 2, 3, 4]
    assert len(Ringed.there) == 1 + len(commands), "each is another mesh"
    assert Ringed.others == [0] * len(commands)


def test_what_was_worn_before_is_worn_again_as_it_hung_where_it_can_not_be_carried_over():
    """Narrow and wider again: taken back, the narrow one can't be put on from the wide one, but need not be dressed."""
    connection, drapes = changed(edit(1, 0.62), edit(2, 1.22), ChangePattern("undo", 3), apart=1.5, until=6.0)
    assert answers(connection) == [1, 2, 3]
    assert [made.change for made in events(connection, EditMade)] == ["topology"] * 3
    assert [width_of(drape.specification) for drape in drapes] == [0.5, 0.31]
    assert [event.topology_id for event in events(connection, TopologyReady)] == [1, 2, 3, 4]
    assert last_design(connection) == (0.31, False)
    assert events(connection, Troubled) == []


def test_an_edit_is_taken_back_with_how_the_garment_hung_before_it_and_a_new_one_without(monkeypatch):
    asked = []

    class Asked(analytic_drape.WavingSheet):
        def recut(self, cut, hung=None):
            asked.append(None if hung is None else width_of(hung.specification))
            return super().recut(cut, hung)

    monkeypatch.setattr(analytic_drape, "WavingSheet", Asked)
    connection, _ = changed(edit(1, 0.7), ChangePattern("undo", 2), edit(3, 0.69), apart=1.5, until=6.0)
    assert answers(connection) == [1, 2, 3]
    assert asked == [None, 0.5, None]


def test_frames_go_on_from_where_they_were():
    shown = frames(changed(edit(1, 0.7))[0])
    times = [frame.t_sim for frame in shown[1:]]
    assert times == sorted(times)
    assert np.diff(times).max() < 3 * INTERVAL


def test_a_newer_edit_takes_the_place_of_one_that_is_being_made():
    """It is one of the pattern that the first one makes; both are answered, in their order, when it is worn."""
    connection, drapes = changed(edit(1, 0.7), edit(2, 0.96))
    assert answers(connection) == [1, 2]
    assert [(made.id, made.last, made.change) for made in events(connection, EditMade)] == [
        (1, 1, "topology"),
        (2, 2, "topology"),
    ]
    assert [width_of(made.specification) for made in events(connection, EditMade)] == [0.35, 0.336]
    assert last_design(connection) == (0.336, False)
    assert [event.topology_id for event in events(connection, TopologyReady)] == [1, 2], "the first was never worn"
    assert connection.beside.begun == 2
    assert len(drapes) == 1
    assert min(times_of(connection, EditMade)) > ASKED + 0.1 + SECONDS


def test_of_many_edits_none_piles_up():
    connection, _ = changed(edit(1, 0.7), *(edit(k, 0.999) for k in range(2, 12)), apart=0.04)
    assert answers(connection) == list(range(1, 12))
    assert [event.topology_id for event in events(connection, TopologyReady)] == [1, 2]
    assert len(set(times_of(connection, EditMade))) == 1


def test_edits_that_come_faster_than_they_can_be_made_are_shown_nevertheless():
    """Each would take the place of the one before; one that has waited for long is worn first."""
    count, apart = 12, 0.4
    connection, _ = changed(edit(1, 0.7), *(edit(k, 0.999) for k in range(2, count + 1)), apart=apart, until=8.0)
    assert answers(connection) == list(range(1, count + 1))
    answered = times_of(connection, EditMade)
    waited = [at - (ASKED + apart * k) for k, at in enumerate(answered)]
    assert max(waited) < PATIENCE + apart + 2 * SECONDS + 10 * INTERVAL
    assert len(set(answered)) > 2
    assert width_of(events(connection, EditMade)[-1].specification) == pytest.approx(0.35 * 0.999 ** (count - 1))
    assert last_design(connection) == (pytest.approx(0.35 * 0.999 ** (count - 1), abs=1e-6), False)


def test_what_fails_while_a_newer_one_waits_is_refused_and_the_newer_one_is_worn():
    """The fourth edit is one of the pattern of the third, which can't be worn, and is made without it."""
    connection, _ = changed(edit(1, 0.7), edit(2, 0.999), edit(3, 0.7), edit(4, 0.98), apart=0.4, until=8.0)
    assert answers(connection) == [1, 2, -3, 4]
    assert last_design(connection) == (pytest.approx(0.35 * 0.999 * 0.98, abs=1e-6), False)
    assert events(connection, PhaseChanged)[-1].phase == "ready"


def test_what_can_not_be_worn_is_refused_and_what_came_before_and_after_is_made():
    connection, drapes = changed(edit(1, 0.7), edit(2, 0.7), edit(3, 0.98), until=8.0)
    assert answers(connection) == [1, -2, 3], "the third is worn without the second"
    (refused,) = events(connection, EditRefused)
    assert "too tight" in refused.message
    assert refused.remedy
    assert last_design(connection) == (0.343, False)
    assert events(connection, EditMade)[-1].id == 2
    assert len(drapes) == 1


def test_what_is_done_for_each_change_is_told_until_it_is_worn():
    """The first is dressed anew; the second, of another garment's pattern by then, goes along with it."""
    connection, _ = changed(edit(1, 0.62), edit(2, 0.98), apart=0.8, until=6.0)
    told = [event.changes for event in events(connection, ChangesTold)]
    assert told[-1] == ()
    first = [changes[0].doing for changes in told if changes]
    assert list(dict.fromkeys(first)) == ["remeshing", "building", "dressing", "settling"]
    assert {change.ticket for changes in told for change in changes} == {1, 2}
    assert all(change.detail for changes in told for change in changes)
    ended = times_of(connection, EditMade)[-1]
    assert times_of(connection, ChangesTold)[-1] == pytest.approx(ended, abs=3 * INTERVAL)
    assert times_of(connection, ChangesTold)[0] == pytest.approx(ASKED, abs=3 * INTERVAL)


def test_what_is_drawn_for_too_long_is_there_at_once(monkeypatch):
    monkeypatch.setattr(analytic_drape, "DRAWN", 3.0)
    unhurried = times_of(changed(edit(1, 0.62), until=8.0)[0], EditMade)
    monkeypatch.setattr(outfit_worker, "DRAWN_SECONDS", 0.5)
    hurried = times_of(changed(edit(1, 0.62), until=8.0)[0], EditMade)
    assert (len(unhurried), len(hurried)) == (1, 1)
    assert unhurried[0] - hurried[0] > 2.0


def test_a_carried_garment_is_told_to_be_remeshed_and_built():
    connection, _ = changed(edit(1, 0.7), Run(True))
    told = [event.changes[0].doing for event in events(connection, ChangesTold) if event.changes]
    assert told == ["remeshing", "building"]


def test_an_edit_that_takes_longer_than_it_may_is_refused_and_those_behind_it_are_made():
    """Dressing the first anew takes 1 s, of which it may take 0.8; the second alone is of the same mesh."""
    connection, (drape,) = changed(edit(1, 0.62), edit(2, 1.1), apart=0.3, edit_seconds=0.8)
    assert answers(connection) == [-1, 2]
    (refused,) = events(connection, EditRefused)
    assert "0.8 s" in refused.message
    assert "TRYON_SERVER_EDIT_SECONDS" in refused.remedy
    (at,) = times_of(connection, EditRefused)
    assert at == pytest.approx(ASKED + 0.8, abs=3 * INTERVAL)
    assert times_of(connection, EditMade)[0] == pytest.approx(at, abs=3 * INTERVAL)
    assert last_design(connection) == (0.55, False)
    assert drape.shapes[-1] == 0.55


def test_the_time_that_an_edit_may_take_is_counted_from_when_nothing_is_to_be_made_before_it():
    """Each takes 0.5 s; the second and the third together more than 0.8 s after they were asked for."""
    apart = PATIENCE / 2 + 0.1
    connection, _ = changed(*(edit(k, 0.7 if k == 1 else 0.99) for k in (1, 2, 3)), apart=apart, edit_seconds=0.8)
    assert answers(connection) == [1, 2, 3]


def test_taking_back_what_is_being_dressed_ends_that_at_once():
    connection, (drape,) = changed(edit(1, 0.62), ChangePattern("undo", 2), edit(3, 1.1), apart=0.7)
    assert answers(connection) == [1, 2, 3]
    undone = times_of(connection, EditMade, ticket=2)
    assert undone[0] == pytest.approx(ASKED + 0.7, abs=3 * INTERVAL)
    assert drape.shapes[-1] == 0.55
    assert connection.beside.task is None
    assert events(connection, PhaseChanged)[-1].phase == "ready"


def test_a_refusal_waits_for_the_answers_before_it():
    connection, _ = changed(edit(1, 0.7), ChangePattern("edit", 2, {"kind": "knit"}), edit(3, 0.98))
    assert answers(connection) == [1, -2, 3]
    assert last_design(connection) == (0.343, False)


def test_an_edit_that_is_being_made_is_taken_back():
    connection, (drape,) = changed(edit(1, 0.7), ChangePattern("undo", 2))
    assert answers(connection) == [1, 2]
    assert [(made.id, made.last, made.change) for made in events(connection, EditMade)] == [
        (1, 1, "value"),
        (1, 0, "value"),
    ]
    assert max(times_of(connection, EditMade)) < ASKED + 0.1 + 2 * INTERVAL, "it is worn all the while"
    assert drape.shapes == [0.5]
    assert len(events(connection, TopologyReady)) == 1


def test_an_edit_is_made_again_while_taking_it_back_is_made():
    steps = [ChangePattern(step, ticket) for step, ticket in (("undo", 2), ("redo", 3))]
    connection, _ = changed(edit(1, 0.62), *steps, apart=1.6, until=6.0)
    assert answers(connection) == [1, 2, 3]
    assert [made.last for made in events(connection, EditMade)] == [1, 0, 1]
    assert last_design(connection) == (0.31, False)


def test_what_is_held_in_the_meantime_is_shown_on_both_garments():
    held = ChangePattern("edit", 0, scale(1.2), hold=True)
    connection, (drape,) = changed(edit(1, 0.7), held)
    assert drape.shapes == [0.6]
    designs = [event.design for event in events(connection, Designed)]
    widths = [(round(d.panels[0].vertices[1][0] - d.panels[0].vertices[0][0], 6), d.held) for d in designs]
    assert widths == [(0.5, False), (0.6, True), (0.35, False), (0.42, True)]
    assert events(connection, EditRefused) == []


def test_what_was_held_is_held_on_when_the_edit_is_refused():
    held = ChangePattern("edit", 0, scale(1.2), hold=True)
    connection, (drape,) = changed(held, edit(1, 0.5))
    assert answers(connection) == [-1]
    assert drape.shapes == [0.6]
    assert last_design(connection) == (0.6, True)


def test_another_fabric_and_the_edit_that_is_being_made_are_put_on_together():
    connection, drapes = changed(edit(1, 0.7), fabric(2, "resting"))
    assert answers(connection) == [1, 2]
    assert [width_of(drape.specification) for drape in drapes] == [0.5]
    assert [event.topology_id for event in events(connection, TopologyReady)] == [1, 2]
    assert last_design(connection) == (0.35, False)
    assert sleeps(connection)


def test_an_edit_of_what_is_being_made_of_another_fabric_is_one_of_that():
    connection, _ = changed(fabric(1, "resting"), edit(2, 1.2))
    assert answers(connection) == [1, 2]
    assert [event.topology_id for event in events(connection, TopologyReady)] == [1, 2]
    assert last_design(connection) == (0.6, False)
    assert sleeps(connection)


def test_while_the_garment_is_made_of_another_fabric_the_old_one_streams():
    connection, _ = changed(fabric(1, "resting"))
    when = [frame.t_published for frame in frames(connection)]
    assert max(np.diff(when)) < 3 * INTERVAL
    assert [event.phase for event in events(connection, PhaseChanged)].count("dressing") == 1


def test_a_fabric_is_told_with_the_pattern_that_names_it_once_it_is_worn():
    """By name and in the pattern that is kept; taken back and made again it is as any edit."""
    steps = [fabric(1, "denim"), ChangePattern("undo", 2), ChangePattern("redo", 3)]
    connection, _ = changed(*steps, apart=2.0, until=8.0)
    assert answers(connection) == [1, 2, 3]
    told = [(event.fabric, event.design.done and event.design.done[-1].kind) for event in events(connection, Designed)]
    assert told == [("cotton", ()), ("denim", "change_fabric"), ("cotton", ()), ("denim", "change_fabric")]
    (made, undone, again) = events(connection, EditMade)
    assert made.specification["properties"]["fabric"] == "denim"
    assert [(each.id, each.last, each.change) for each in (made, undone, again)] == [
        (1, 1, "topology"),
        (1, 0, "topology"),
        (1, 1, "topology"),
    ]


def test_a_fabric_that_can_not_be_worn_is_refused_and_the_old_one_worn_on():
    connection, (drape,) = changed(fabric(1, "tight"), edit(2, 1.1), apart=2.0)
    assert answers(connection) == [-1, 2]
    (refused,) = events(connection, EditRefused)
    assert refused.remedy == "Enlarge the pieces."
    assert events(connection, Designed)[-1].fabric == "cotton"
    assert drape.shapes == [0.55]
    assert [event.topology_id for event in events(connection, TopologyReady)] == [1]
    assert frames(connection)[-1].t_published > 3.9


def test_an_edit_that_can_not_be_worn_does_not_take_the_fabric_with_it():
    connection, _ = changed(fabric(1, "resting"), edit(2, 0.5), until=6.0)
    assert answers(connection) == [1, -2]
    assert [event.topology_id for event in events(connection, TopologyReady)] == [1, 2]
    assert sleeps(connection)


def test_the_fabric_that_it_is_of_is_no_change():
    connection, _ = changed(fabric(1, "cotton"))
    (refused,) = events(connection, EditRefused)
    assert (refused.place, refused.message) == ("fabric", "it is of 'cotton' already")


def test_a_fabric_that_is_taken_back_in_the_meantime_is_not_made():
    connection, _ = changed(fabric(1, "denim"), fabric(2, "cotton"))
    assert answers(connection) == [1, 2]
    assert [event.topology_id for event in events(connection, TopologyReady)] == [1]
    assert events(connection, Troubled) == []


def test_a_held_session_wears_the_edit_too():
    connection, _ = changed(Run(False), edit(1, 0.7))
    assert answers(connection) == [1]
    assert events(connection, FrameReady)[-1].topology_id == 2


def test_a_failure_that_was_not_foreseen_is_told_and_the_old_garment_worn_on():
    def fail(order, progress):
        if order.specification is not None:
            raise RuntimeError("the needle broke")
        return analytic_drape.build(order, progress)

    connection, (drape,) = changed(edit(1, 0.62), edit(2, 1.1), build=fail, apart=2.0)
    assert answers(connection) == [-1, 2]
    (refused,) = events(connection, EditRefused)
    assert "the needle broke" in refused.message
    assert refused.remedy
    assert drape.shapes == [0.55]
    assert drape.steps > 150


def test_a_part_that_fails_is_told_and_the_old_garment_worn_on():
    class Torn(analytic_drape.WavingSheet):
        def recut(self, _cut, hung=None):  # noqa: ARG002
            yield None
            raise MemoryError("no room for it")

    connection, (drape,) = changed(edit(1, 0.7), build=lambda order, _: Torn(order.fabric))
    assert answers(connection) == [-1]
    assert "no room for it" in events(connection, EditRefused)[0].message
    assert drape.steps > 150


def test_edits_of_a_garment_that_is_given_up_are_refused():
    connection, _ = changed(edit(1, 0.7), edit(2, 0.98), fabric="failing")
    assert answers(connection) == [-1, -2]
    assert events(connection, PhaseChanged)[-1].phase == "failed"


def test_a_shape_that_needs_another_mesh_and_can_not_have_one_is_told_once():
    class Torn(analytic_drape.WavingSheet):
        def recut(self, _cut, hung=None):  # noqa: ARG002
            return iter(())

    def build(order, _progress):
        if order.specification is not None:
            raise problem_error("garment.unfit", "it is too wide", "Make it narrower.", place="garment")
        return Torn(order.fabric)

    connection, (drape,) = changed(edit(1, LATE_WIDTH / 0.5), build=build, until=6.0)
    assert answers(connection) == [1]
    (trouble,) = events(connection, Troubled)
    assert "a row is too long" in trouble.message
    assert "too wide" in trouble.message
    assert trouble.remedy
    assert connection.beside.begun == 2
    assert drape.steps > 250
