"""A garment that is worn gets another rest shape: all that is made of it is, and nothing else changes."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
import warp as wp
from contact_scenes import EFFECTS, sleeve_on_limb, square_on_sphere
from small_scenes import STILL, fabric, sheet

from tryon_solver.geometry.garment import GarmentError
from tryon_solver.geometry.lines import line_between
from tryon_solver.reshape import OtherStructureError, reshape
from tryon_solver.scene import (
    Creases,
    Elastic,
    ElasticLine,
    FabricDamping,
    Fasteners,
    Gravity,
    Pins,
    Scene,
    StrainLimit,
    Wind,
)
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build
from tryon_solver.subspace.basis import explicit_inverse, reduced_matrix

DT = 1 / 60


def drawn(garment, warp=1.0, weft=1.0, wave=0.0):
    """The same triangles, longer or shorter in the pattern, and skewed where `wave` [m] is not zero."""
    uv = garment.uv_corners * [warp, weft]
    bent = uv + wave * np.sin(9 * uv[..., ::-1] + [0.3, 1.1])
    return replace(garment, uv_corners=bent)


def damped_scene():
    scene = square_on_sphere().scene
    return replace(scene, effects=(*EFFECTS, FabricDamping()))


def arrays(sim):
    """Everything on the device that is made of the rest shape, the basis and its inverse left out."""
    found = {
        "gradients": sim.rest.gradients,
        "areas": sim.rest.area,
        "stiffness": sim.matrices.rows.weights,
        "stiffness, all digits": sim.matrices.total.values,
        "columns": sim.matrices.rows.columns,
        "diagonal": sim.matrices.diagonal,
        "constant near": sim.matrices.near_far.near,
        "constant far": sim.matrices.near_far.far.weights,
        "far columns": sim.matrices.near_far.far.columns,
        "mass": sim.mass_per_dt2,
        "all diagonal": sim.work.diagonal[: sim.cloth_count],
    }
    if sim.touching:
        found |= {"area": sim.contact.area, "reach": sim.contact.reach_self}
    for contribution in sim.plan.contributions:
        for term in (contribution.stiffness, contribution.rate_stiffness):
            if term is not None:
                found[f"{contribution.name}, rate {term.rate}"] = term.matrix.values
    return {name: array.numpy().copy() for name, array in found.items()}


def same(one, other):
    assert one.keys() == other.keys()
    return [name for name in one if one[name].shape != other[name].shape or (one[name] != other[name]).any()]


def test_all_that_is_made_of_the_shape_is_as_if_built_of_it():
    scene = damped_scene()
    other = drawn(scene.garment, 1.07, 0.96, 0.004)
    sim = build(scene, PRESETS["live"], "cpu", STILL)
    before = arrays(sim)
    assert len(before) > 15
    reshape(sim, other)
    fresh = build(replace(scene, garment=other), PRESETS["live"], "cpu", STILL)
    assert same(arrays(sim), arrays(fresh)) == []
    untouched = {"columns", "far columns"}
    assert set(same(arrays(sim), before)) == set(before) - untouched
    np.testing.assert_array_equal(sim.mass, fresh.mass)
    assert abs(sim.stiffness_matrix - fresh.stiffness_matrix).max() == 0


def test_effects_that_are_made_of_the_shape_are_as_if_built_of_it():
    """Elastic by its edges' lengths, creases by their hinges, wind by areas, buttons by nothing."""
    garment, x = sheet(7, 7, 0.2, 0.2)
    middle = line_between(garment, 21, 27)
    effects = (
        Elastic((ElasticLine(middle, 0.7, 20.0),)),
        Creases(middle, np.full(len(middle), 1.2)),
        Fasteners(np.array([[0, 48]], np.int32)),
        Wind((1.0, 2.0, 0.0)),
    )
    scene = Scene(garment, x, None, fabric(), effects)
    other = drawn(garment, 1.2, 0.9)
    sim, fresh = build(scene), build(replace(scene, garment=other))
    before = gradients(sim)
    reshape(sim, other)
    assert same(arrays(sim), arrays(fresh)) == []
    assert same(gradients(sim), gradients(fresh)) == []
    assert set(same(gradients(sim), before)) >= {"elastic", "creases", "wind"}


def gradients(sim):
    """Of each contribution that acts on positions or velocities: its forces at the start."""
    found = {}
    for contribution in sim.plan.contributions:
        out = wp.zeros(sim.cloth_count, dtype=wp.vec3, device="cpu")
        if contribution.start_step is not None:
            contribution.start_step(sim.state)
        if contribution.add_gradient is not None:
            contribution.add_gradient(sim.state.x, out)
        if contribution.add_velocity_gradient is not None:
            contribution.add_velocity_gradient(sim.state, sim.state.x, out)
        found[contribution.name] = out.numpy()
    return found


def test_the_last_bits_of_a_step_are_not_in_the_inverse():
    made = []
    for dt in (1 / 30, 1 / 30 - 2e-16, 1 / 32):
        sim = build(damped_scene(), PRESETS["live"], "cpu", STILL)
        sim.use_time_step(dt)
        made.append(sim.search.inverse.numpy().copy())
    np.testing.assert_array_equal(made[0], made[1])
    assert np.abs(made[2] - made[0]).max() > 1e-3 * np.abs(made[0]).max()


def test_the_inverse_serves_on_until_the_new_one_is_there():
    scene = damped_scene()
    sim = build(scene, PRESETS["live"], "cpu", STILL)
    old = sim.search.inverse.numpy().copy()
    reshape(sim, drawn(scene.garment, 1.2, 0.9))
    np.testing.assert_array_equal(sim.search.inverse.numpy(), old)
    sim.advance(STILL, DT)
    new = sim.reduced_inverse()
    system = sim.stiffness_matrix + sp.diags(sim.diagonal(sim.dt))
    expected = explicit_inverse(reduced_matrix(sim.basis, system))
    np.testing.assert_allclose(new, expected, rtol=0, atol=1e-6 * np.abs(expected).max())
    assert np.abs(new - old).max() > 0.01 * np.abs(old).max()
    sim.use_inverse(new)
    np.testing.assert_array_equal(sim.search.inverse.numpy(), new)
    sim.use_time_step(DT / 4)
    assert (sim.search.inverse.numpy() != new).any()
    sim.use_time_step(DT)
    np.testing.assert_array_equal(sim.search.inverse.numpy(), new)


def test_there_and_back_leaves_no_trace():
    """Edited and undone between two frames: the same bytes ever after."""
    case = sleeve_on_limb()
    ends = []
    for edited in (False, True):
        sim = build(case.scene, PRESETS["live"], "cpu", case.pose_at(0))
        for k in range(1, 9):
            if edited and k == 5:
                before, inverse = arrays(sim), sim.search.inverse.numpy().copy()
                reshape(sim, drawn(case.scene.garment, 0.93, 1.05, 0.002))
                sim.use_inverse(sim.reduced_inverse())
                reshape(sim, case.scene.garment)
                sim.use_inverse(inverse)
                assert same(arrays(sim), before) == []
            sim.advance(case.pose_at(k), k * DT)
        ends.append(sim.cloth_positions())
    assert np.abs(ends[0] - case.scene.x_start).max() > 1e-3
    np.testing.assert_array_equal(*ends)


@pytest.mark.long
@pytest.mark.parametrize("along", [0, 1])
def test_a_hanging_sheet_lets_itself_down_by_what_it_is_lengthened(along):
    """To where one that was cut so hangs, with no kick on the way: it falls by gravity at most."""
    garment, x = sheet(13, 13, 0.3, 0.3)
    x = x[:, [0, 2, 1]] * [1, -1, 1]
    top = np.flatnonzero(x[:, 1] > x[:, 1].max() - 1e-6).astype(np.int32)
    cloth = fabric(k_warp=300.0, k_weft=300.0)
    scene = Scene(garment, x, None, cloth, (Gravity(), StrainLimit(), FabricDamping(0.02), Pins(top)))
    factors = [1.0, 1.0]
    factors[along] = 1.1
    other = drawn(garment, *factors)
    settings = PRESETS["live"]
    sim, fresh = build(scene, settings, "cpu", None), build(replace(scene, garment=other), settings, "cpu", None)
    fastest = 0.0
    for k in range(1, 241):
        if k == 61:
            at_first = sim.cloth_positions()
            reshape(sim, other)
            sim.use_inverse(sim.reduced_inverse())
        for one in (sim, fresh):
            one.advance(None, k * DT)
        if k > 61:
            fastest = max(fastest, np.linalg.norm(sim.state.v.numpy(), axis=1).max())
    lowered = (at_first - sim.cloth_positions())[:, 1].max()
    hung = sim.cloth_positions()[:, 1].min() - fresh.cloth_positions()[:, 1].min()
    if along == 1:
        assert lowered == pytest.approx(0.03, rel=0.1)
    assert abs(hung) < 1e-3
    assert fastest < 1.5


def test_what_is_refused_changes_nothing():
    scene = square_on_sphere().scene
    sim = build(scene, PRESETS["live"], "cpu", STILL)
    before = arrays(sim)
    garment = scene.garment
    first_last = np.roll(np.arange(len(garment.faces)), 1)
    turned = replace(garment, faces=garment.faces[first_last], uv_corners=garment.uv_corners[first_last])
    with pytest.raises(OtherStructureError, match="other triangles"):
        reshape(sim, turned)
    with pytest.raises(GarmentError):
        reshape(sim, drawn(garment, 1e-3, 1.0))
    assert same(arrays(sim), before) == []
    assert sim.scene is scene


def test_a_sleeping_garment_wakes():
    scene = damped_scene()
    sim = build(scene, PRESETS["live"], "cpu", STILL)
    sim.state.asleep = True
    reshape(sim, drawn(scene.garment, 1.01))
    assert not sim.state.asleep


@pytest.mark.gpu
def test_recorded_graphs_follow_the_shape():
    wp.init()
    if not wp.is_cuda_available():
        pytest.skip("no CUDA device on this machine")
    case = sleeve_on_limb()
    other = drawn(case.scene.garment, 1.06, 0.97, 0.002)
    found = []
    for device in ("cpu", "cuda:0"):
        sim = build(case.scene, PRESETS["live"], device, case.pose_at(0))
        for k in range(1, 9):
            if k == 4:
                reshape(sim, other)
                sim.use_inverse(sim.reduced_inverse())
            sim.advance(case.pose_at(k), k * DT)
        found.append(sim.cloth_positions())
    still = build(case.scene, PRESETS["live"], "cpu", case.pose_at(0))
    for k in range(1, 9):
        still.advance(case.pose_at(k), k * DT)
    assert np.abs(found[0] - still.cloth_positions()).max() > 1e-3
    assert np.abs(found[0] - found[1]).max() < 2e-4
