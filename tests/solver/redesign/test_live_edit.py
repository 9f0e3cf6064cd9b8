"""The demo's T-shirt is edited while it is worn: it follows at once, and passes through nothing."""

import gc
import tracemalloc
from concurrent.futures import Future
from functools import lru_cache

import numpy as np
import pytest
from frame_judge import FrameJudge
from pattern_measures import demo

from tryon_solver import PRESETS, dress, live_edit
from tryon_solver.body.model import default_body
from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import parse_pattern
from tryon_solver.geometry.size import in_size
from tryon_solver.live_edit import (
    FASTEST,
    FASTEST_STRAIN,
    INVERSE_SECONDS,
    RAMP_SECONDS,
    STEP_SECONDS,
    LiveEdit,
)
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.redesign import edits
from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.drag import begin_drag
from tryon_solver.redesign.remesh import Remesh

FPS = 30
FABRIC = FABRICS["cotton_jersey"]
FRONT = "front"


@lru_cache
def pattern_with(*made):
    """The demo's T-shirt after these edits."""
    spec = demo("tshirt")
    for edit in made:
        spec = apply(spec, edit).specification
    return parse_pattern(spec)


def longer(by):
    """By so much at the hem [m], at the front, which the back follows along the side seams."""
    return pattern_with(edits.Lengthen(FRONT, 0, by))


class Worn:
    """A T-shirt of some 300 vertices, put on and standing, with its drag."""

    def __init__(self):
        pattern = pattern_with()
        mesh = mesh_pattern(pattern, 0.06)
        self.dressed = dress(mesh, default_body(), FABRIC, PRESETS["draft"])
        self.sim = self.dressed.simulation
        self.edit = LiveEdit(self.sim, begin_drag(mesh, pattern, FABRIC.thickness))
        body, x = self.sim.scene.body, self.sim.cloth_positions()
        self.judge = FrameJudge(self.sim.scene.garment.faces, body.faces, x, self.sim.body_positions())
        self.start, self.frames = self.sim.state.time, 0

    def advance(self, frames=1.0):
        """A frame, or one that is so many frames long; the speed of the fastest vertex in it [m/s]."""
        self.frames += frames
        time = self.start + self.frames / FPS
        self.edit.before_frame(time)
        before = self.sim.cloth_positions()
        report = self.sim.advance(self.dressed.pose, time)
        assert report.retries == 0
        assert self.judge.judge(self.sim.cloth_positions(), self.sim.body_positions()).clean
        return float(np.linalg.norm(self.sim.cloth_positions() - before, axis=1).max() * FPS)


@pytest.fixture(scope="module")
def worn():
    return Worn()


def test_a_drag_is_followed_and_undone_to_the_last_bit(worn):
    """A hem drawn down by 4 cm in 20 edits, two a frame, and drawn back."""
    sim, edit = worn.sim, worn.edit
    for _ in range(5):
        worn.advance()
    inverse, weights = sim.search.inverse.numpy().copy(), sim.matrices.rows.weights.numpy().copy()
    corners, hem = sim.scene.garment.uv_corners.copy(), sim.cloth_positions()[:, 1].min()
    fastest = 0.0
    for k in range(1, 21):
        assert edit.want(longer(0.002 * k)) is None
        if k % 2 == 0:
            fastest = max(fastest, worn.advance())
    assert not edit.settled
    for _ in range(20):
        fastest = max(fastest, worn.advance())
    edit.finish()
    assert edit.settled
    np.testing.assert_array_equal(edit.now.uv, begin_drag(edit.drag.mesh, pattern_with(), 1e-4).moved(longer(0.04)).uv)
    assert hem - sim.cloth_positions()[:, 1].min() == pytest.approx(0.04, abs=0.01)
    assert 0.1 < fastest < 1.5
    assert np.median(np.abs(sim.search.inverse.numpy() / inverse - 1)) > 1e-3
    assert edit.want(pattern_with()) is None
    edit.finish()
    np.testing.assert_array_equal(sim.scene.garment.uv_corners, corners)
    np.testing.assert_array_equal(sim.matrices.rows.weights.numpy(), weights)
    np.testing.assert_array_equal(sim.search.inverse.numpy(), inverse)
    for _ in range(10):
        worn.advance()


def test_the_newest_edit_wins(worn):
    """Of a hundred edits between two frames the last is gone to, in the time of one."""
    edit = worn.edit
    for k in range(100):
        assert edit.want(longer(0.0003 * (k + 1))) is None
    for _ in range(round(RAMP_SECONDS * FPS) + 1):
        worn.advance()
    np.testing.assert_array_equal(edit.now.uv, edit.wanted.uv)
    np.testing.assert_array_equal(edit.wanted.uv, edit.drag.moved(longer(0.03)).uv)
    for _ in range(100):
        worn.advance()
        if edit.settled:
            break
    assert edit.settled  # the inverse came from its thread
    edit.want(pattern_with())
    edit.finish()


@pytest.mark.parametrize("by", [0.03, 0.3])
def test_no_point_of_the_pattern_goes_faster_than_cloth_can_follow(worn, by):
    """A short way takes RAMP_SECONDS, a long one as long as its longest way and its largest strain need."""
    edit = worn.edit
    assert edit.want(longer(by)) is None
    before, wanted = edit.now.uv.copy(), edit.wanted.uv
    sides = np.stack([edit.now.faces, np.roll(edit.now.faces, -1, axis=1)], axis=-1).reshape(-1, 2)

    def lengths(uv):
        return np.linalg.norm(uv[sides[:, 0]] - uv[sides[:, 1]], axis=1)

    farthest = np.linalg.norm(wanted - before, axis=1).max()
    strain = np.abs(np.log(lengths(wanted) / lengths(before))).max()
    assert farthest == pytest.approx(by, rel=0.1)
    assert edit.ramp_seconds == pytest.approx(max(RAMP_SECONDS, farthest / FASTEST, strain / FASTEST_STRAIN))
    frames = 0
    while not np.array_equal(edit.now.uv, wanted):
        was, frames = edit.now.uv.copy(), frames + 1
        worn.advance()
        way = np.linalg.norm(edit.now.uv - was, axis=1).max()
        assert way <= farthest / edit.ramp_seconds * (STEP_SECONDS + 1 / FPS) + 1e-9
    assert edit.ramp_seconds <= frames / FPS + 1e-6 < edit.ramp_seconds + STEP_SECONDS + 2 / FPS
    edit.want(pattern_with())
    edit.finish()


def test_on_a_long_way_inverses_are_made_now_and_then_and_at_its_end(worn, monkeypatch):
    """Each is ready at once, so that none keeps the next from being begun."""
    begun = []

    class AtOnce:
        def submit(self, make):
            begun.append(round(worn.frames / FPS, 2))
            made = Future()
            made.set_result(make())
            return made

    monkeypatch.setattr(live_edit, "BESIDE", AtOnce())
    edit, start = worn.edit, worn.frames
    for k in range(1, 76):
        assert edit.want(longer(0.0004 * k)) is None
        worn.advance()
    assert len(begun) == 2, "in two and a half seconds"
    assert begun[0] - start / FPS >= INVERSE_SECONDS
    assert begun[1] - begun[0] >= INVERSE_SECONDS
    for _ in range(round(RAMP_SECONDS * FPS) + 2):
        worn.advance()
    assert len(begun) == 3
    assert edit.settled
    edit.want(pattern_with())
    edit.finish()


def test_frames_of_uneven_length_wait_for_no_inverse(worn, monkeypatch):
    """Steps of another half octave go on with the inverse of others, and have their own once it is made beside."""
    asked = []

    class WhenAskedFor:
        def submit(self, make):
            asked.append((make, Future()))
            return asked[-1][1]

    def refused():
        raise AssertionError("a frame waits for an inverse")

    monkeypatch.setattr(live_edit, "BESIDE", WhenAskedFor())
    edit, sim = worn.edit, worn.sim
    assert edit.want(longer(0.02)) is None
    lengths, keys = (1.0, 0.6), set()
    with monkeypatch.context() as patch:
        patch.setattr(sim, "reduced_inverse", refused)
        for k in range(12):
            worn.advance(lengths[k % 2])
            keys.add(sim.factor_key)
        assert len(keys) == 2
        assert edit.wanted is edit.now
        assert not edit.settled
        for k in range(8):
            for make, future in asked:
                if not future.done():
                    future.set_result(make())
            worn.advance(lengths[k % 2])
        assert len(asked) == 2
    assert edit.settled
    assert set(sim.inverses) == keys
    for key, inverse in sim.inverses.items():
        sim.use_time_step(1 / FPS if key == max(keys) else 0.6 / FPS)
        assert sim.factor_key == key
        np.testing.assert_array_equal(sim.search.inverse.numpy(), inverse)
        np.testing.assert_allclose(inverse, sim.reduced_inverse(), rtol=0, atol=1e-5 * np.abs(inverse).max())
    edit.want(pattern_with())
    edit.finish()


def test_a_drag_keeps_nothing_of_its_edits(worn):
    """After a thousand shapes nothing is held of any: what a process takes besides, some bytes for each conversion of
    a sparse matrix, is less than a tenth of a shape's coordinates."""
    edit = worn.edit
    shapes = [edit.drag.moved(longer(0.001 * k)) for k in range(1, 11)]
    time = worn.sim.state.time

    def go(rounds):
        nonlocal time
        for k in range(rounds):
            assert edit.want_mesh(shapes[k % len(shapes)]) is None
            time += 2 * STEP_SECONDS
            edit.before_frame(time)

    go(2 * len(shapes))
    tracemalloc.start()
    try:
        go(len(shapes))
        edit.finish()
        gc.collect()
        before, _ = tracemalloc.get_traced_memory()
        go(1000)
        edit.finish()
        gc.collect()
        after, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert before > shapes[0].uv.nbytes
    assert after - before < 1000 * shapes[0].uv.nbytes / 10
    assert len(worn.sim.inverses) == 1
    edit.want(pattern_with())
    edit.finish()


def test_what_needs_a_new_mesh_is_told_and_changes_nothing(worn):
    edit = worn.edit
    before = edit.wanted
    assert isinstance(edit.want(pattern_with(edits.RemovePiece("left_sleeve_back"))), Remesh)
    assert edit.wanted is before
    assert edit.settled


@pytest.mark.long
def test_a_garment_in_another_size_is_worn_in_it_and_an_edit_taken_back_to_the_last_bit():
    pattern = pattern_with()
    mesh = mesh_pattern(pattern, 0.06)
    dressed = dress(in_size(mesh, 1.1), default_body(), FABRIC, PRESETS["draft"])
    own = in_size(in_size(mesh, 1.1), 1.0 / 1.1)  # to the worn size and back: not the bits that were meshed
    assert np.abs(own.uv - mesh.uv).max() > 0
    edit = LiveEdit(dressed.simulation, begin_drag(own, pattern, FABRIC.thickness / 1.1), 1.1)
    corners = dressed.simulation.scene.garment.uv_corners
    np.testing.assert_array_equal(edit.garment().uv_corners, corners)
    assert edit.want(longer(0.03)) is None
    edit.finish()
    front = mesh.panel_of_face == mesh.panel_names.index(FRONT)
    now = dressed.simulation.scene.garment.uv_corners
    grown = [np.ptp(uv[front][..., 1]) for uv in (now, corners)]
    assert grown[0] - grown[1] == pytest.approx(0.033, abs=2e-3)
    assert edit.want(pattern) is None
    edit.finish()  # taken back, not a bit is changed
    np.testing.assert_array_equal(dressed.simulation.scene.garment.uv_corners, corners)
