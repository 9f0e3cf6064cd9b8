"""Persons recorded in mid-motion: a pattern is put on where the body is held fit for it, and led to the first frame."""

from pathlib import Path

import held_bodies as held
import numpy as np
import pytest
from frame_judge import FrameJudge

import tryon_server.runtime.production as production
from tryon_server.problems import ProblemError
from tryon_server.runtime.offline import simulate
from tryon_server.runtime.order import DrapeOrder
from tryon_solver.body.lead_back import RAMP
from tryon_solver.dressing.fit import TightError
from tryon_solver.files.raw_mesh import MeshFileError

SHIRT = Path(__file__).resolve().parents[2] / "server" / "tryon_server" / "demo" / "patterns" / "tshirt.json"
FPS = 15.0


def order(body, size=1.0):
    return DrapeOrder(SHIRT, "cotton_jersey", "draft", "cpu", body=body, edge_length=0.03, size=size)


@pytest.mark.long
def test_who_is_recorded_in_mid_stride_is_dressed_where_the_arms_are_apart_and_begins_in_mid_stride(tmp_path):
    frames = held.led(held.mid_stride(), held.A_POSE, seconds=0.8, fps=FPS)
    path = held.saved(tmp_path / "walks.npz", frames, FPS)
    stages = []
    recording = simulate(order(path), None, 0.3, FPS, lambda stage, _: stages.append(stage))
    (note,) = [note for note in recording.notes if "dressed in frame" in note]
    frame = int(note.split("dressed in frame ")[1].split(" of 13")[0])
    assert 3 <= frame <= 12
    assert "then led to frame 1, backwards through its own frames" in note
    # between being dressed and being recorded it was led at its own pace, which takes as long as getting there did
    steps = stages.count("Moving into the first pose")
    assert steps == np.ceil(((frame - 1) / FPS + RAMP) * FPS)
    judge = FrameJudge(recording.cloth_faces, recording.body_faces, recording.cloth[0], recording.body[0])
    assert all(judge.judge(cloth, body).clean for cloth, body in zip(recording.cloth, recording.body))
    for k in (0, 4):  # its own frames from the first on, as they stand to each other
        shown, own = recording.body[k] - recording.body[0].mean(axis=0), frames[k] - frames[0].mean(axis=0)
        assert np.linalg.norm(shown - own, axis=1).mean() < 0.01
    trunk = recording.body[0][(frames[0][:, 1] > 1.0) & (frames[0][:, 1] < 1.3)]
    assert np.linalg.norm((recording.cloth[0].mean(axis=0) - trunk.mean(axis=0))[[0, 2]]) < 0.08, "it is worn"
    assert max(report["body_lag"] for report in recording.reports) < 0.02


@pytest.mark.long
def test_a_size_is_not_looked_for_on_who_keeps_the_arms_crossed(tmp_path, monkeypatch):
    path = held.saved(tmp_path / "crossed.npz", np.array([held.skin(held.BODY, held.CROSSED)] * 3, np.float32), FPS)
    tried = []

    def is_tight(*given, **_):
        tried.append(given)
        raise TightError("it is too tight", "panels.front", "Enlarge it")

    monkeypatch.setattr(production, "dress", is_tight)
    with pytest.raises(ProblemError, match="how the body is held, not the size") as caught:
        simulate(order(path, size=None), None, 0.1, FPS, lambda *_: None)
    problem = caught.value.problem
    assert len(tried) == 1
    assert (problem.code, problem.place) == ("garment.unfit", "body")
    assert problem.message.endswith("as it is, it is too tight")
    assert "A pose" in problem.remedy


def test_a_mesh_garment_stays_with_the_first_frame(tmp_path, monkeypatch):
    """It is already worn there, however the body is held."""
    path = held.saved(tmp_path / "b.npz", held.led(held.CROSSED, held.A_POSE, seconds=0.4, fps=FPS), FPS)
    garment = tmp_path / "belt.obj"
    garment.write_text("v 0 1 0.2\nv 0.1 1 0.2\nv 0 1.1 0.2\nf 1 2 3\n")
    asked = []

    def worn(_garment, body, stance, *_given, **_more):
        asked.append((body.surface(stance), stance.time))
        raise MeshFileError("enough seen", "belt.obj", "Nothing")

    monkeypatch.setattr(production, "read_garment", lambda *_: None)
    monkeypatch.setattr(production, "dress_mesh", worn)
    brought = DrapeOrder(garment, "cotton_jersey", "draft", "cpu", body=path)
    with pytest.raises(ProblemError, match="enough seen"):
        simulate(brought, None, 0.1, FPS, lambda *_: None)
    ((surface, time),) = asked
    assert time == 0.0
    np.testing.assert_allclose(surface, held.skin(held.BODY, held.CROSSED), atol=1e-5)
