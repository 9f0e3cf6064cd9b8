"""A motion that is repeated and does not end as it began: how far it is off, and over what that is spread, is told."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from tryon_server.runtime import offline
from tryon_server.runtime.motions import MOTION_FOLDER, closing_note, list_motions, load_motion, read_motion
from tryon_server.runtime.order import DrapeOrder
from tryon_server.uploads.check import Telling, check
from tryon_solver.body import default_body
from tryon_solver.body.pose import Pose

BODY = default_body()


@pytest.fixture(scope="module")
def cut(tmp_path_factory):
    """The walk without its second half: it ends elsewhere, in another pose."""
    head, motion = (MOTION_FOLDER / "walk.bvh").read_text().split("MOTION\n")
    _, rate, *frames = motion.strip().splitlines()
    half = frames[: len(frames) // 2 + 10]
    path = tmp_path_factory.mktemp("cut") / "cut.bvh"
    path.write_text("\n".join([head + "MOTION", f"Frames: {len(half)}", rate, *half]) + "\n")
    return path


def test_how_far_the_end_is_from_the_start_is_told(cut):
    motion = read_motion(str(cut), BODY)[0]
    metres, turn = motion.closing_error()
    note = closing_note(motion)
    assert metres > 0.05
    assert f"its end is {metres:.2f} m" in note or f"its end is {100 * metres:.0f} cm" in note
    assert f"at one joint, {np.degrees(turn):.0f} degrees from its start" in note
    way, turns = motion.fades()
    assert note.endswith(f"the way is spread over its last {way:.2f} s, the turns over its last {turns:.2f} s")
    before = motion.duration - way - 0.01
    np.testing.assert_array_equal(motion.sample(before, loop=True).root, motion.sample(before).root)
    before = motion.duration - turns - 0.01
    np.testing.assert_array_equal(motion.sample(before, loop=True).rotations, motion.sample(before).rotations)


def test_the_motions_that_come_with_it_end_as_they_began():
    assert [closing_note(load_motion(entry.name, BODY)) for entry in list_motions()] == [""] * len(list_motions())


def test_an_upload_tells_it_since_a_session_repeats_it(cut):
    notes = check(cut.read_bytes(), Telling(kind="motion", name="cut")).motion.notes
    assert sum(note.startswith("where it repeats, its end is") for note in notes) == 1


@pytest.mark.parametrize(("seconds", "told"), [(None, 0), (1.0, 0), (20.0, 1)])
def test_a_recording_tells_it_where_it_is_longer_than_the_motion(cut, monkeypatch, seconds, told):
    drape = SimpleNamespace(own_motion=None, pose=Pose.rest(BODY), leap=lambda _: None)
    empty, faces = np.zeros((5, 0, 3), np.float32), np.zeros((0, 3), np.int32)
    monkeypatch.setattr(offline, "build_drape", lambda *_: drape)
    monkeypatch.setattr(offline, "_lead", lambda *_: None)
    monkeypatch.setattr(offline, "_record", lambda *_: offline.Recording(empty, faces, empty, faces, 0.5, ()))
    order = DrapeOrder(cut.parent / "absent.json", "cotton_jersey", "draft", "cpu")
    notes = offline.simulate(order, str(cut), seconds, 30.0, lambda *_: None).notes
    assert sum(note.startswith("motion: where it repeats, its end is") for note in notes) == told
