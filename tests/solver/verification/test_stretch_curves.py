"""Measured stretch curves: a strip that is pulled has the tension of the curve at its strain."""

import numpy as np
import pytest
from effect_terms import contribution
from small_scenes import fabric, sheet

from tryon_solver.scene import AirDrag, Pins, Scene, StretchCurves
from tryon_solver.simulation import build

KNIT = fabric(k_warp=40.0, k_weft=25.0, k_shear=10.0, strain_limit=3.0)
# after tensile tests of jersey: soft as loops straighten, then the yarn's own (N/m)
WARP = ((0.1, 4.0), (0.2, 12.0), (0.3, 40.0))
WEFT = ((0.15, 3.75), (0.3, 12.0))
# a fabric that is several times as stiff as the curve where that begins, and softer than where it ends
FIRM = fabric(k_warp=250.0, k_weft=200.0, k_shear=60.0, strain_limit=3.0)


@pytest.mark.parametrize("own", [KNIT, FIRM], ids=["softer", "stiffer"])
@pytest.mark.parametrize("strain", [0.06, 0.15, 0.28, 0.36])
@pytest.mark.parametrize("along", ["warp", "weft"])
def test_pulled_strip_follows_the_curve(along, strain, own):
    """Tension at the pins over the width against the curve at the strain between them, with no contraction across."""
    points = WARP if along == "warp" else WEFT
    columns, rows = (11, 5) if along == "warp" else (5, 11)
    size = (0.2, 0.05) if along == "warp" else (0.05, 0.2)
    garment, x = sheet(columns, rows, *size)
    axis = 0 if along == "warp" else 2
    ends = np.flatnonzero(np.abs(x[:, axis]) > 0.0999).astype(np.int32)
    hold = 2e3
    sim = build(Scene(garment, x, None, own, (AirDrag(5.0), Pins(ends, hold), StretchCurves(WARP, WEFT))))
    led = x[ends].copy()
    for k in range(60):
        led[:, axis] = x[ends][:, axis] * (1 + strain * min(1.0, (k + 1) / 20))
        contribution(sim, "pins").values["places"].assign(led.astype(np.float32))
        sim.advance(None, (k + 1) / 60)
    hung = sim.cloth_positions().astype(np.float64)
    right = x[ends][:, axis] > 0
    pull = hold * (led - hung[ends])[right, axis].sum() / 0.05
    found = 2 * hung[ends][right, axis].mean() / 0.2 - 1
    assert found == pytest.approx(strain, rel=0.1)
    assert pull == pytest.approx(tension(points, found), rel=5e-3)


def tension(points, strain):
    """By the last slope beyond the last point."""
    s, t = np.array([(0.0, 0.0), *points]).T
    if strain > s[-1]:
        return t[-1] + (t[-1] - t[-2]) / (s[-1] - s[-2]) * (strain - s[-1])
    return np.interp(strain, s, t)


def test_curves_are_checked_by_name():
    with pytest.raises(ValueError, match="warp does not rise to point 1"):
        StretchCurves(warp=((0.1, 5.0), (0.1, 6.0)))
