"""What no step could do anything with is refused when a spec is made, by name."""

import numpy as np
import pytest
from small_scenes import sheet

from tryon_solver.effect_specs import Attached, Sewing, Sleep
from tryon_solver.scene import AirDrag, FabricDamping, Gravity, Gusts, Pressure, Scene, StrainLimit, StretchCurves, Wind
from tryon_solver.simulation import build

NAN, INF = float("nan"), float("inf")
ENDS = np.array([[0, 1]], np.int32)
ONE = np.zeros(1, np.int32), np.array([[1, 2, 3]], np.int32)


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (lambda: Gravity((0.0, NAN, 0.0)), "gravity: acceleration must be finite"),
        (lambda: Gravity((0.0, INF, 0.0)), "gravity: acceleration must be finite"),
        (lambda: AirDrag(-5.0), "air drag: coefficient must be a finite number of at least 0, not -5.0"),
        (lambda: AirDrag(NAN), "air drag: coefficient"),
        (lambda: Wind((NAN, 0.0, 0.0)), "wind: velocity must be finite"),
        (lambda: Gusts(1e6), "wind: gusts.intensity 1000000.0 is the speed's standard deviation over its mean"),
        (lambda: Gusts(NAN), "wind: gusts.intensity"),
        (lambda: Gusts(seed=-1), "wind: gusts.seed must be a whole number of at least 0, not -1"),
        (lambda: Gusts(0.2, length=0.0), "wind: gusts.length"),
        (lambda: FabricDamping(-1.0), "fabric damping: time"),
        (lambda: StrainLimit(-2e4), "strain limit: stiffness"),
        (lambda: StretchCurves(warp=((INF, 1.0),)), "stretch curves: warp does not rise to point 0"),
        (lambda: Sewing(ENDS, NAN), "sewing: stiffness"),
        (lambda: Attached(*ONE, np.full((1, 3), NAN), 1.0), "attached: weights must be finite"),
        (lambda: Sleep(speed=NAN), "sleep: speed"),
    ],
)
def test_it_is_refused(made, message):
    with pytest.raises(ValueError, match=message):
        made()


@pytest.mark.parametrize(
    "effect",
    [Sewing(np.array([[0, 999]], np.int32), 1.0), Attached(ONE[0], ONE[1] + 997, np.full((1, 3), 1 / 3), 1.0)],
    ids=["sewing", "attached"],
)
def test_a_vertex_that_there_is_not_is_refused_by_its_number(effect):
    garment, x = sheet(4, 4, 0.1, 0.1)
    with pytest.raises(ValueError, match=r"there is no vertex 99\d; the garment has 16"):
        build(Scene(garment, x, None, effects=(effect,)))


def test_any_finite_quantity_is_taken_and_what_steps_can_not_follow_is_told():
    """1e6 Pa on a sheet of jersey, by the report of its first step; nothing that is not a number comes of it."""
    garment, x = sheet(4, 4, 0.1, 0.1)
    sim = build(Scene(garment, x, None, effects=(Pressure(1e6),)))
    report = sim.advance(None, 1 / 60)
    assert np.isfinite(sim.cloth_positions()).all()
    assert report.max_stretch > 2.0 or report.retries > 0
