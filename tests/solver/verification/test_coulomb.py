"""Coulomb friction on an incline: closed forms below and above the threshold."""

from dataclasses import replace

import numpy as np
import pytest
from small_scenes import STILL, fabric, rigid_body, sheet, slab, turn

from tryon_solver.scene import BodyContact, Friction, Gravity, Scene
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build

G, DT = 9.81, 1 / 60


def laid(mu, degrees, settings, friction):
    """A sheet laid on an incline at rest, and the way down."""
    tilt = turn((0, 0, -degrees))
    garment, x = sheet(6, 6, 0.1, 0.1)
    body, faces = slab(0.8, 0.3, 0.02, 0.05)
    x = (x + np.array([-0.25, 0.003, 0.003])) @ tilt.T
    scene = Scene(
        garment,
        x,
        rigid_body(body @ tilt.T, faces),
        fabric(mu_body=mu, mu_self=mu),
        (Gravity(), BodyContact(), friction),
    )
    return build(scene, settings, "cpu", STILL), tilt[:, 0]


def speeds(sim, down, frames):
    """Mean speed down the incline after each frame; shape (frames,) m/s."""
    found = []
    for k in range(frames):
        sim.advance(STILL, (k + 1) * DT)
        found.append((sim.state.v.numpy() @ down).mean())
    return np.array(found)


SLOPES = [(0.4, 15), (0.4, 20), (0.6, 28)]
STICKING = [(*slope, presliding) for presliding in (1e-3, Friction().presliding) for slope in SLOPES]


@pytest.mark.parametrize(
    ("mu", "degrees", "presliding"),
    [
        pytest.param(*case, marks=[] if case[1:] in ((15, Friction().presliding), (28, 1e-3)) else pytest.mark.long)
        for case in STICKING
    ],
)
def test_sticks_below_the_threshold(mu, degrees, presliding):
    """f1(y) = tan/mu: contacts have given by s (1 - sqrt(1 - tan/mu)), and nothing moves: it does not creep."""
    share = np.tan(np.radians(degrees)) / mu
    assert share < 1
    sim, down = laid(mu, degrees, PRESETS["live"], Friction(presliding))
    v = speeds(sim, down, 60)
    assert np.abs(v).max() > 1e-3  # it did settle
    assert np.abs(v[-10:]).max() < 3e-5
    (term,) = sim.stages.contact
    _, given = term.kept()
    assert len(given) > 100
    assert np.median(np.linalg.norm(given, axis=1)) == pytest.approx(presliding * (1 - np.sqrt(1 - share)), rel=0.03)


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
    v = speeds(*laid(mu, degrees, PRESETS["live"], Friction()), 20)
    check_sliding(mu, degrees, v, 3, int(np.argmax(v > 0.33)) if v.max() > 0.33 else 15, 0.1)


@pytest.mark.parametrize(("mu", "degrees"), [pytest.param(*SLIDING[2], marks=pytest.mark.long), SLIDING[3]])
def test_slides_fast_when_converged(mu, degrees):
    """Up to 1.6 m/s, over cells of the body's mesh in every step."""
    settings = replace(PRESETS["live"], correction_iterations=30)
    check_sliding(mu, degrees, speeds(*laid(mu, degrees, settings, Friction()), 40), 3, 39, 0.03)
