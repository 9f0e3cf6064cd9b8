"""Many effects in one scene: the cloth penetrates nothing, at any preset, whatever is written while it is worn."""

import numpy as np
import pytest
from effect_terms import contribution
from frame_judge import FrameJudge
from small_scenes import STILL, fabric, icosphere, rigid_body, sheet

from tryon_solver.geometry.lines import line_between
from tryon_solver.scene import (
    WORN,
    Adhesion,
    AirDrag,
    Creases,
    Elastic,
    ElasticLine,
    Fasteners,
    Gusts,
    Pressure,
    Scene,
    StretchCurves,
    Wind,
)
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build

N = 13


@pytest.mark.parametrize("preset", ["draft", pytest.param("live", marks=pytest.mark.long)])
def test_everything_at_once_penetrates_nothing(preset):
    """A square on a ball, creased, drawn in, sticking, blown at and blown up, two corners buttoned together that are
    opened and closed again."""
    garment, x = sheet(N, N, 0.3, 0.3)
    x[:, 1] += 0.085 + 1e-3 * np.cos(25 * x[:, 0])
    ball, faces = icosphere(0.08, 1)
    middle = line_between(garment, N * (N // 2), N * (N // 2) + N - 1)
    hem = line_between(garment, 0, N - 1)
    effects = (
        *(effect for effect in WORN if not isinstance(effect, AirDrag)),
        Wind((2.0, 0.0, 1.0), Gusts(0.3), shelter=0.7),
        Creases(middle, np.full(len(middle), 1.5)),
        Elastic((ElasticLine(hem, 0.6, 15.0),)),
        Adhesion(50.0, 0.02),
        Pressure(0.0),
        StretchCurves(((0.05, 12.5), (0.15, 60.0)), ((0.05, 10.0), (0.15, 60.0))),
        Fasteners(np.array([[0, N * (N - 1)], [N - 1, N * N - 1]], np.int32), 200.0),
    )
    sim = build(Scene(garment, x, rigid_body(ball, faces), fabric(), effects), PRESETS[preset], "cpu", STILL)
    closed = contribution(sim, "fasteners").values["closed"]
    pressure = contribution(sim, "pressure").values["pressure"]
    closed.fill_(0.02)
    judge = FrameJudge(garment.faces, faces, sim.cloth_positions(), sim.body_positions())
    for k in range(24):
        if k == 8:
            closed.zero_()
            pressure.fill_(15.0)
        if k == 16:
            closed.fill_(0.05)
            pressure.fill_(-15.0)
        sim.advance(STILL, (k + 1) / 30)
        if k % 4 == 3:
            verdict = judge.judge(sim.cloth_positions(), sim.body_positions())
            assert verdict.clean, f"frame {k}: {verdict}"
    assert np.abs(sim.cloth_positions() - x).max() > 0.05
