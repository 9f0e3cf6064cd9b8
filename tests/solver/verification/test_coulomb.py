"""Coulomb friction on an incline: closed forms below and above the threshold."""

from dataclasses import replace

import numpy as np
import pytest
from small_scenes import STILL, fabric, rigid_body, sheet, slab, turn

from tryon_solver.scene import BodyContact, Friction, Gravity, Scene
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build

G, DT = 9.81, 1 / 60
EPS_V = Friction().eps_v


def speeds(mu, degrees, frames, settings, eps_v=EPS_V):
    """Mean speed down the incline after each frame, of a sheet laid on it at rest; shape (frames,) m/s."""
    tilt = turn((0, 0, -degrees))
    garment, x = sheet(6, 6, 0.1, 0.1)
    body, faces = slab(0.8, 0.3, 0.02, 0.05)
    x = (x + np.array([-0.25, 0.003, 0.003])) @ tilt.T
    scene = Scene(
        garment,
        x,
        rigid_body(body @ tilt.T, faces),
        fabric(mu_body=mu, mu_self=mu),
        (Gravity(), BodyContact(), Friction(eps_v)),
    )
    sim = build(scene, settings, "cpu", STILL)
    found = []
    for k in range(frames):
        sim.advance(STILL, (k + 1) * DT)
        found.append((sim.state.v.numpy() @ tilt[:, 0]).mean())
    return np.array(found)


@pytest.mark.parametrize("eps_v", [1e-3, EPS_V])
@pytest.mark.parametrize(("mu", "degrees"), [(0.4, 15), (0.4, 20), (0.6, 28)])
def test_sticks_below_the_threshold(mu, degrees, eps_v):
    """f1(y) = tan/mu: the regularised law creeps at eps_v (1 - sqrt(1 - tan/mu)), well under eps_v, and no faster."""
    share = np.tan(np.radians(degrees)) / mu
    assert share < 1
    v = speeds(mu, degrees, 40, PRESETS["live"], eps_v)[-10:]
    assert v == pytest.approx(np.full(10, eps_v * (1 - np.sqrt(1 - share))), rel=0.05)


SLIDING = [(0.2, 15), (0.4, 23), (0.4, 30), (0.1, 20)]


def check_sliding(mu, degrees, v, first, last, share):
    """a = g (sin - mu cos), to within a share of the friction: implicit Euler with a constant force is exact in v."""
    angle = np.radians(degrees)
    expected = G * (np.sin(angle) - mu * np.cos(angle))
    assert expected > 0.1
    found = (v[last] - v[first]) / ((last - first) * DT)
    assert found == pytest.approx(expected, abs=share * mu * G * np.cos(angle))


@pytest.mark.parametrize(("mu", "degrees"), SLIDING)
def test_slides_above_the_threshold(mu, degrees):
    """With the preset's budget, up to a third of a metre a second: 6 mm a step."""
    v = speeds(mu, degrees, 20, PRESETS["live"])
    check_sliding(mu, degrees, v, 3, int(np.argmax(v > 0.33)) if v.max() > 0.33 else 15, 0.1)


@pytest.mark.parametrize(("mu", "degrees"), SLIDING[2:])
def test_slides_fast_when_converged(mu, degrees):
    """Up to 1.6 m/s, over cells of the body's mesh in every step."""
    settings = replace(PRESETS["live"], correction_iterations=30)
    check_sliding(mu, degrees, speeds(mu, degrees, 40, settings), 3, 39, 0.03)
