"""Adhesion: what just holds and what just does not, and a strip's peeling by the work of adhesion times its width."""

from itertools import pairwise

import numpy as np
import pytest
import warp as wp
from effect_terms import contribution
from small_scenes import STILL, fabric, rigid_body, sheet, slab, turn

from tryon_solver.contact import pairs
from tryon_solver.geometry.garment import Garment
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.scene import (
    WORN,
    Adhesion,
    AirDrag,
    BodyContact,
    FabricDamping,
    Gravity,
    Pins,
    Pressure,
    Scene,
    SelfContact,
)
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
    effects = (AirDrag(20.0), BodyContact(), aside, Pressure(0.0), Adhesion(strength, work, shear=0.0))
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
    pairs.add_gradient(sim.pairs, sim.state.x, sim.state.x, gradient, sim.sums)
    sim.sums.settle(gradient)
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


def sheared(acceleration, shear, **values):
    """A sheet on a slab that is all sticky, drawn along it by `acceleration`: positions after each of 30 steps."""
    strength, work = 40.0, 0.02
    settings = Settings(**FIRM)
    cloth = fabric(areal_density=0.3, k_warp=3e3, k_weft=3e3, k_shear=1e3, k_bend=5e-2)
    garment, x = sheet(7, 7, 0.09, 0.09)
    body, faces = slab(0.7, 0.2, 0.02, 0.04)
    height = settings.body_offset + cloth.thickness / 2 + settings.d_hat - 1.5 * work / strength
    x = x @ turn((0, 17, 0)).T + [-0.2, height, 0.002]
    effects = (Gravity((acceleration, 0.0, 0.0)), BodyContact(), Adhesion(strength, work, shear=shear, **values))
    sim = build(Scene(garment, x, rigid_body(body, faces), cloth, effects), settings, "cpu", STILL)
    found = [x]
    for k in range(30):
        sim.advance(STILL, (k + 1) * DT)
        found.append(sim.cloth_positions().astype(np.float64))
    return np.array(found)


def test_plate_carries_shear_strength_times_area_and_slips_above():
    """Gravity along the plate. Below T area the sheet gives by f1's share of the presliding, s (1 - sqrt(1 - load/T)),
    and stays; above, what is left of the load accelerates it: a - T/sigma. Pairs that lie aside count for little: all
    together have up to 8 % less than the sheet's area."""
    shear, sigma = 3.0, 0.3
    held = sheared(0.8 * shear / sigma, shear)
    given = (held - held[0])[..., 0]
    for carrying in (0.92, 1.0):
        edge = 1e-4 * (1 - np.sqrt(1 - 0.8 / carrying))
        assert np.sign(given[-1].mean() - edge) == (1 if carrying == 1.0 else -1)
    assert abs(given[-1].mean() - given[-10].mean()) < 1e-7
    assert np.abs(given[-1] - given[-10]).max() < 5e-7, "a vertex moves by rounding, 0.1 um a step"
    slipping = sheared(1.2 * shear / sigma, shear)
    v = np.diff(slipping[..., 0].mean(axis=1)) / DT
    assert (v[15] - v[2]) / (13 * DT) == pytest.approx(0.24 * shear / sigma, abs=0.041 * shear / sigma)
    free = sheared(0.1 * shear / sigma, 0.0)
    assert (free - free[0])[-1, :, 0].mean() > 0.5 * 0.05 * shear / sigma * 0.5**2


def test_lap_joint_holds_its_overlap_times_the_shear_strength():
    """The end of one of two strips is drawn away slowly: the pull rises to T times the overlap, and falls as that gets
    shorter. Vertices count with all the area around them, whose triangles touch in part: a cell more, at the most."""
    shear, cell, length, width, lap, hold = 400.0, 0.01, 0.1, 0.03, 0.055, 500.0
    cloth = fabric(areal_density=0.3, k_warp=5e3, k_weft=5e3, k_shear=1e3, k_bend=1e-3)
    garment, x = sheet(11, 4, length, width)
    count = len(x)
    both = Garment(
        np.vstack([garment.faces, garment.faces + count]),
        np.vstack([garment.uv_corners] * 2),
        np.repeat(np.arange(2, dtype=np.int32), len(garment.faces)),
        2 * count,
    )
    strength, work = 100.0, 0.05
    height = cloth.thickness + Settings().d_hat - 1.5 * work / strength
    x = np.vstack([x, x + [length - lap, height, 2e-4]])
    first = np.flatnonzero(x[:count, 0] < -length / 2 + 1e-6)
    last = count + np.flatnonzero(x[count:, 0] > x[count:, 0].max() - 1e-6)
    ends = Pins(np.concatenate([first, last]).astype(np.int32), hold)
    effects = (AirDrag(5.0), SelfContact(), ends, Adhesion(strength, work, shear=shear))
    sim = build(Scene(both, x, None, cloth, effects))
    places, pulled = contribution(sim, "pins").values["places"], []
    led = x[ends.vertices]
    for k in range(60):
        led[len(first) :, 0] += 1.5e-4
        places.assign(led.astype(np.float32))
        sim.advance(None, (k + 1) * DT)
        pulled.append(hold * (led - sim.cloth_positions()[ends.vertices])[len(first) :, 0].sum())
    shifted = sim.cloth_positions()[last, 0].mean() - x[last, 0].mean()
    assert shifted > cell / 2
    for overlap, force in ((lap, np.max(pulled)), (lap - shifted, pulled[-1])):
        assert 0.97 * overlap < force / (shear * width) < overlap + cell


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
    effects = (AirDrag(1.0), FabricDamping(), BodyContact(), Pins(end, hold), Adhesion(strength, work, shear=0.0))
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


def test_sideways_it_holds_as_much_as_the_fabric_bears_unless_it_is_told():
    """Twice 400 N/m at 10 %, 40 N/m, on a row of cells of 1 cm."""
    cloth = fabric(k_warp=400.0, k_weft=300.0, strain_limit=1.1)
    garment, x = sheet(11, 11, 0.1, 0.1)
    scene = Scene(garment, x, None, cloth, (SelfContact(),))
    borne = 2.0 * 40.0 / garment.mean_edge_length()
    assert 6000.0 < borne < 8000.0
    assert Adhesion(1000.0, 1.0).shear_in(scene) == 1000.0
    assert Adhesion(1e5, 1.0).shear_in(scene) == pytest.approx(borne)
    assert Adhesion(1e5, 1.0, shear=1e5).shear_in(scene) == 1e5


def test_what_pulls_harder_than_a_step_can_follow_does_not_stand_still():
    """Tape that acts at once on denim 1.5 mm above it: half a metre in a step of 1/60 s. No two steps in a row are
    void, which all that follow would be then."""
    denim = FABRICS["denim"]
    garment, x = sheet(9, 9, 0.06, 0.06)
    body, faces = slab(0.2, 0.2, 0.02, 0.02)
    x = x @ turn((0, 13, 0)).T + [0.001, Settings().body_offset + denim.thickness / 2 + 1.5e-3, 0.0021]
    scene = Scene(garment, x, rigid_body(body, faces), denim, (*WORN, Adhesion(1000.0, 1.0)))
    sim = build(scene, Settings(), "cpu", STILL)
    void = [sim.advance(STILL, (k + 1) * DT).retries for k in range(4)]
    assert not any(before and after for before, after in pairwise(void))
    assert np.abs(sim.cloth_positions() - x).max() > 1e-4


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
