"""A strip that hangs by its upper end: elongation under its own weight."""

import numpy as np
import pytest
from small_scenes import fabric, sheet

from tryon_solver.geometry.garment import Garment
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


@pytest.mark.parametrize(
    ("along_warp", "stiffness"), [(False, 40.0), pytest.param(False, 150.0, marks=pytest.mark.long), (True, 60.0)]
)
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


def test_panels_of_different_fabrics_stretch_by_their_own_stiffness():
    """The upper half ten times as stiff as the lower, which is three times as heavy: each sinks by its own tension."""
    stiff, soft, heavy = 400.0, 40.0, 3.0
    values = {"strain_limit": 3.0, "k_bend": 1e-6}
    upper = fabric(areal_density=DENSITY, k_warp=3 * stiff, k_weft=stiff, k_shear=0.4 * stiff, **values)
    lower = fabric(areal_density=heavy * DENSITY, k_warp=3 * soft, k_weft=soft, k_shear=0.4 * soft, **values)
    garment, flat = sheet(5, 21, 0.08, LENGTH)
    panel = (garment.uv_corners.mean(1)[:, 1] < 0).astype(np.int32)
    halves = Garment(garment.faces, garment.uv_corners, panel, garment.vertex_count)
    x = np.column_stack([flat[:, 0], -flat[:, 2], 0 * flat[:, 0]])
    top = np.flatnonzero(x[:, 1] > LENGTH / 2 - 1e-6).astype(np.int32)
    effects = (Gravity(), AirDrag(2.0), Pins(top, 1e5))
    sim = build(Scene(halves, x, None, upper, effects, panel_fabrics=(upper, lower)))
    for k in range(180):
        sim.advance(None, (k + 1) / 60)
    assert sim.mass.sum() == pytest.approx(0.5 * (1 + heavy) * DENSITY * LENGTH * 0.08)
    sunk = (x - sim.cloth_positions())[:, 1]
    half, load = 0.5 * LENGTH, DENSITY * G
    middle, bottom = (np.abs(x[:, 1] - y) < 1e-6 for y in (0.0, -half))
    first = load * half * (heavy * half + 0.5 * half) / stiff
    assert sunk[middle].mean() == pytest.approx(first, rel=5e-3)
    assert sunk[bottom].mean() == pytest.approx(first + load * heavy * half**2 / (2 * soft), rel=5e-3)


def test_fabrics_of_panels_are_checked():
    garment, x = sheet(3, 3, 0.1, 0.1)
    with pytest.raises(ValueError, match="2 fabrics for 1 panels"):
        Scene(garment, x, None, fabric(), (), panel_fabrics=(fabric(), fabric()))
    with pytest.raises(ValueError, match="thickness of panel 0"):
        Scene(garment, x, None, fabric(), (), panel_fabrics=(fabric(thickness=1e-4),))
