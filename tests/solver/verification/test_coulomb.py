"""Coulomb friction on an incline: closed forms below and above the threshold."""

from dataclasses import replace

import numpy as np
import pytest
from small_scenes import STILL, fabric, rigid_body, sheet, slab, turn

from tryon_solver.geometry.garment import Garment
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.scene import BodyContact, Friction, Gravity, Pins, Scene, SelfContact
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build

G, DT = 9.81, 1 / 60


def laid(mu, degrees, settings, friction, height=0.003):
    """A sheet laid on an incline at rest, `height` m above it, and the way down."""
    tilt = turn((0, 0, -degrees))
    garment, x = sheet(6, 6, 0.1, 0.1)
    body, faces = slab(0.8, 0.3, 0.02, 0.05)
    x = (x + np.array([-0.25, height, 0.003])) @ tilt.T
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


def test_draft_slides_as_coulomb_says_and_an_accuracy_brings_out_what_its_budget_leaves_undone():
    """12 x 12 vertices: after half a second the speed is within 5 % of Coulomb's with the budget alone, in steps of
    1/60 s, and within 3 % in steps of 1/30 s for 0.01 mm, which the budget alone misses by more."""
    angle = np.radians(30)
    expected = G * (np.sin(angle) - 0.3 * np.cos(angle)) / 2
    garment, x = sheet(12, 12, 0.1, 0.1)
    body, faces = slab(2.0, 0.3, 0.02, 0.05)
    x = x + np.array([-0.8, 0.0018, 0.003])
    found = []
    for rate, accuracy in ((30, 1e-5), (30, None), (60, None)):
        effects = (Gravity((0.0, -G, 0.0)), BodyContact(), Friction())
        scene = Scene(garment, x, rigid_body(body, faces), fabric(mu_body=0.3), effects)
        sim = build(scene, replace(PRESETS["draft"], accuracy=accuracy), "cpu", STILL)
        for k in range(rate // 2):
            sim.advance(STILL, (k + 1) / rate)  # it comes to lie
        (gravity,) = (own for own in sim.plan.contributions if own.name == "gravity")
        gravity.values["acceleration"].assign(G * np.array([[np.sin(angle), -np.cos(angle), 0.0]], np.float32))
        for k in range(rate // 2, rate):
            sim.advance(STILL, (k + 1) / rate)
        found.append(float(sim.state.v.numpy()[:, 0].mean()) / expected)
    assert found[0] == pytest.approx(1.0, abs=0.03)
    assert abs(found[1] - 1.0) > 0.03
    assert found[2] == pytest.approx(1.0, abs=0.05)


def test_draft_slides_without_friction_as_inertia_says():
    """Silk, 18 steps of 1/30 s down 30 degrees, at the end of which it goes 10 cm in one: of eight starts a micrometre
    apart those in the middle end within 3 % of the speed that it should have, and none was ever faster. One of eight
    may lose much of its speed in one step (METHOD.md, section 15)."""
    down = np.radians(30)
    garment, x = sheet(9, 9, 0.1, 0.1)
    body, faces = slab(4.0, 0.4, 0.02, 0.05)
    effects = (Gravity((G * np.sin(down), -G * np.cos(down), 0.0)), BodyContact())
    ends = []
    for start in range(8):
        apart = 1e-6 * np.random.default_rng(start).standard_normal(x.shape)
        silk = FABRICS["silk_charmeuse"]
        scene = Scene(garment, x + [-1.8, 0.0022, 0.003] + apart, rigid_body(body, faces), silk, effects)
        sim = build(scene, PRESETS["draft"], "cpu", STILL)
        v = []
        for k in range(18):
            sim.advance(STILL, (k + 1) / 30)
            v.append(float(sim.state.v.numpy()[: sim.cloth_count, 0].mean()))
        expected = G * np.sin(down) * np.arange(1, 19) / 30
        assert (v < 1.05 * expected).all()
        ends.append(v[-1])
    assert np.median(ends) == pytest.approx(expected[-1], rel=0.03)


@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_cloth_slides_on_cloth_as_on_a_body(mu):
    """A sheet down another one that is pinned at every vertex, 30 degrees, two thirds of a second at `live`."""
    down = np.radians(30)
    beneath, lower = sheet(31, 9, 1.2, 0.34)
    above, upper = sheet(7, 7, 0.1, 0.1)
    n = beneath.vertex_count
    garment = Garment(
        np.vstack([beneath.faces, above.faces + n]),
        np.vstack([beneath.uv_corners, above.uv_corners]),
        np.repeat([0, 1], [len(beneath.faces), len(above.faces)]).astype(np.int32),
        n + above.vertex_count,
    )
    x = np.vstack([lower, upper + [-0.4, 0.0025, 0.007]])
    table = np.full((3, 3), mu)
    effects = [Gravity((G * np.sin(down), -G * np.cos(down), 0.0)), SelfContact(), Pins(np.arange(n, dtype=np.int32))]
    effects += [Friction(static=table, kinetic=table)] if mu else []
    sim = build(Scene(garment, x, None, fabric(), tuple(effects)), PRESETS["live"])
    for k in range(40):
        sim.advance(None, (k + 1) * DT)
    v = float(sim.state.v.numpy()[n:, 0].mean())
    assert v == pytest.approx(G * (np.sin(down) - mu * np.cos(down)) * 40 * DT, rel=0.02)


@pytest.mark.parametrize(("mu", "degrees"), SLIDING)
def test_slides_above_the_threshold(mu, degrees):
    """With the preset's budget, up to a third of a metre a second: 6 mm a step."""
    v = speeds(*laid(mu, degrees, PRESETS["live"], Friction()), 20)
    check_sliding(mu, degrees, v, 3, int(np.argmax(v > 0.33)) if v.max() > 0.33 else 15, 0.03)


@pytest.mark.parametrize(("mu", "degrees"), SLIDING[2:])
def test_slides_fast_with_the_presets_budget(mu, degrees):
    """Up to 0.9 and 1.6 m/s, over the edges of the body's mesh, which lie ahead in every step and are passed by."""
    v = speeds(*laid(mu, degrees, PRESETS["live"], Friction()), 40)
    assert v[-1] > 0.9
    check_sliding(mu, degrees, v, 3, 39, 0.03)


@pytest.mark.parametrize("preset", ["draft", "live"])
def test_nothing_holds_cloth_that_slides_without_friction(preset):
    """Over cells of the body's mesh, up to 1.7 m/s: by nothing but its weight, g sin."""
    tilt = turn((0, 0, -30))
    garment, x = sheet(6, 6, 0.1, 0.1)
    body, faces = slab(0.8, 0.3, 0.02, 0.05)
    x = (x + np.array([-0.3, 0.003, 0.003])) @ tilt.T
    scene = Scene(garment, x, rigid_body(body @ tilt.T, faces), fabric(), (Gravity(), BodyContact()))
    v = speeds(build(scene, PRESETS[preset], "cpu", STILL), tilt[:, 0], 20)
    assert v[-1] == pytest.approx(G * np.sin(np.radians(30)) * 20 * DT, rel=0.03)


@pytest.mark.parametrize(("preset", "fps"), [("draft", 30), ("draft", 60), ("live", 60)])
def test_nothing_brakes_cloth_that_turns_without_friction(preset, fps):
    """A sheet of 24 cm on a level floor, once round in two seconds: of its turn implicit Euler takes (w dt)^2 a step,
    and what the budget leaves undone across the floor hardly more. With the best common move alone `draft` had a
    twentieth of it left after twelve frames of 1/30 s."""
    garment, x = sheet(13, 13, 0.24, 0.24)
    body, faces = slab(0.8, 0.8, 0.02, 0.05)
    x = x - x.mean(0) + [0.0, 0.0022, 0.0]
    scene = Scene(garment, x, rigid_body(body, faces), FABRICS["cotton_jersey"], (Gravity(), BodyContact()))
    sim = build(scene, PRESETS[preset], "cpu", STILL)
    v = sim.state.v.numpy()
    v[: len(x)] = np.cross([0.0, 3.0, 0.0], x)
    sim.state.v.assign(v)
    expected = 3.0
    for k in range(12):
        sim.advance(STILL, (k + 1) / fps)
        expected /= 1 + (expected / fps) ** 2
    r = sim.cloth_positions().astype(np.float64)
    r -= r.mean(0)
    v = sim.state.v.numpy()[: len(x)].astype(np.float64)
    around = np.cross(r, v - v.mean(0))[:, 1].sum() / (r[:, [0, 2]] ** 2).sum()
    assert around == pytest.approx(expected, rel=0.12)


@pytest.mark.parametrize(
    ("preset", "name", "fps", "frames", "share"),
    [
        ("live", "silk_charmeuse", 60, 30, 0.01),
        ("draft", "denim", 30, 8, 0.2),
        ("draft", "cotton_jersey", 30, 8, 0.2),
        ("draft", "silk_charmeuse", 30, 8, 0.2),
    ],
)
def test_cloth_of_the_shop_slides_as_it_weighs(preset, name, fps, frames, share):
    """Half a second down 30 degrees over cells of 5 cm, at draft to 1.3 m/s, with itself in contact: what lay ahead is
    passed by at less than a tenth of how far it was, and what the budget leaves across the slope takes nothing from
    along it. At draft the first frame, from rest in contact, ends near and short."""
    tilt = turn((0, 0, -30))
    garment, x = sheet(9, 9, 0.1, 0.1)
    body, faces = slab(2.4, 0.3, 0.02, 0.05)
    x = (x + np.array([-0.9, 0.0018, 0.003])) @ tilt.T
    effects = (Gravity(), BodyContact(), SelfContact())
    scene = Scene(garment, x, rigid_body(body @ tilt.T, faces), FABRICS[name], effects)
    sim = build(scene, PRESETS[preset], "cpu", STILL)
    v = [0.0]
    for k in range(frames):
        sim.advance(STILL, (k + 1) / fps)
        v.append(float((sim.state.v.numpy()[: sim.cloth_count].astype(float) @ tilt[:, 0]).mean()))
    assert np.diff(v).min() > -1e-3, "nothing stops it"
    assert v[-1] == pytest.approx(G * np.sin(np.radians(30)) * frames / fps, rel=share)


def test_what_falls_beside_a_light_sheet_does_not_throw_it_up():
    """A second down 10 degrees without friction at draft. The vertices that lie where they belong stay there while
    others land: pushed up with these, the sheet was thrown about and came 0.30 m far, of 0.85. How each lands is
    chance: of starts that differ by less than float32 tells one in four comes 0.6 to 0.8 of it, so the middle counts.
    """
    tilt = turn((0, 0, -10))
    garment, flat = sheet(13, 13, 0.6, 0.6)
    body, faces = slab(4.4, 1.0, 0.02, 0.05)
    flat = (flat + np.array([-1.6, 0.0018, 0.003])) @ tilt.T
    effects = (Gravity(), BodyContact(), SelfContact())
    ways, heights = [], []
    for start in range(5):
        x = flat + np.random.default_rng(start).normal(scale=1e-7, size=flat.shape)
        scene = Scene(garment, x, rigid_body(body @ tilt.T, faces), FABRICS["silk_charmeuse"], effects)
        sim = build(scene, PRESETS["draft"], "cpu", STILL)
        higher = []
        for k in range(24):
            sim.advance(STILL, (k + 1) / 30)
            higher.append(np.ptp((sim.cloth_positions() @ tilt[:, 1]).astype(float)))
        ways.append(((sim.cloth_positions() - x) @ tilt[:, 0]).mean())
        heights.append(max(higher[3:]))
    assert np.median(ways) == pytest.approx(0.5 * G * np.sin(np.radians(10)) * 0.8**2, rel=0.15)
    assert np.median(heights) < 6e-3, "a hundredth of its width"


@pytest.mark.parametrize(("mu", "degrees"), [pytest.param(*SLIDING[2], marks=pytest.mark.long), SLIDING[3]])
def test_slides_fast_when_converged(mu, degrees):
    """Up to 1.6 m/s, over cells of the body's mesh in every step."""
    settings = replace(PRESETS["live"], correction_iterations=30)
    check_sliding(mu, degrees, speeds(*laid(mu, degrees, settings, Friction()), 40), 3, 39, 0.03)


def test_what_sticks_by_the_static_coefficient_slides_by_the_kinetic_one():
    """tan 20 degrees is 0.36: between mu_k 0.2 and mu 0.5 it rests; pushed off at 0.2 m/s, it accelerates by mu_k."""
    table = Friction(static=np.array([[0.3, 0.5], [0.5, 0.0]]), kinetic=np.array([[0.3, 0.2], [0.2, 0.0]]))
    sim, down = laid(0.9, 20, PRESETS["live"], table, 3.767e-3)  # where the barrier carries it; its own mu is not asked
    v = speeds(sim, down, 40)
    assert np.abs(v[-5:]).max() < 3e-4
    sim.state.v.assign(np.tile(0.2 * down, (36, 1)).astype(np.float32))
    found = []
    for k in range(40, 52):
        sim.advance(STILL, (k + 1) * DT)
        found.append((sim.state.v.numpy() @ down).mean())
    check_sliding(0.2, 20, np.array(found), 3, int(np.argmax(np.array(found) > 0.33)) or 11, 0.1)


def test_panels_of_other_materials_have_their_own_coefficients():
    """Two sheets side by side on one incline: one slides as if it were alone, the other stays."""
    tilt = turn((0, 0, -20))
    garment, x = sheet(6, 6, 0.1, 0.1)
    faces = np.vstack([garment.faces, garment.faces + 36])
    both = Garment(faces, np.vstack([garment.uv_corners] * 2), np.repeat([0, 1], len(garment.faces)), 72)
    x = np.vstack([x + [-0.25, 0.003, z] for z in (-0.053, 0.057)]) @ tilt.T
    body, body_faces = slab(0.8, 0.3, 0.02, 0.05)
    table = np.array([[0.0, 0.0, 0.6], [0.0, 0.0, 0.1], [0.6, 0.1, 0.0]])
    effects = (Gravity(), BodyContact(), Friction(static=table))
    sim = build(Scene(both, x, rigid_body(body @ tilt.T, body_faces), fabric(), effects), PRESETS["live"], "cpu", STILL)
    found = []
    for k in range(14):
        sim.advance(STILL, (k + 1) * DT)
        found.append((sim.state.v.numpy() @ tilt[:, 0]).reshape(2, 36).mean(axis=1))
    stays, slides = np.array(found).T
    assert np.abs(stays[-4:]).max() < 3e-3
    check_sliding(0.1, 20, slides, 3, int(np.argmax(slides > 0.33)) or 13, 0.1)


def test_friction_is_checked_by_name():
    with pytest.raises(ValueError, match=r"more than what sticks at \[0, 1\]"):
        Friction(static=np.full((2, 2), 0.2), kinetic=np.array([[0.1, 0.3], [0.3, 0.1]]))
    with pytest.raises(ValueError, match="static must be symmetric"):
        Friction(static=np.array([[0.1, 0.2], [0.3, 0.1]]))
    garment, x = sheet(3, 3, 0.1, 0.1)
    with pytest.raises(ValueError, match="static is for 3 materials; the garment has 1 panels"):
        Scene(garment, x, None, fabric(), (Friction(static=np.zeros((3, 3))),))
