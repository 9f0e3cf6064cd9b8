"""Detection that is skipped while a bound on the device says that its list holds: no frame crosses, and the cloth does
what it does when every step searches.

A square of cloth falls on a ball that stands, turns as a whole and is then moved.
"""

from dataclasses import replace

import numpy as np
import pytest
from frame_judge import FrameJudge
from scipy.spatial.transform import Rotation
from small_scenes import STILL, fabric, icosphere, rigid_body, sheet

from tryon_solver.contact import broad_phase
from tryon_solver.scene import WORN, Scene
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build
from tryon_solver.stepping import carry_once

DT = 1 / 60
FRAMES = 180


def stance(frame):
    """Still for a second and a half, turned by a degree a frame for half of one, still, and moved by 2 mm a frame."""
    angle = np.radians(np.clip(frame - 90, 0, 30))
    away = 0.002 * max(frame - 150, 0)
    rotation = Rotation.from_euler("y", angle).as_quat()[None]
    return replace(STILL, root=np.array([away, 0.0, 0.0]), rotations=rotation)


def play(monkeypatch, holds=None):
    """Frames (T, N, 3) m, the surface's (T, B, 3) m, and in which frames the broad phase was asked for a whole list."""
    garment, x = sheet(13, 13, 0.3, 0.3)
    ball, faces = icosphere(0.1, 3)
    scene = Scene(garment, x + np.array([0.01, 0.104, -0.02]), rigid_body(ball, faces), fabric(), WORN)
    sim = build(scene, PRESETS["draft"], "cpu", STILL)
    asked, find = [], broad_phase.launch_search
    with monkeypatch.context() as patch:
        patch.setattr(broad_phase, "launch_search", lambda *given: (asked.append(len(cloth)), find(*given)))
        if holds is not None:
            patch.setattr(carry_once, "list_holds", holds)
        cloth, surface = [], []
        for k in range(1, FRAMES + 1):
            sim.advance(stance(k), k * DT)
            cloth.append(sim.cloth_positions().astype(np.float64))
            surface.append(sim.body_positions().astype(np.float64))
    return scene, np.array(cloth), np.array(surface), np.array(asked)


@pytest.fixture(scope="module")
def served():
    with pytest.MonkeyPatch.context() as monkeypatch:
        yield play(monkeypatch)


def test_a_body_that_stands_or_turns_as_a_whole_is_searched_seldom(served):
    *_, asked = served
    standing = asked[(asked >= 60) & (asked < 90)]
    turning = asked[(asked >= 90) & (asked < 120)]
    assert len(standing) <= 4, "of 30 steps"
    assert len(turning) <= 20, "of 30: cloth slips on what turns"


def test_no_frame_crosses(served):
    scene, cloth, surface, _ = served
    judge = FrameJudge(scene.garment.faces, scene.body.faces, cloth[0], surface[0])
    assert all(judge.judge(x, c).clean for x, c in zip(cloth, surface))


def test_the_cloth_hangs_as_it_does_when_every_step_searches(served, monkeypatch):
    """While it falls the balls, at which moves end, are others, and so is what each step leaves undone; what hangs in
    the end is the same, to less than the fabric's thickness."""
    _, cloth, _, asked = served
    scene, each, _, always = play(monkeypatch, lambda *_: False)
    assert len(always) >= FRAMES > 2 * len(asked)
    assert np.linalg.norm(cloth[89] - cloth[0], axis=1).max() > 0.05, "it has fallen"
    assert np.linalg.norm(cloth[89] - each[89], axis=1).max() < scene.fabric.thickness
