"""The barrier and the mollifier against IPC Toolkit and against closed forms in higher precision."""

import ipctk
import numpy as np
import pytest
from contact_probes import solver_barrier, solver_mollifier

G_HAT = 2e-3
ORACLE = ipctk.ClampedLogBarrier()


@pytest.fixture
def gaps():
    """From a millionth of the reach to just short of it, as the float32 values the device gets."""
    share = np.concatenate([np.logspace(-6, -1, 400), np.linspace(0.1, 0.999, 400)])
    return (share * G_HAT).astype(np.float32).astype(np.float64)


def closed_forms(g, g_hat):
    """b, b', b'' as in the module's docstring, in extended precision."""
    g, g_hat = np.longdouble(g), np.longdouble(np.float32(g_hat))
    log, reach = np.log(g / g_hat), g - g_hat
    return np.stack(
        [-(reach**2) * log, -2 * reach * log - reach**2 / g, -2 * log - 4 * reach / g + (reach / g) ** 2], axis=1
    )


def test_value_and_derivatives_are_the_oracles(gaps):
    g_hat = float(np.float32(G_HAT))
    parts = (ORACLE, ORACLE.first_derivative, ORACLE.second_derivative)
    expected = np.array([[part(g, g_hat) for part in parts] for g in gaps])
    np.testing.assert_allclose(closed_forms(gaps, G_HAT).astype(float), expected, rtol=1e-9, atol=1e-18)
    found = solver_barrier(gaps, G_HAT)
    assert (found[:, 0] > 0).all()
    assert (found[:, 1] < 0).all()
    assert (found[:, 2] > 0).all()
    # one rounding of g/g_hat near 1 is an absolute error of the logarithm; everything else is relative
    ends = np.array([G_HAT**2, G_HAT, 1.0])
    for k in range(3):
        np.testing.assert_allclose(found[:, k], expected[:, k], rtol=1e-5, atol=2e-7 * ends[k])


def test_derivatives_are_those_of_the_value(gaps):
    """The closed forms differentiate into each other, so a wrong formula can't hide in the oracle's convention."""
    g = np.longdouble(gaps)
    step = g * 1e-6
    value = closed_forms(g, G_HAT)
    slope = (closed_forms(g + step, G_HAT) - closed_forms(g - step, G_HAT)) / (2 * step)[:, None]
    np.testing.assert_allclose(slope[:, 0].astype(float), value[:, 1].astype(float), rtol=1e-5, atol=1e-12)
    np.testing.assert_allclose(slope[:, 1].astype(float), value[:, 2].astype(float), rtol=1e-5, atol=1e-9)


def test_silent_beyond_its_reach():
    found = solver_barrier(np.array([G_HAT, 1.0001 * G_HAT, 1.0, 1e30]), G_HAT)
    assert not found.any()


def test_grows_without_bound_and_joins_smoothly():
    found = solver_barrier(np.array([1e-12, 1e-9, 1e-6, 0.9999 * G_HAT]), G_HAT)
    assert (np.diff(found[:, 0]) < 0).all()
    assert found[0, 1] < -1e5 * G_HAT
    np.testing.assert_allclose(found[-1] / [G_HAT**2, G_HAT, 1.0], 0, atol=1e-3)


def test_its_force_grows_on_below_the_floor():
    """By the tangent at the floor, through zero and beyond; above it nothing changes."""
    floor = 0.03 * G_HAT
    above = np.array([floor, 1.5 * floor, 0.5 * G_HAT])
    np.testing.assert_array_equal(solver_barrier(above, G_HAT, floor), solver_barrier(above, G_HAT))
    under = np.array([0.999 * floor, 0.5 * floor, 0.0, -floor, -20 * floor])
    b, slope, curvature = closed_forms(np.array([floor]), G_HAT)[0].astype(float)
    off = under - floor
    found = solver_barrier(under, G_HAT, floor)
    np.testing.assert_allclose(found[:, 0], b + slope * off + 0.5 * curvature * off**2, rtol=1e-5)
    np.testing.assert_allclose(found[:, 1], slope + curvature * off, rtol=1e-5)
    np.testing.assert_allclose(found[:, 2], curvature, rtol=1e-5)


def test_mollifier_is_the_oracles(rng):
    """Edges of 2 cm at angles around the threshold, sin^2 = 1e-3."""
    first, second = rng.standard_normal((2, 300, 3))
    angle = np.logspace(-4, 0, 300)
    u = first / np.linalg.norm(first, axis=1, keepdims=True)
    w = np.cross(u, second)
    w /= np.linalg.norm(w, axis=1, keepdims=True)
    a, b = 0.02 * u, 0.02 * (np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * w)
    origin, apart = np.zeros(3), np.array([1e-3, 2e-3, 3e-3])
    eps = 1e-3 * 0.02**4
    expected = np.array([ipctk.edge_edge_mollifier(origin, ea, apart, apart + eb, eps) for ea, eb in zip(a, b)])
    c = (np.cross(a, b) ** 2).sum(1)
    assert (expected == 1).any()
    assert (expected < 1e-3).any()
    np.testing.assert_allclose(solver_mollifier(c, eps), expected, rtol=1e-5, atol=1e-7)
    rest = ipctk.edge_edge_mollifier_threshold(origin, a[0], apart, apart + b[0])
    assert rest == pytest.approx(eps, rel=1e-6)
