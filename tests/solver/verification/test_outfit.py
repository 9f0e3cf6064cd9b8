"""Several garments in one scene: each keeps its thickness, its friction and its way; one alone is as it was."""

from dataclasses import replace

import numpy as np
import pytest
from reference_distances import all_stencils, stencil_distances
from small_scenes import STILL, fabric, rigid_body, sheet, slab, turn

from tryon_solver.contact import pairs
from tryon_solver.dressing.change_outfit import without
from tryon_solver.dressing.outfit import Outfit, Worn, WornOutfit
from tryon_solver.geometry.outfit import garments_of, put_together
from tryon_solver.materials.fabric import between_fabrics
from tryon_solver.scene import (
    WORN,
    AirDrag,
    BodyContact,
    Friction,
    Gravity,
    Pins,
    Scene,
    SelfContact,
)
from tryon_solver.settings import PRESETS, Settings
from tryon_solver.simulation import build
from tryon_solver.stepping.search import search_around
from tryon_solver.subspace.basis import basis_by_edges

G, DT = 9.81, 1 / 60
THIN, THICK = fabric(name="thin", thickness=0.4e-3), fabric(name="thick", thickness=1.6e-3, areal_density=0.4)
BETWEEN = 0.5 * (THIN.thickness + THICK.thickness)  # m, offset of the two from each other


def worn(name, cloth, columns=6, size=0.1):
    """A square sheet under that name, and where it lies, y = 0."""
    garment, x = sheet(columns, columns, size, size)
    return Worn(name, garment, cloth, ("all",)), x


def two(apart, size=(0.1, 0.1), columns=(6, 6)):
    """A thin sheet and a thick one so far above it [m]."""
    lower, below = worn("lower", THIN, columns[0], size[0])
    upper, above = worn("upper", THICK, columns[1], size[1])
    return Outfit((lower, upper)), np.vstack([below, above + [0.0013, apart, 0.0007]])


def distance(sim, one, other):
    """Of two garments of the outfit, by brute force [m]."""
    garment = sim.scene.garment
    kinds, ids = all_stencils(*(garment.faces[garment.layers[k].faces] for k in (one, other)))
    return float(stencil_distances(kinds, sim.cloth_positions().astype(np.float64)[ids])[0].min())


def test_garments_put_together_are_cut_out_again_as_they_were():
    parts = [worn("a", THIN, 4)[0].garment, worn("b", THIN, 5)[0].garment, worn("c", THIN, 3)[0].garment]
    parts[1] = replace(parts[1], group=np.r_[0, 0, 2:25].astype(np.int32))
    whole = put_together(["a", "b", "c"], parts)
    assert [layer.name for layer in whole.layers] == ["a", "b", "c"]
    assert whole.vertex_count == 16 + 25 + 9
    assert whole.panel_count == 3
    for part, again in zip(parts, garments_of(whole)):
        assert np.array_equal(part.faces, again.faces)
        assert np.array_equal(part.uv_corners, again.uv_corners)
        assert np.array_equal(part.panel_of_face, again.panel_of_face)
    assert garments_of(whole)[1].group[:3].tolist() == [0, 0, 2]
    assert put_together(["a"], parts[:1]) is parts[0]
    with pytest.raises(ValueError, match="a name of its own"):
        put_together(["a", "a"], parts[:2])


def test_each_garment_keeps_its_own_basis():
    outfit, _ = two(0.01, columns=(12, 7))
    basis = basis_by_edges(outfit.garment, 3.0)
    first = 0
    for layer, one in zip(outfit.layers, outfit.worn):
        own = basis_by_edges(one.garment, 3.0)
        assert abs(basis[layer.vertices, first : first + own.shape[1]] - own).max() == 0
        first += own.shape[1]
    assert basis.shape[1] == first
    assert (np.diff(basis.indptr) > 0).all()  # no vertex without one


def test_a_garment_alone_is_simulated_with_the_same_bits():
    one, x = worn("alone", THIN)
    body, faces = slab(0.3, 0.3, 0.02, 0.05)
    x = x + [0.003, 0.01, 0.001]
    found = []
    for scene in (
        Scene(one.garment, x, rigid_body(body, faces), THIN),
        Outfit((one,)).scene(x, rigid_body(body, faces), WORN),
    ):
        sim = build(scene, PRESETS["draft"], "cpu", STILL)
        assert sim.contact.sizes.half is None
        assert sim.contact.sizes.garment is None
        for k in range(8):
            sim.advance(STILL, (k + 1) * DT)
        found.append(sim.cloth_positions())
    assert np.array_equal(*found)
    assert np.abs(found[0] - x).max() > 1e-3


def test_the_offset_of_two_garments_is_half_the_one_and_half_the_other():
    outfit, x = two(1.3 * BETWEEN)
    sim = build(outfit.scene(x, None, (SelfContact(),)))
    report = sim.advance(None, 1e-5)
    assert report.min_gap + BETWEEN == pytest.approx(distance(sim, 0, 1), abs=1e-8)
    assert report.gap_offset == pytest.approx(THIN.thickness)  # the least that one of the outfit's has


def test_fine_triangles_feel_another_garment_as_far_as_coarse_ones_do():
    """Within a garment the reach is cut to half a triangle's altitude, so that a fine mesh does not touch itself."""
    outfit, x = two(BETWEEN + 1e-3, size=(0.02, 0.1), columns=(9, 6))
    sim = build(outfit.scene(x, None, (SelfContact(),)))
    search_around(sim, sim.state.x, sim.work.direction)
    pairs.collect(sim.pairs, sim.candidates, sim.contact, sim.state.x)
    assert sim.pairs.size > 0
    assert sim.pairs.gap.numpy()[: sim.pairs.size, 1].min() == pytest.approx(sim.settings.d_hat)
    assert sim.settings.d_hat > 0.5 * 0.02 / 8 - BETWEEN  # as which it would not be seen


def test_a_garment_that_falls_on_another_comes_to_rest_off_it_by_their_thickness():
    outfit, x = two(BETWEEN + 3e-3)
    held = np.arange(36, dtype=np.int32)
    effects = (Gravity(), SelfContact(), Friction(), AirDrag(), Pins(held))
    sim = build(outfit.scene(x, None, effects), PRESETS["live"])
    nearest = []
    for k in range(30):
        report = sim.advance(None, (k + 1) * DT)
        nearest.append(distance(sim, 0, 1))
        assert report.retries == 0
    assert min(nearest) > BETWEEN
    assert BETWEEN < nearest[-1] < BETWEEN + sim.settings.d_hat


def test_two_fabrics_have_the_geometric_mean_of_their_friction():
    table = between_fabrics([fabric(mu_self=0.1, mu_body=0.2), fabric(mu_self=0.4, mu_body=0.5)])
    assert table == pytest.approx(np.array([[0.1, 0.2, 0.2], [0.2, 0.4, 0.5], [0.2, 0.5, 0.0]]))
    assert np.array_equal(table, table.T)


@pytest.mark.parametrize(("table", "mu"), [(False, 0.2), (True, 0.5)])
def test_a_garment_slides_on_another_as_the_pair_of_their_fabrics_says(table, mu):
    """Down an incline of 25 degrees by g (sin - mu cos), faster or slower, to 1 % of the friction; mu is the mean's, or
    what a table says of the two."""
    lower, below = worn("lower", fabric(mu_self=0.1, thickness=1e-3), 12, 0.3)
    upper, above = worn("upper", fabric(mu_self=0.4, thickness=0.5e-3), 4, 0.06)
    tilt = turn((0, 0, -25))
    x = np.vstack([below, above + [0.0, 1.4e-3, 0.0011]]) @ tilt.T
    between = np.array([[0.0, mu, 0.0], [mu, 0.0, 0.0], [0.0, 0.0, 0.0]]) if table else None
    effects = (Gravity(), SelfContact(), Friction(static=between), Pins(np.arange(144, dtype=np.int32), 1e5))
    sim = build(Outfit((lower, upper)).scene(x, None, effects), PRESETS["fit"])
    speeds = []
    for k in range(14):
        sim.advance(None, (k + 1) * DT)
        speeds.append(float((sim.state.v.numpy()[144:] @ tilt[:, 0]).mean()))
    angle = np.radians(25)
    pull = G * (np.sin(angle) - mu * np.cos(angle))
    assert min(speeds[3:]) > 0.01  # from the fall, also where friction is more than the pull
    assert (speeds[-1] - speeds[3]) / (10 * DT) == pytest.approx(pull, abs=0.01 * mu * G * np.cos(angle))


def test_what_hangs_far_from_another_garment_moves_as_it_does_alone():
    """Each step is solved to an error e; after n steps two runs differ by sum_k (n - k + 1) 2 e = n (n + 1) e at most,
    what a step is off by going on as a velocity."""
    steps, accuracy = 6, 2e-6
    (one, x), (other, far) = worn("one", THIN, 9, 0.2), worn("other", THICK, 7, 0.15)
    top = np.arange(9, dtype=np.int32)
    effects = (Gravity(), SelfContact(), Friction(), AirDrag(), Pins(top))
    settings = replace(PRESETS["fit"], accuracy=accuracy)
    found = []
    for scene in (
        Outfit((one,)).scene(x, None, effects),
        Outfit((one, other)).scene(np.vstack([x, far + [3.0, 0, 0]]), None, effects),
    ):
        sim = build(scene, settings)
        for k in range(steps):
            sim.advance(None, (k + 1) * DT)
        found.append(sim.cloth_positions()[:81])
    assert np.linalg.norm(found[0] - x, axis=1).max() > 0.02
    rms = np.sqrt(((found[1] - found[0]) ** 2).sum(1).mean())
    assert rms <= steps * (steps + 1) * accuracy


def test_taking_a_garment_off_leaves_the_others_as_they_are():
    lower, upper, top = worn("lower", THIN)[0], worn("upper", THICK)[0], worn("top", THIN)[0]
    flat = worn("", THIN)[1]
    body, faces = slab(0.3, 0.3, 0.02, 0.05)
    x = np.vstack([flat + [0.001 * k, 0.003 + 0.002 * k, 0.0007 * k] for k in range(3)])
    outfit = Outfit((lower, upper, top))
    sim = build(outfit.scene(x, rigid_body(body, faces), WORN), PRESETS["draft"], "cpu", STILL)
    for k in range(6):
        sim.advance(STILL, (k + 1) * DT)
    *_, left = without(WornOutfit(outfit, sim, STILL), "upper")
    kept = np.r_[0:36, 72:108]
    after = left.simulation
    assert [one.name for one in left.outfit.worn] == ["lower", "top"]
    assert np.array_equal(after.cloth_positions(), sim.cloth_positions()[kept])
    assert np.array_equal(after.state.v.numpy(), sim.state.v.numpy()[kept])
    assert np.array_equal(after.body_positions(), sim.body_positions())
    ids, given = sim.stages.contact[0].kept()
    ids_after, given_after = after.stages.contact[0].kept()
    assert 0 < len(ids_after) < len(ids)
    assert np.isin(given_after, given).all()
    before = after.cloth_positions()
    after.advance(STILL, DT)
    moved = np.linalg.norm(after.cloth_positions() - before, axis=1)
    fastest = np.linalg.norm(sim.state.v.numpy(), axis=1).max()
    assert moved.max() < G * DT**2 + fastest * DT  # what lay on it falls, nothing is thrown
    with pytest.raises(ValueError, match="can't be taken off"):
        next(without(left, "upper"))


def test_fabrics_of_one_garment_have_one_thickness():
    outfit, x = two(0.01)
    with pytest.raises(ValueError, match=r"thickness of panel 0 is 0.0004, the scene's fabric has 0.0016"):
        Scene(outfit.worn[0].garment, x[:36], None, THICK, (), panel_fabrics=(THIN,))
    halves = replace(outfit.worn[0].garment, panel_of_face=np.repeat([0, 1], 25).astype(np.int32))
    both = put_together(["a", "b"], [halves, outfit.worn[1].garment])
    with pytest.raises(ValueError, match="the first panel of its garment has"):
        Scene(both, x, None, THIN, (), panel_fabrics=(THIN, THICK, THICK))
    Scene(both, x, None, THIN, (), panel_fabrics=(THIN, THIN, THICK))


def test_contact_with_the_body_is_off_by_each_fabrics_half_thickness():
    outfit, _ = two(0.01)
    body, faces = slab(0.6, 0.3, 0.02, 0.05)
    settings = Settings()
    heights = [settings.body_offset + 0.5 * cloth.thickness + 0.3e-3 for cloth in (THIN, THICK)]
    flat = worn("", THIN)[1]
    x = np.vstack([flat + [-0.1, heights[0], 0], flat + [0.1, heights[1], 0]])
    sim = build(outfit.scene(x, rigid_body(body, faces), (BodyContact(),)), settings, "cpu", STILL)
    search_around(sim, sim.state.x, sim.work.direction)
    pairs.collect(sim.pairs, sim.candidates, sim.contact, sim.state.x)
    ids, gap = sim.pairs.ids.numpy()[: sim.pairs.size], sim.pairs.gap.numpy()[: sim.pairs.size, 0]
    for start in (0, 36):
        own = ((ids >= start) & (ids < start + 36)).any(axis=1)
        assert gap[own].min() == pytest.approx(0.3e-3, abs=1e-7)
