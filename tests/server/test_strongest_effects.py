"""A worn garment under the strongest effects that their words accept: every frame comes, in bounded work, and free.

What a frame may take is what its budgets say: Newton iterations, searches, and candidates found by them. Before these
were bounded by the list's length, a T-shirt with 1,000 Pa in it had sixteen million candidates and frames of a minute.
"""

from pathlib import Path

import numpy as np
import pytest
from frame_judge import FrameJudge

from tryon_server import demo
from tryon_server.runtime import production
from tryon_server.runtime.order import DrapeOrder
from tryon_solver.effect_words.table import BY_NAME, live
from tryon_solver.stepping import correct, torn
from tryon_solver.stepping.search import CROWDED

DT = 1 / 30
EDGE_LENGTH = 0.03  # m
GROWN = 3  # times CROWDED: a list that is shorter than that is extended once more, by a few edges


def edges(*numbers):
    return [{"panel": panel, "edge": k} for panel in ("front", "back") for k in numbers]


STRONGEST = {
    "pressure": {"pressure": 1000.0, "ramp": 0.0},
    "pressure_in_a_piece": {"pressure": 1000.0, "panels": ["front"]},
    "pressure_less": {"pressure": -200.0, "ramp": 0.0},
    "wind": {"velocity": [0.0, 0.0, 30.0], "density": 10.0, "broadside": 0.22, "shelter": 0.0, "ramp": 0.0},
    "wind_upwards": {"velocity": [0.0, 30.0, 0.0], "broadside": 1.85, "shelter": 0.0, "ramp": 0.0},
    "wind_in_gusts": {"velocity": [9.0, 0.0, 0.0], "gusts": 1.0, "gust_length": 0.1, "ramp": 0.0},
    "gravity_upwards": {"acceleration": [0.0, 50.0, 0.0], "ramp": 0.0},
    "gravity_aside": {"acceleration": [50.0, 0.0, 0.0], "ramp": 0.0},
    "friction": {"body": 2.0, "cloth": 2.0, "presliding": 1e-6},
    "friction_none": {"body": 0.0, "cloth": 0.0, "presliding": 1e-2},
    "strain_limit": {"stiffness": 1e5},
    "air_drag": {"coefficient": 20.0},
    "fabric_damping": {"time": 0.1},
    "adhesion": {"kind": "tape", "strength": 1e5, "work": 100.0, "ramp": 0.0},
    "elastic": {"lines": [{"along": edges(0), "ratio": 0.2, "stiffness": 1000.0}], "ramp": 0.0},
    "creases": {"lines": [{"along": edges(1)[:1], "angle": 160.0}], "ramp": 0.0},
    "fasteners": {
        "rows": [{"first": edges(0)[:1], "second": edges(0)[1:], "buttons": None}],
        "stiffness": 1e5,
        "ramp": 0.0,
    },
    "pins": {"to": "room", "lines": [{"along": edges(0)}], "stiffness": 1e5},
}
BRIEF = ("pressure", "wind")


@pytest.fixture(scope="module")
def worn():
    """A T-shirt, put away."""
    pattern = Path(demo.__path__[0]) / "patterns" / "tshirt.json"
    order = DrapeOrder(pattern, "cotton_jersey", "draft", "cpu", EDGE_LENGTH)
    return production.build_drape(order, lambda *_: None).packed()


@pytest.mark.parametrize("named", [k if k in BRIEF else pytest.param(k, marks=pytest.mark.long) for k in STRONGEST])
def test_every_frame_comes_in_bounded_work_and_nothing_crosses(named, worn, monkeypatch):
    *_, drape = worn.unpacking()
    name = next(name for name in BY_NAME if named == name or named.startswith(f"{name}_"))
    parameters = BY_NAME[name].parameters(STRONGEST[named])
    for _ in drape.effects.rebind({**live(), name: parameters}):
        pass
    sim, settings = drape.simulation, drape.simulation.settings
    searches, search_further = [], correct.search_further

    def counted(*told):
        search_further(*told)
        searches.append(sim.candidates.size)

    monkeypatch.setattr(correct, "search_further", counted)
    most = settings.correction_iterations * (1 + settings.correction_extensions)
    most += settings.second_iterations + torn.ITERATIONS
    rest = drape.cloth_positions().astype(np.float64)
    judge = FrameJudge(sim.scene.garment.faces, sim.scene.body.faces, rest, drape.body_positions())
    for k in range(1, 5 if named in BRIEF else 31):
        searches.clear()
        report = drape.advance(drape.pose, k * DT)
        assert report.time == pytest.approx(drape._dressed_at + k * DT)
        assert report.steps == 1 or report.asleep
        assert report.newton_iterations <= most
        assert len(searches) <= 3 * settings.searches, "of three corrections at most"
        assert max(searches, default=0) < GROWN * CROWDED * sim.cloth_count
        cloth = drape.cloth_positions().astype(np.float64)
        assert judge.judge(cloth, drape.body_positions().astype(np.float64)).clean
    if named in BRIEF:
        assert np.linalg.norm(cloth - rest, axis=1).max() > 0.05, "it acts"
