"""Two scenes by several solvers: what the scenes are, what is told of each solver, and what of one that is missing."""

import importlib.util
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "solver" / "bench"), str(Path(__file__).parent)]

import peer_case  # noqa: E402
import peers  # noqa: E402
from document import document  # noqa: E402
from frame_judge import FrameJudge  # noqa: E402
from made_up import ABOUT  # noqa: E402
from peer_case import PEER_SCENES, PeerCase  # noqa: E402
from peer_scenes import BALL, FPS, LIMB, SCENES  # noqa: E402
from peer_table import row  # noqa: E402

SHORT = 0.2  # s: twelve frames, two of them timed


@pytest.fixture(params=SCENES)
def scene(request):
    return SCENES[request.param](100, 3.0)


def test_parts_are_closed_and_the_cloth_starts_free_of_them(scene):
    for vertices, faces in scene.parts:
        part = trimesh.Trimesh(vertices, faces, process=False)
        assert part.is_watertight
        assert part.volume > 0
    faces, body, x = scene.scene.garment.faces, scene.scene.body.faces, scene.scene.x_start
    assert FrameJudge(faces, body, x, scene.surface(0.0)).judge(x, scene.surface(0.0)).clean
    assert len(x) == 100


def test_parts_as_joints_stand_where_they_are_led(scene):
    for t in (0.0, 0.7, 1.0, 2.5):
        np.testing.assert_allclose(scene.scene.body.surface(scene.pose(t)), scene.surface(t), atol=1e-9)


def test_the_limb_bends_by_a_right_angle_and_stands_at_the_end():
    scene = SCENES["limb-tube"](100, 3.0)
    assert scene.surface(0.0)[:, 0].min() == pytest.approx(-0.4 - LIMB)
    assert scene.surface(1.0)[:, 0].min() == pytest.approx(-LIMB, abs=1e-3)
    assert scene.surface(1.0)[:, 1].min() == pytest.approx(-0.4 - LIMB, abs=1e-3)
    np.testing.assert_array_equal(scene.surface(2.0), scene.surface(3.0))


class Shaking:
    """A solver whose cloth lies above the ball, shakes, goes through the ball and is no number at last."""

    def __init__(self, scene, speed, through, nowhere):
        self.x, self.scene = scene.scene.x_start, scene
        self.speed, self.through, self.nowhere, self.frame = speed, through, nowhere, 0

    def go(self, frame):
        self.frame = frame

    def cloth(self):
        if self.frame >= self.nowhere:
            return np.full_like(self.x, np.nan)
        # 20 Hz
        shaken = np.sqrt(2) * self.speed * np.sin(2 * np.pi * 20 * self.frame / FPS) / (2 * FPS * np.sin(np.pi / 3))
        return self.x + [0, shaken - (BALL if self.frame == self.through else 0), 0]

    def surface(self, frame):
        return self.scene.surface(frame / FPS)


@pytest.fixture
def shaking(monkeypatch):
    def played(every=10, speed=5e-3, through=0, nowhere=10**6):
        case = PeerCase("sphere-drop", 100, "vbd", "cpu", 3.0)
        monkeypatch.setattr(peers, "player_of", lambda _case, scene: Shaking(scene, speed, through, nowhere))
        return peers.played(case, every)

    return played


def test_rest_jitter_is_the_speed_above_8_hz(shaking):
    found = shaking(every=0)
    assert found["jitter"] == pytest.approx(5e-3, rel=0.1)
    assert (found["asked"], found["frames"]) == (0, 180)
    assert found["stretch"] == pytest.approx(1.0, abs=1e-6)


def test_frames_that_cross_are_counted(shaking):
    found = shaking(every=30, through=60)
    assert (found["asked"], found["unclean"], found["with_itself"], found["with_body"]) == (6, 1, 0, 1)


def test_a_solver_that_blows_up_ends_there(shaking):
    found = shaking(nowhere=43)
    assert (found["frames"], found["of_frames"], found["unclean"]) == (43, 180, 1)
    assert found["jitter"] is found["stretch"] is None
    assert "43 of 180: not a number" in row({"name": "n", **found})


def test_what_is_missing_is_said_with_how_to_get_it(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda _name: None)
    said = {solver: PeerCase("limb-tube", 100, solver, "cuda:0", 3.0).missing() for solver in peer_case.OTHERS}
    assert {s for s in said if "pip install '.[peers]'" in said[s]} == {"vbd", "style3d", "style3d-4", "xpbd"}
    assert "peers-gpu" in said["uipc"]
    assert PeerCase("limb-tube", 100, "live", "cpu", 3.0).missing() == ""


def test_libuipc_is_not_asked_on_a_processor(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda _name: object())
    assert "--device cuda:0" in PeerCase("limb-tube", 100, "uipc", "cpu", 3.0).missing()
    assert PeerCase("limb-tube", 100, "uipc", "cuda:0", 3.0).missing() == ""


def test_the_scenes_that_can_be_asked_for_are_those_there_are():
    assert tuple(SCENES) == PEER_SCENES


def test_one_run_has_ours_and_a_line_for_each_other(tmp_path):
    command = [sys.executable, str(ROOT / "solver" / "bench"), "--garments", "--peers", "uipc", "--vertices", "64"]
    command += ["--seconds", str(SHORT), "--every", "6", "--out", str(tmp_path)]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=280)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    run = json.loads((tmp_path / "results.json").read_text())
    assert run["results"] == []
    assert [(r["scene"], r["solver"]) for r in run["peers"]] == [
        (scene, solver) for scene in SCENES for solver in ("draft", "uipc")
    ]
    for ours, other in (run["peers"][:2], run["peers"][2:]):
        assert (ours["frames"], ours["asked"], ours["unclean"]) == (12, 2, 0)
        assert 0 < ours["frame_ms"]["p50"] <= ours["frame_ms"]["p99"]
        assert "pyuipc" in other["failure"] or "--device cuda:0" in other["failure"]
    for table in ((tmp_path / "table.md").read_text(), document([{"name": "one", **run}], {})):
        assert "| sphere-drop | 64 | ours, draft | " in table
        assert "| sphere-drop | 64 | libuipc | not played: libuipc" in table
    assert ABOUT.keys() <= run["about"].keys()


@pytest.mark.parametrize("solver", ["style3d", "style3d-4", "xpbd", "vbd"])
def test_newton_holds_what_is_held_and_lets_the_rest_fall(solver):
    pytest.importorskip("newton", reason="Newton is not installed: pip install -e '.[peers]'")
    from peer_newton import ByNewton

    scene = SCENES["limb-tube"](100, 3.0)
    by = ByNewton(scene, solver, "cpu")
    start = by.cloth()
    for frame in (1, 2):
        by.go(frame)
    fallen = (start - by.cloth())[:, 1]
    assert np.abs(fallen[scene.held]).max() == 0.0
    free = np.setdiff1d(np.arange(100), np.concatenate([scene.held, scene.held - 10]))
    assert fallen[free].mean() == pytest.approx(0.5 * 9.81 * (2 / FPS) ** 2, rel=0.3)
    assert int(by.number.numpy()[0]) == 20  # sub-steps
    led = by.now.body_q.numpy()[0, 3:]
    np.testing.assert_allclose(led, scene.turn(2 / FPS)[1], atol=1e-6)


@pytest.mark.parametrize(("solver", "iterations", "searches"), [("style3d", 10, 10), ("style3d-4", 4, 1)])
def test_style3d_is_played_by_its_default_and_as_its_makers_play_a_garment(solver, iterations, searches):
    pytest.importorskip("newton", reason="Newton is not installed: pip install -e '.[peers]'")
    from peer_newton import ByNewton

    by = ByNewton(SCENES["sphere-drop"](100, 3.0), solver, "cpu")
    search, searched = by.pipeline.collide, []

    def collide(*given):
        searched.append(1)
        search(*given)

    by.pipeline.collide = collide
    by.go(1)
    assert (by.solver.config.iterations, len(searched)) == (iterations, searches)


@pytest.mark.parametrize("name", SCENES)
def test_libuipc_takes_the_scenes(name):
    pytest.importorskip("uipc", reason="libuipc is not installed: pip install -e '.[peers-gpu]'")
    from peer_uipc import ByUipc

    scene = SCENES[name](100, 3.0)
    by = ByUipc(scene, "none")
    by.go(1)
    np.testing.assert_allclose(by.cloth(), scene.scene.x_start, atol=1e-9)
    np.testing.assert_allclose(by.surface(1), scene.surface(0.0), atol=1e-9)
