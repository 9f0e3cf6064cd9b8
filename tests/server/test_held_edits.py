"""A drag's edits are worked out in the process beside, come to what they do here, and give way to all else."""

import json
import os
import signal
import time
from contextlib import closing
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import tasks
from scripted_worker import InThisProcess

import tryon_server
from tryon_server.runtime.beside import ProcessBeside
from tryon_server.runtime.design import design_of
from tryon_server.runtime.held_edits import HeldEdits, MakingReady, WorkedOut
from tryon_server.runtime.redesign import wanted
from tryon_server.runtime.solver_drape import SolverDrape
from tryon_server.runtime.worn_garment import alone
from tryon_server.runtime.worn_pattern import WornPattern
from tryon_server.sessions.commands import ChangePattern
from tryon_solver import PRESETS
from tryon_solver.body import default_body
from tryon_solver.geometry.pattern import parse_pattern
from tryon_solver.geometry.size import in_size, mesh_in_size
from tryon_solver.geometry.weld import weld
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.redesign.drag import begin_drag
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.history import History
from tryon_solver.redesign.remesh import Remesh
from tryon_solver.scene import Scene
from tryon_solver.simulation import build

PATIENCE = 60.0  # s, for a process to start on a busy machine
SIZE, THICKNESS = 0.9, 0.6e-3
SPECIFICATION = json.loads((Path(tryon_server.__file__).parent / "demo" / "patterns" / "tshirt.json").read_text())
HISTORY = History(SPECIFICATION)


class Worn:
    """Of a garment what is asked of it here."""

    def __init__(self):
        mesh = mesh_in_size(parse_pattern(SPECIFICATION), 0.08, SIZE)
        self.pattern = WornPattern(SPECIFICATION, mesh, SIZE, 0.08)
        self.shape_of = self.pattern.shapes(THICKNESS)


@pytest.fixture(scope="module")
def worn():
    return Worn()


@pytest.fixture(scope="module")
def beside():
    with closing(ProcessBeside()) as beside:
        yield beside


def held(edit) -> ChangePattern:
    return ChangePattern("edit", 0, edit, hold=True)


def hem(by: float) -> ChangePattern:
    return held({"kind": "lengthen", "panel": "front", "edge": 0, "by": by})


def outcome(edits, worn):
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        found = edits.outcome(worn)
        if found is not None:
            return found
        time.sleep(0.002)
    raise AssertionError("it took too long")


def ready(beside, worn) -> HeldEdits:
    """Held edits of what is worn, once the process beside is ready for them."""
    edits = HeldEdits(beside)
    assert not edits.take(hem(0.3), HISTORY, worn)
    until_done(beside, edits, worn)
    return edits


def until_done(beside, edits, worn) -> None:
    end = time.monotonic() + PATIENCE
    while beside.doing is not None:
        assert edits.outcome(worn) is None
        assert time.monotonic() < end, "it took too long"
        time.sleep(0.002)


def test_until_the_process_is_there_and_knows_what_is_worn_edits_are_left_to_be_worked_out_here(worn):
    """On a busy machine it takes seconds to start, in which whoever drags would see nothing."""
    with closing(ProcessBeside()) as beside:
        beside.warm()
        os.kill(beside._process.pid, signal.SIGSTOP)
        edits = HeldEdits(beside)
        for by in (0.01, 0.02):
            assert not edits.take(hem(by), HISTORY, worn)
            assert not edits.under_way
            assert edits.outcome(worn) is None
        assert not edits.take(ChangePattern("undo", 1), HISTORY, worn)
        assert beside.doing is not None, "what ends a drag lets the process come to be there"
        os.kill(beside._process.pid, signal.SIGCONT)
        until_done(beside, edits, worn)
        assert edits.take(hem(0.03), HISTORY, worn)
        assert edits.under_way
        assert isinstance(outcome(edits, worn)[1], WorkedOut)


def test_another_garment_is_told_of_before_its_edits_are_worked_out(beside, worn):
    edits, other = ready(beside, worn), Worn()
    assert not edits.take(hem(0.01), HISTORY, other)
    until_done(beside, edits, other)
    assert edits.take(hem(0.01), HISTORY, other)
    assert isinstance(outcome(edits, other)[1], WorkedOut)


def test_an_edit_has_the_bits_that_it_has_here(beside, worn):
    """One after the other, as a drag's."""
    edits = ready(beside, worn)
    drag = begin_drag(in_size(worn.pattern.panels, 1 / SIZE), parse_pattern(SPECIFICATION), THICKNESS / SIZE)
    for by in (0.01, 0.02):
        assert edits.take(hem(by), HISTORY, worn)
        assert edits.under_way
        command, worked_out = outcome(edits, worn)
        assert command == hem(by)
        found, here = worked_out.wanted(HISTORY), wanted(HISTORY, hem(by))
        assert (found.specification, found.notes, found.id) == (here.specification, here.notes, 0)
        moved, mesh = drag.moved(parse_pattern(here.specification)), drag.mesh_in(found.shape)
        assert np.abs(moved.uv - drag.mesh.uv).max() == pytest.approx(by, rel=0.2)
        assert np.array_equal(mesh.uv, moved.uv)
        assert np.array_equal(mesh.placed, moved.placed)
        drawn = design_of(found.specification, HISTORY, held=True, notes=found.notes, drawn=found.drawn)
        assert drawn == design_of(here.specification, HISTORY, held=True, notes=here.notes)
        assert edits.outcome(worn) is None


def test_a_garment_takes_on_the_shape_that_was_found_elsewhere(worn):
    """As the one that it finds itself, and no other; why it needs another mesh it is told with the shape."""
    mesh, body = worn.pattern.panels, default_body()
    welded = weld(mesh)
    scene = Scene(welded.garment(), welded.mean_of_vertices(mesh.placed), body, FABRICS["cotton_jersey"])
    one, other = (
        SolverDrape(sim, body.start(), (alone(sim, mesh.panel_names, worn.pattern),), body, size=SIZE)
        for sim in (build(scene, PRESETS["draft"], "cpu", body.start(), None, tangled=True) for _ in range(2))
    )
    longer, shorter = (wanted(HISTORY, hem(by)).specification for by in (0.02, -0.02))
    assert one.shape_of is one.shape_of
    assert one.reshape(longer, one.shape_of(longer)) == other.reshape(longer) == ""
    one.advance(one.pose, 1 / 30)
    other.advance(other.pose, 1 / 30)
    rest = [drape.simulation.scene.garment.uv_corners for drape in (one, other)]
    assert np.array_equal(*rest)
    assert not np.array_equal(rest[0], welded.garment().uv_corners)
    assert one.reshape(shorter, one.shape_of(shorter)) == ""
    gone = wanted(HISTORY, held({"kind": "remove_piece", "panel": "left_sleeve_back"})).specification
    assert one.reshape(gone, one.shape_of(gone)) == other.reshape(gone) != ""


def test_why_one_needs_another_mesh_is_told(beside, worn):
    edits = ready(beside, worn)
    assert edits.take(held({"kind": "remove_piece", "panel": "left_sleeve_back"}), HISTORY, worn)
    _, worked_out = outcome(edits, worn)
    shape = worked_out.wanted(HISTORY).shape
    assert isinstance(shape, Remesh)
    assert "is gone" in shape.message


def test_one_that_can_not_be_made_is_refused_in_the_same_words(beside, worn):
    edits, bad = ready(beside, worn), held({"kind": "lengthen", "panel": "frond", "edge": 0, "by": 0.01})
    assert edits.take(bad, HISTORY, worn)
    _, worked_out = outcome(edits, worn)
    with pytest.raises(EditError) as there:
        worked_out.wanted(HISTORY)
    with pytest.raises(EditError) as here:
        wanted(HISTORY, bad)
    assert (there.value.message, there.value.place, there.value.remedy) == (
        here.value.message,
        here.value.place,
        here.value.remedy,
    )


def test_what_ends_a_drag_ends_no_process(beside, worn):
    """To start it anew takes a second, in which the garment of the edit that is kept would not be made."""
    edits = ready(beside, worn)
    assert edits.take(hem(0.01), HISTORY, worn)
    outcome(edits, worn)
    process = process_of(beside)
    assert edits.take(hem(0.02), HISTORY, worn)
    assert not edits.take(ChangePattern("undo", 1), HISTORY, worn)
    assert not edits.under_way
    assert edits.outcome(worn) is None
    assert process_of(beside) == process != os.getpid()


def test_the_garment_travels_once_and_again_to_a_process_that_was_started_since(worn):
    with closing(ProcessBeside()) as beside:
        edits, sent = HeldEdits(beside), []

        def begin(task, short=False, begin=beside.begin):
            shapes = task.shapes if isinstance(task, MakingReady) else task.shape_of
            sent.append(len(shapes.worn))
            begin(task, short)

        beside.begin = begin
        shapes = []
        for by in (0.01, 0.01, 0.02, 0.02):
            if len(shapes) == 3:
                beside.close()
                assert edits.take(hem(by), HISTORY, worn)
                assert outcome(edits, worn) == (hem(by), None), "to be worked out here"
            if len(shapes) % 3 == 0:
                assert not edits.take(hem(by), HISTORY, worn)
                until_done(beside, edits, worn)
            assert edits.take(hem(by), HISTORY, worn)
            shapes.append(outcome(edits, worn)[1].shape)
        whole = len(worn.shape_of.worn)
        assert sent == [whole, 0, 0, 0, 0, whole, 0]
        for one, other in (shapes[:2], shapes[2:]):
            assert np.array_equal(one.uv, other.uv)
        assert not np.array_equal(shapes[0].uv, shapes[2].uv)


def process_of(beside) -> int:
    beside.begin(os.getpid)
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        made = beside.outcome()
        if made is not None:
            return made.value
        time.sleep(0.002)
    raise AssertionError("it took too long")


def test_while_something_else_is_done_it_is_left_to_be_done_here():
    beside = InThisProcess(lambda: 0.0, 1.0)
    beside.begin(partial(tasks.double, 1))
    edits = HeldEdits(beside)
    assert not edits.take(hem(0.01), HISTORY, Worn())
    assert not edits.under_way


@pytest.mark.parametrize("given_up", [True, False])
def test_one_that_came_to_nothing_is_told_to_be_worked_out_again(worn, given_up):
    """Given up for another task, or found for a garment that is not worn any more."""
    beside = InThisProcess(lambda: 0.0, 1.0)
    edits, now = ready(beside, worn), worn if given_up else Worn()
    assert edits.take(hem(0.01), HISTORY, worn)
    if given_up:
        beside.begin(partial(tasks.double, 1))
    assert edits.outcome(now) == (hem(0.01), None)
    assert edits.outcome(now) is None
