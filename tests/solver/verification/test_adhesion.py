"""Adhesion: what just holds and what just does not, and a strip's peeling by the work of adhesion times its width."""

import numpy as np
import pytest
import warp as wp
from effect_terms import contribution
from small_scenes import STILL, fabric, rigid_body, sheet, slab, turn

from tryon_solver.contact import pairs
from tryon_solver.scene import Adhesion, AirDrag, BodyContact, FabricDamping, Pins, Pressure, Scene
from tryon_solver.settings import Settings
from tryon_solver.simulation import build
from tryon_solver.stepping.gradient import add_contact_gradient

DT = 1 / 60


FIRM = {"skin_stiffness": 1e4, "skin_hold": 100.0}  # so that the body's surface hardly yields to what sticks to it


def stuck(strength, work):
    """A stiff sheet that sticks to a slab, with a pressure behind it that is none yet."""
    settings = Settings(**FIRM)
    cloth = fabric(areal_density=0.3, k_warp=3e3, k_weft=3e3, k_shear=1e3, k_bend=5e-2)
    garment, x = sheet(7, 7, 0.09, 0.09)
    body, faces = slab(0.2, 0.2, 0.02, 0.04)
    height = settings.body_offset + cloth.thickness / 2 + settings.d_hat - 1.5 * work / strength
    x = x @ turn((0, 17, 0)).T + [0.001, height, 0.002]
    aside = Pins(np.arange(49, dtype=np.int32), strength / 400)  # so weak that they only keep it from drifting aside
    effects = (AirDrag(20.0), BodyContact(), aside, Pressure(0.0), Adhesion(strength, work))
    return x, build(Scene(garment, x, rigid_body(body, faces), cloth, effects), settings, "cpu", STILL)


@pytest.mark.parametrize("y", [-0.05, 0.1, 0.5, 0.8])
def test_traction_follows_the_law(y):
    """Of a flat sheet at a gap: barrier and adhesion together, per area. Before the zone the barrier less its load
    there; from there on 4 S y (1 - y), whatever the barrier has, but for pairs that lie aside, further apart."""
    strength, work = 600.0, 0.4
    width = 1.5 * work / strength
    x, sim = stuck(strength, work)
    moved = x + [0, y * width, 0]
    sim.state.x.assign(np.vstack([moved, sim.body_positions()]).astype(np.float32))
    pairs.collect(sim.pairs, sim.candidates, sim.contact, sim.state.x)
    (term,) = sim.stages.contact
    term.prepare(sim.pairs, sim.state, sim.state.x, sim.state.x)
    gradient = wp.zeros(sim.all_count, dtype=wp.vec3, device="cpu")
    pairs.add_gradient(sim.pairs, sim.state.x, sim.state.x, gradient)
    pushed = -gradient.numpy()[: len(x), 1].sum()
    add_contact_gradient(sim, sim.state.x, sim.state.x, gradient := wp.zeros_like(gradient))
    net = gradient.numpy()[: len(x), 1].sum() / 0.09**2
    assert pushed > 0
    gaps, weights = sim.pairs.gap.numpy()[: sim.pairs.size, 0], -sim.pairs.slope.numpy()[: sim.pairs.size]
    aside = float(weights[gaps > np.median(gaps) + 0.05 * width].sum() / weights.sum())
    assert aside < 0.15
    if y > 0:
        assert net == pytest.approx(4 * strength * y * (1 - y), abs=strength * (aside + 0.01))
    else:
        assert -pushed / 0.09**2 < net < 0
    np.testing.assert_allclose(gradient.numpy().sum(0), 0, atol=1e-4 * strength * 0.09**2)


def pulled_at(sim, load):
    """After a third of a second in which the load [Pa] came on, and as long again."""
    for k in range(40):
        contribution(sim, "pressure").values["pressure"].fill_(load * min(1.0, (k + 1) / 20))
        sim.advance(STILL, sim.state.time + DT)
    return sim


@pytest.mark.parametrize(("strength", "work"), [(40.0, 0.02), pytest.param(600.0, 0.4, marks=pytest.mark.long)])
def test_holds_below_its_strength_and_lets_go_above(strength, work):
    """4 S y (1 - y) = load: pairs are open by w y more than w below d_hat, where they rest; no y for a load above S."""
    width = 1.5 * work / strength
    for share in (0.5, 0.92):
        _, sim = stuck(strength, work)
        gaps = pulled_at(sim, share * strength).pairs.gap.numpy()[: sim.pairs.size, 0]
        assert np.abs(sim.state.v.numpy()).max() < 2e-3
        y = (1 - np.sqrt(1 - share)) / 2
        assert (np.median(gaps) - (Settings().d_hat - width)) / width == pytest.approx(y, rel=0.05)
    x, sim = stuck(strength, work)
    assert (pulled_at(sim, 1.05 * strength).cloth_positions() - x)[:, 1].min() > 0.01


def test_what_dries_lets_go():
    x, sim = stuck(40.0, 0.02)
    assert np.abs(pulled_at(sim, 20.0).cloth_positions() - x).max() < 1e-3
    contribution(sim, "adhesion").values["share"].fill_(0.4)
    assert (pulled_at(sim, 20.0).cloth_positions() - x)[:, 1].min() > 0.01


@pytest.mark.parametrize("work", [0.2, pytest.param(0.3, marks=pytest.mark.long)])
def test_strip_is_peeled_off_at_a_right_angle_by_work_times_width(work):
    """The end is led up and back as fast as it comes loose; its bending goes along unchanged."""
    width, strength, hold, speed, columns = 0.012, 80.0, 50.0, 0.06, 41
    cloth = fabric(areal_density=0.05, k_warp=2e3, k_weft=2e3, k_shear=300.0, k_bend=2e-4)
    garment, x = sheet(columns, 5, 0.12, width)
    body, faces = slab(0.2, 0.06, 0.02, 0.02)
    settings = Settings(d_hat=8e-3, **FIRM)
    x = x + [0, settings.body_offset + cloth.thickness / 2 + settings.d_hat - 1.5 * work / strength, 0.0007]
    end = np.flatnonzero(x[:, 0] > 0.0599).astype(np.int32)
    effects = (AirDrag(1.0), FabricDamping(), BodyContact(), Pins(end, hold), Adhesion(strength, work))
    sim = build(Scene(garment, x, rigid_body(body, faces), cloth, effects), settings, "cpu", STILL)
    places, pulled = contribution(sim, "pins").values["places"], []
    for k in range(75):
        way = speed * (k + 1) * DT
        led = x[end] + [-way, way, 0]
        places.assign(led.astype(np.float32))
        sim.advance(STILL, (k + 1) * DT)
        pulled.append(hold * (led - sim.cloth_positions()[end])[:, 1].sum())
    steady = np.array(pulled[45:])
    assert steady.mean() == pytest.approx(work * width, rel=0.1)


def test_adhesion_is_checked_by_name():
    garment, x = sheet(3, 3, 0.1, 0.1)
    with pytest.raises(ValueError, match="nothing is touched"):
        Scene(garment, x, None, fabric(), (Adhesion(10.0, 1e-3),))
    with pytest.raises(ValueError, match="strength must be a finite number"):
        Adhesion(-1.0, 1e-3)
    body, faces = slab(0.2, 0.2, 0.02, 0.04)
    scene = Scene(garment, x + [0, 0.01, 0], rigid_body(body, faces), fabric(), (BodyContact(), Adhesion(10.0, 1.0)))
    with pytest.raises(ValueError, match=r"lower work to 0\.012 J/m\^2"):
        build(scene, None, "cpu", STILL)
