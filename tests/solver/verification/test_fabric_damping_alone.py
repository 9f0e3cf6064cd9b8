"""Fabric damping told apart from the integrator's own: the decay of a stretching and of a bending mode.

By implicit Euler with step h the factor z of a mode (test_oscillation.py) has 1/|z|^2 = 1 + omega^2 h^2 + gamma h. With
gamma = beta omega^2, stiffness-proportional (Rayleigh) damping,

    (1/|z|^2 - 1) = omega^2 h (h + beta):

implicit Euler is itself such a damping, of beta = h. What is measured with beta over what is measured without is
1 + beta/h, whatever omega is, the mesh's own or the continuum's; beta is 2 h here, twice the integrator's. And where
there is no other damping tan(arg z) = omega h, so that 1/|z|^2 - 1 = tan(arg z)^2.

A correction ends when nothing moves by more than TOLERANCE h, which a step's change of the mode, of AMPLITUDE at first,
is wrong by at most: |z| by TOLERANCE h/AMPLITUDE, 1/|z|^2 - 1 by 2/(1 - |z|^2) times that of itself.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from small_scenes import fabric, sheet
from swinging_strip import DENSITY, LENGTH, G, factor_of, motion, motion_of_the_end, strip

from tryon_solver.materials.fabric import FABRICS
from tryon_solver.scene import FabricDamping, Pins, Scene
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build

AMPLITUDE = 4e-3  # m
TOLERANCE = PRESETS["reference"].correction_tolerance  # m/s
TIMES_OWN = 2  # beta over h


def damped_by(time):
    """The effect, or none."""
    return (FabricDamping(time),) if time else ()


def bouncing(time, h, count):
    """|z| and arg z of the lowest stretching mode of a hanging strip."""
    k = 40.0
    cloth = fabric(areal_density=DENSITY, k_warp=120.0, k_weft=k, k_shear=16.0, strain_limit=3.0, k_bend=1e-6)

    def moved(depth):
        hanging = DENSITY * G / k * (LENGTH * depth - 0.5 * depth**2)
        return 0 * depth, hanging + AMPLITUDE * np.sin(0.5 * math.pi * depth / LENGTH)

    sim, end = strip(cloth, damped_by(time), replace(PRESETS["reference"], largest_step=h), moved)
    return factor_of(motion_of_the_end(sim, end, 1, count, h))


def bending(time, h, count):
    """|z| and arg z of the lowest mode of a weightless strip that is clamped at one end. It starts as Euler and
    Bernoulli's cantilever, drawn in by as much as bending shortens it: membrane forces would outweigh the bending's."""
    cloth = fabric(areal_density=DENSITY, k_warp=3e3, k_weft=3e3, k_shear=1e3, strain_limit=3.0, k_bend=0.5)
    garment, flat = sheet(5, 21, 0.08, LENGTH)
    clamped = 0.04  # m
    depth = flat[:, 2] + LENGTH / 2 - clamped
    free = LENGTH - clamped
    fine = np.linspace(0, free, 2001)
    aside = AMPLITUDE * cantilever(fine / free)
    drawn_in = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(aside) ** 2 / np.diff(fine))])
    x = flat + np.column_stack([0 * depth, np.interp(depth, fine, aside), -np.interp(depth, fine, drawn_in)])
    held = np.flatnonzero(depth < 1e-6).astype(np.int32)
    effects = (Pins(held, 1e6), *damped_by(time))
    sim = build(Scene(garment, x, None, cloth, effects), replace(PRESETS["reference"], largest_step=h))
    weights = np.interp(depth, fine, aside)  # the mode itself, which others are at right angles to
    return factor_of(motion(sim, weights / weights.sum(), 1, count, h))


def cantilever(share):
    """Of the lowest mode, from 0 at the clamp, share 0, to 1 at the free end, share 1."""
    root = 1.875104  # of cos x cosh x = -1
    at = root * share
    ratio = (math.cosh(root) + math.cos(root)) / (math.sinh(root) + math.sin(root))
    return 0.5 * (np.cosh(at) - np.cos(at) - ratio * (np.sinh(at) - np.sin(at)))


@pytest.mark.parametrize("h", [1 / 60, 1 / 90, pytest.param(1 / 240, marks=pytest.mark.long)])
@pytest.mark.parametrize("mode", [bouncing, bending])
def test_decay_is_the_integrators_and_the_fabrics(mode, h):
    count = round(0.6 / h)
    own, turned = mode(0.0, h, count)
    damped, _ = mode(TIMES_OWN * h, h, count)
    measured = (damped**-2 - 1) / (own**-2 - 1)
    wrong_own, wrong_damped = (2 * TOLERANCE * h / AMPLITUDE / (1 - size**2) for size in (own, damped))
    print(f"{mode.__name__}, h {h:.5f} s: own {(own**-2 - 1) / math.tan(turned) ** 2:.4f} within {wrong_own:.4f}")
    print(f"with damping over without: {measured:.4f} of {1 + TIMES_OWN}, within {wrong_own + wrong_damped:.4f}")
    assert measured == pytest.approx(1 + TIMES_OWN, rel=wrong_own + wrong_damped)
    assert own**-2 - 1 == pytest.approx(math.tan(turned) ** 2, rel=2 * wrong_own)  # arg z is as wrong as |z|


def spin_after(time, preset, cloth, axis):
    """What a flat sheet that turns at 3 rad/s has of it after 0.5 s [rad/s], by its angular momentum."""
    garment, x = sheet(9, 9, 0.2, 0.2)
    sim = build(Scene(garment, x, None, cloth, damped_by(time)), PRESETS[preset])
    sim.state.v.assign(np.cross(3.0 * axis, x).astype(np.float32))
    for k in range(round(0.5 / PRESETS[preset].largest_step)):
        sim.advance(None, (k + 1) * PRESETS[preset].largest_step)
    y, v = (a.numpy().astype(np.float64) for a in (sim.state.x, sim.state.v))
    momentum = (np.cross(y, v) * sim.mass[:, None]).sum(0) @ axis
    return momentum / (sim.mass * ((x**2).sum(1) - (x @ axis) ** 2)).sum()


@pytest.mark.parametrize("axis", [(0.0, 1.0, 0.0), (1.0, 0.0, 0.0)], ids=["in its plane", "over"])
@pytest.mark.parametrize("cloth", [fabric(), FABRICS["denim"]], ids=["jersey", "denim"])
@pytest.mark.parametrize("preset", ["draft", "live"])
def test_what_turns_as_a_whole_is_not_damped(preset, cloth, axis):
    """By more than the integrator does: a twentieth of a radian a step and more, by three times the usual damping."""
    spins = [spin_after(time, preset, cloth, np.array(axis)) for time in (0.0, 15e-3)]
    assert spins[0] > 2.4
    assert spins[1] == pytest.approx(spins[0], rel=3e-3)
