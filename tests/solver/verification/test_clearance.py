"""The clearance of a report is the true distance of the committed state, also where cloth is closer than its offset."""

import numpy as np
import pytest
from reference_distances import all_stencils, stencil_distances
from small_scenes import STILL, fabric, icosphere, layers, rigid_body, sheet

from tryon_solver.contact import pairs
from tryon_solver.geometry.garment import GarmentError
from tryon_solver.scene import BodyContact, Scene, SelfContact
from tryon_solver.settings import Settings
from tryon_solver.simulation import build
from tryon_solver.stepping.search import search_around

RADIUS = 0.04


def nearest(x: np.ndarray, faces_a: np.ndarray, faces_b: np.ndarray) -> float:
    """Smallest distance of two surfaces over all their stencils, by brute force [m]."""
    kinds, ids = all_stencils(faces_a, faces_b)
    return float(stencil_distances(kinds, x[ids])[0].min())


@pytest.mark.parametrize("share", [0.8, 1.6])
def test_clearance_of_cloth_on_skin(share):
    """Cloth at a share of its offset from a ball: a gap below 0 says that it is closer than its offset, no more."""
    garment, x = sheet(5, 5, 0.1, 0.1)
    ball, faces = icosphere(RADIUS, 1)
    cloth = fabric()
    offset = 1.5e-3 + 0.5 * cloth.thickness
    above = np.array([0, ball[:, 1].max() + share * offset, 0])
    sim = build(Scene(garment, x + above, rigid_body(ball, faces), cloth, (BodyContact(),)), None, "cpu", STILL)
    search_around(sim, sim.state.x, sim.work.direction)
    sim.counters.steps = 1
    gap, gap_offset = sim.smallest_gap()
    assert gap_offset == pytest.approx(offset, rel=1e-6)
    true = nearest(sim.state.x.numpy().astype(np.float64), garment.faces, faces + sim.cloth_count)
    assert true == pytest.approx(share * offset, rel=1e-3)
    assert gap + gap_offset == pytest.approx(true, abs=1e-8)
    assert gap == pytest.approx((share - 1) * offset, rel=1e-2)


@pytest.mark.parametrize("d_hat", [1e-5, 1e-4, 2e-3])
def test_contact_pushes_however_small_its_reach(d_hat):
    """Half way into it a pair pushes, and at a tenth of that gap it pushes harder."""
    garment, x = sheet(5, 5, 0.1, 0.1)
    ball, faces = icosphere(RADIUS, 1)
    cloth, pushes = fabric(), []
    for gap in (0.5 * d_hat, 0.15 * d_hat):
        above = np.array([0, ball[:, 1].max() + 1.5e-3 + 0.5 * cloth.thickness + gap, 0])
        scene = Scene(garment, x + above, rigid_body(ball, faces), cloth, (BodyContact(),))
        sim = build(scene, Settings(d_hat=d_hat), "cpu", STILL)
        search_around(sim, sim.state.x, sim.work.direction)
        pairs.collect(sim.pairs, sim.candidates, sim.contact, sim.state.x)
        assert sim.pairs.size > 0
        pushes.append(-sim.pairs.slope.numpy()[: sim.pairs.size].min())
    assert 0 < pushes[0] < pushes[1]


def test_clearance_of_cloth_on_cloth():
    """Two sheets 1.3 thicknesses apart: the offset is the fabric's own thickness."""
    cloth = fabric()
    garment, x = layers(2, 5, 5, 0.1, 1.3 * cloth.thickness)
    sim = build(Scene(garment, x, None, cloth, (SelfContact(),)))
    report = sim.advance(None, 1e-5)
    assert report.retries == 0
    assert report.gap_offset == pytest.approx(cloth.thickness, rel=1e-6)
    lower, upper = np.array_split(garment.faces, 2)
    true = nearest(sim.state.x.numpy().astype(np.float64), lower, upper)
    assert report.min_gap > 0
    assert report.min_gap + report.gap_offset == pytest.approx(true, abs=1e-8)


@pytest.mark.parametrize(("shift", "what"), [((0.0, 0.0), "vertex"), ((0.5, 0.0), "vertex"), ((0.3, 0.2), "touch")])
def test_a_start_that_touches_is_refused_with_its_place(shift, what):
    """Two sheets in one plane, their vertices upon each other, upon edges, or upon faces."""
    garment, x = layers(2, 5, 5, 0.1, 0.0)
    x[25:] += 0.025 * np.array([shift[0], 0, shift[1]])
    with pytest.raises(GarmentError, match=r"at the start .*; move them apart") as caught:
        build(Scene(garment, x, None, fabric(), (SelfContact(),)))
    assert what in str(caught.value)
    build(Scene(garment, x, None, fabric(), (SelfContact(),)), tangled=True)
    build(Scene(garment, x, None, fabric(), ()))


def test_a_start_that_crosses_far_from_any_vertex_is_refused():
    """One large triangle pair through the middle of another: every vertex is far away from the other sheet."""
    garment, x = layers(2, 2, 2, 0.4, 0.0)
    x[4:] = x[4:][:, [1, 0, 2]] * [1, 1, 0.5] + [0.03, 0, 0.05]
    with pytest.raises(GarmentError, match=r"edge of vertex \d and vertex \d passes through the triangle of vertex"):
        build(Scene(garment, x, None, fabric(), (SelfContact(),)))


def test_a_start_inside_the_body_is_refused_with_the_bodys_vertices():
    garment, x = sheet(5, 5, 0.1, 0.1)
    ball, faces = icosphere(RADIUS, 1)
    scene = Scene(garment, x + [0, 0.5 * RADIUS, 0], rigid_body(ball, faces), fabric(), (BodyContact(),))
    with pytest.raises(GarmentError, match="the body's vertex"):
        build(scene, None, "cpu", STILL)
