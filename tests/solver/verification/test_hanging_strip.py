"""A strip that hangs by its upper end: elongation under its own weight."""

import numpy as np
import pytest
from small_scenes import fabric, sheet

from tryon_solver.scene import AirDrag, Gravity, Pins, Scene, StrainLimit
from tryon_solver.simulation import build

G, LENGTH, DENSITY = 9.81, 0.4, 0.5


def hung(cloth, effects, along_warp):
    """The strip's start (N, 3) and its positions at rest, in metres; y is up."""
    columns, rows = (21, 5) if along_warp else (5, 21)
    width, height = (LENGTH, 0.08) if along_warp else (0.08, LENGTH)
    garment, flat = sheet(columns, rows, width, height)
    u, v = flat[:, 0], -flat[:, 2]
    x = np.column_stack([-v, u, 0 * u]) if along_warp else np.column_stack([u, v, 0 * u])
    top = np.flatnonzero(x[:, 1] > LENGTH / 2 - 1e-6).astype(np.int32)
    sim = build(Scene(garment, x, None, cloth, (Gravity(), AirDrag(2.0), Pins(top, 1e5), *effects)))
    for k in range(120):
        sim.advance(None, (k + 1) / 60)
    assert np.abs(sim.state.v.numpy()).max() < 1e-4
    return x, sim.cloth_positions().astype(np.float64)


@pytest.mark.parametrize(("along_warp", "stiffness"), [(False, 40.0), (False, 150.0), (True, 60.0)])
def test_elongation_under_its_own_weight(along_warp, stiffness):
    """k e(y) = rho g (L - y), so the end sinks by rho g L^2/(2 k); warp along u, weft along v, no lateral contraction.

    Linear elements carry the mean tension of each row exactly: what is left is the pins' own give, rho g L w/k_pin.
    """
    other = 3 * stiffness
    cloth = fabric(
        areal_density=DENSITY,
        k_warp=stiffness if along_warp else other,
        k_weft=other if along_warp else stiffness,
        k_shear=0.4 * stiffness,
        strain_limit=3.0,
        k_bend=1e-6,
    )
    start, rest = hung(cloth, (), along_warp)
    bottom = start[:, 1] < -LENGTH / 2 + 1e-6
    sunk = (start - rest)[bottom, 1]
    expected = DENSITY * G * LENGTH**2 / (2 * stiffness)
    assert expected > 2e-3
    assert sunk.mean() == pytest.approx(expected, rel=2e-3)
    # the profile is a parabola, steepest at the pins
    depth = LENGTH / 2 - start[:, 1]
    profile = DENSITY * G / stiffness * (LENGTH * depth - depth**2 / 2)
    np.testing.assert_allclose((start - rest)[:, 1], profile, rtol=0, atol=0.02 * expected)
    assert np.abs(rest[:, 0] - start[:, 0]).max() < 0.05 * expected


def test_strain_limit_holds_where_the_fabric_alone_would_not():
    """A very soft strip: 24 % at the pins without the limit; with it, what the limit's stiffness lets through.

    Above the limit s the tension T per width obeys T = k (s_y - 1) + k_lim (s_y - s).
    """
    soft, stiff, limit = 8.0, 500.0, 1.1
    cloth = fabric(
        areal_density=DENSITY, k_warp=3 * soft, k_weft=soft, k_shear=0.4 * soft, strain_limit=limit, k_bend=1e-6
    )
    start, rest = hung(cloth, (StrainLimit(stiff),), along_warp=False)
    depth = LENGTH / 2 - start[:, 1]
    tension = DENSITY * G * (LENGTH - np.linspace(0, LENGTH, 4001))
    stretch = np.where(tension < soft * (limit - 1), tension / soft, (tension + stiff * (limit - 1)) / (soft + stiff))
    assert stretch.max() > limit - 1
    sunk = np.cumsum(stretch) * LENGTH / 4001
    expected = np.interp(depth, np.linspace(0, LENGTH, 4001), sunk)
    np.testing.assert_allclose((start - rest)[:, 1], expected, rtol=0, atol=0.01 * expected.max())
