"""A hanging strip that bounces and swings: periods and decays against closed forms, with and without damping.

A mode x'' + gamma x' + omega^2 x = 0, gamma = beta omega^2 from fabric damping and c/rho from air drag, becomes by
implicit Euler with step h (1 + gamma h + omega^2 h^2) z^2 - (2 + gamma h) z + 1 = 0 for the factor z of a step:

    |z| = (1 + gamma h + omega^2 h^2)^(-1/2),   cos(arg z) = (1 + gamma h/2) |z|.
"""

import math

import numpy as np
import pytest
from scipy.special import j0, jn_zeros
from small_scenes import fabric
from swinging_strip import DENSITY, LENGTH, G, factor_of, motion_of_the_end, strip

from tryon_solver.scene import AirDrag, FabricDamping
from tryon_solver.settings import Settings


def expected(omega, gamma, dt):
    size = (1 + gamma * dt + (omega * dt) ** 2) ** -0.5
    return size, math.acos((1 + 0.5 * gamma * dt) * size)


def gamma_of(effects, omega):
    beta = sum(e.time for e in effects if isinstance(e, FabricDamping))
    drag = sum(e.coefficient for e in effects if isinstance(e, AirDrag))
    return beta * omega**2 + drag / DENSITY


BOUNCES = [(), (FabricDamping(2e-3),), (FabricDamping(6e-3),), (AirDrag(4.0),), (FabricDamping(2e-3), AirDrag(4.0))]


# of the whole matrix the short run has what is neither damped nor dragged, by both steps, and what is both
QUICK_BOUNCES = {(1e-3, ()), (1 / 60, ()), (1 / 60, BOUNCES[-1])}


@pytest.mark.parametrize(
    ("effects", "largest_step"),
    [
        pytest.param(effects, step, marks=[] if (step, effects) in QUICK_BOUNCES else pytest.mark.long)
        for effects in BOUNCES
        for step in (1e-3, 1 / 60)
    ],
)
def test_bouncing(effects, largest_step):
    """omega = pi/(2 L) sqrt(k/rho), the lowest mode sin(pi y/(2 L)) about the hanging profile; by steps as long as the
    settings allow, and much shorter ones."""
    k, dt = 40.0, 1e-3
    cloth = fabric(areal_density=DENSITY, k_warp=120.0, k_weft=k, k_shear=16.0, strain_limit=3.0, k_bend=1e-6)
    omega = 0.5 * math.pi / LENGTH * math.sqrt(k / DENSITY)

    def moved(depth):
        hanging = DENSITY * G / k * (LENGTH * depth - 0.5 * depth**2)
        return 0 * depth, hanging + 4e-3 * np.sin(0.5 * math.pi * depth / LENGTH)

    sim, bottom = strip(cloth, effects, Settings(largest_step=largest_step), moved)
    size, angle = factor_of(motion_of_the_end(sim, bottom, 1, 400, dt))
    wanted, turned = expected(omega, gamma_of(effects, omega), dt)
    print(f"period {2 * math.pi * dt / angle:.5f} s of {2 * math.pi / omega:.5f}")
    print(f"decay {-math.log(size) / dt:.3f}/s of {-math.log(wanted) / dt:.3f}")
    assert angle == pytest.approx(turned, rel=0.01)
    assert 2 * math.pi * dt / angle == pytest.approx(2 * math.pi / omega, rel=0.02)
    assert math.log(size) == pytest.approx(math.log(wanted), rel=0.05)


@pytest.mark.parametrize(
    "effects",
    [
        pytest.param((), marks=pytest.mark.long),
        pytest.param((FabricDamping(6e-3),), marks=pytest.mark.long),
        (AirDrag(0.5),),
    ],
)
def test_swinging(effects):
    """omega = j/2 sqrt(g/L), j = 2.4048 the first zero of J_0: a heavy chain's lowest mode J_0(j sqrt(y/L)), y from its
    free end. Fabric damping has no part in it: nothing is strained. Air drag has, as in every mode."""
    dt = 1 / 240
    cloth = fabric(areal_density=DENSITY, k_warp=3e3, k_weft=3e3, k_shear=1e3, strain_limit=3.0, k_bend=1e-7)
    omega = 0.5 * jn_zeros(0, 1)[0] * math.sqrt(G / LENGTH)

    def moved(depth):
        stretch = DENSITY * G / 3e3 * (LENGTH * depth - 0.5 * depth**2)
        shape = j0(jn_zeros(0, 1)[0] * np.sqrt(np.maximum(1 - depth / LENGTH, 0)))
        return 5e-3 * shape, stretch

    sim, bottom = strip(cloth, effects, Settings(largest_step=dt), moved)
    size, angle = factor_of(motion_of_the_end(sim, bottom, 2, 240, dt))
    drag = sum(e.coefficient for e in effects if isinstance(e, AirDrag))
    wanted, turned = expected(omega, drag / DENSITY, dt)
    print(f"period {2 * math.pi * dt / angle:.5f} s of {2 * math.pi / omega:.5f}")
    print(f"decay {-math.log(size) / dt:.4f}/s of {-math.log(wanted) / dt:.4f}")
    assert angle == pytest.approx(turned, rel=0.01)
    assert 2 * math.pi * dt / angle == pytest.approx(2 * math.pi / omega, rel=0.02)
    assert math.log(size) == pytest.approx(math.log(wanted), rel=0.1)
