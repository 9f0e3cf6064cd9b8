"""The demo's T-shirt is cut, opened and darted on a walking body: the new mesh goes on from where the old one was."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from frame_judge import FrameJudge
from pattern_measures import demo
from small_scenes import sheet
from worn_garment import demo_motion

from tryon_solver import PRESETS, dress
from tryon_solver.body.model import default_body
from tryon_solver.body.motion import blend_in
from tryon_solver.dressing.carry_over import (
    MOST_STRETCH,
    SPREAD,
    CarryError,
    carry_over,
    drawn_back,
    drawn_together,
    eased,
    mean_edge,
    prepare,
    put_on,
)
from tryon_solver.dressing.new_cut import NewCut
from tryon_solver.dressing.returned import REACHES, Hung
from tryon_solver.geometry.connectivity import Connectivity
from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.locate import locate
from tryon_solver.geometry.overlay import Overlay
from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import parse_pattern
from tryon_solver.geometry.size import in_size
from tryon_solver.geometry.spread import EXACTLY
from tryon_solver.geometry.weld import weld
from tryon_solver.live_edit import FASTEST_STRAIN, LiveEdit
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.drag import begin_drag
from tryon_solver.redesign.plain import parse_edit
from tryon_solver.simulation import build
from tryon_solver.subspace.basis import basis_by_edges

FPS, EDGE = 30, 0.06
AT = 15  # frames of the walk before the edit
FASTEST = 1.5  # m/s beyond what the body does
EDITS = {
    "cut and sewn": {"kind": "cut", "panel": "front", "line": [[-0.5, 0.2], [0.5, 0.25]], "sewn": True},
    "cut off": {"kind": "cut", "panel": "front", "line": [[-0.5, 0.1], [0.5, 0.1]]},
    "dart": {"kind": "dart", "panel": "front", "edge": 0, "position": 0.3, "width": 0.03, "depth": 0.12},
    "pocket": {"kind": "pocket", "panel": "front", "at": [0.06, 0.4], "width": 0.13, "height": 0.14},
    "open seam": {"kind": "open_seam", "panel": "front", "edge": 1},
    "without a sleeve's half": {"kind": "remove_piece", "panel": "right_sleeve_back"},
}
THE_OTHER_HALF = {"kind": "remove_piece", "panel": "right_sleeve_front"}  # takes over 12 rounds to be freed again


class Walking:
    """A T-shirt of some 300 vertices, half a second into a walk."""

    def __init__(self):
        self.mesh = mesh_pattern(parse_pattern(demo("tshirt")), EDGE)
        self.body = default_body()
        dressed = dress(self.mesh, self.body, FABRICS["cotton_jersey"], PRESETS["draft"])
        self.sim, motion = dressed.simulation, demo_motion("walk", self.body)
        self.lead = blend_in(dressed.pose, motion, 1.5)
        start = self.sim.state.time
        for k in range(1, AT + 1):
            self.sim.advance(self.pose(k), start + k / FPS)

    def pose(self, frame):
        """Of the body, so many frames into the walk."""
        return self.lead.sample(frame / FPS)

    def body_speed(self, frame):
        """Of the fastest point of the skin in that frame [m/s]."""
        moved = self.body.surface(self.pose(frame)) - self.body.surface(self.pose(frame - 1))
        return FPS * np.linalg.norm(moved, axis=1).max()


@pytest.fixture(scope="module")
def walking():
    return Walking()


def cut(edit):
    """The mesh of the T-shirt after the edit."""
    return mesh_pattern(parse_pattern(apply(demo("tshirt"), parse_edit(edit)).specification), EDGE)


def assert_goes_on(walking, sim, at=AT):
    """Clean in the state in which it was put on, in frame `at` of the walk, and in the five that follow, and no faster
    than an edit may be."""
    judge = FrameJudge(sim.scene.garment.faces, walking.body.faces, sim.cloth_positions(), sim.body_positions())
    assert judge.judge(sim.cloth_positions(), sim.body_positions()).clean
    for k in range(1, 6):
        x = sim.cloth_positions()
        sim.advance(walking.pose(at + k), k / FPS)
        assert judge.judge(sim.cloth_positions(), sim.body_positions()).clean, k
        fastest = FPS * np.linalg.norm(sim.cloth_positions() - x, axis=1).max()
        assert fastest < walking.body_speed(at + k) + FASTEST, k


@pytest.mark.parametrize("name", EDITS)
def test_another_cut_goes_on_where_the_garment_was(walking, name):
    before = walking.sim.cloth_positions(), walking.sim.state.time
    carried = carry_over(walking.sim, walking.mesh, cut(EDITS[name]))
    sim = carried.simulation
    assert sim.cloth_count != walking.sim.cloth_count
    assert_goes_on(walking, sim)
    np.testing.assert_array_equal(walking.sim.cloth_positions(), before[0])  # the old one is as it was
    assert walking.sim.state.time == before[1]


def test_what_is_drawn_together_is_let_go_over_time(walking):
    """A dart of 6 cm: where its fabric is as short as in the pattern from the first frame on, that is thrown."""
    wide = {**EDITS["dart"], "width": 0.06, "depth": 0.15}
    pattern = parse_pattern(apply(demo("tshirt"), parse_edit(wide)).specification)
    mesh, fastest = mesh_pattern(pattern, EDGE), {}
    for with_slack in (False, True):
        carried = carry_over(walking.sim, walking.mesh, mesh)
        sim, shape = carried.simulation, carried.simulation.scene.garment.uv_corners
        assert 0.03 < carried.went < 0.07
        inverse, edit = sim.search.inverse.numpy(), LiveEdit(sim, begin_drag(mesh, pattern, sim.scene.fabric.thickness))
        if with_slack:
            edit.begin_with(carried.slack)
            assert edit.ramp_seconds == pytest.approx(carried.slack.largest_strain() / FASTEST_STRAIN)
        moved = []
        for k in range(1, 9):
            x = sim.cloth_positions()
            edit.before_frame(k / FPS)
            sim.advance(walking.pose(AT + k), k / FPS)
            moved.append(FPS * np.linalg.norm(sim.cloth_positions() - x, axis=1).max())
            assert edit.there is (not with_slack or k / FPS >= edit.ramp_seconds)
        np.testing.assert_array_equal(sim.scene.garment.uv_corners, shape)
        np.testing.assert_array_equal(sim.search.inverse.numpy(), inverse)
        fastest[with_slack] = max(moved[:3])
    assert fastest[True] < 0.7 * fastest[False]


@pytest.mark.parametrize("edit", [EDITS["cut off"], EDITS["without a sleeve's half"], THE_OTHER_HALF])
def test_cloth_that_was_taken_away_comes_back_where_it_hung(walking, edit):
    """A quarter of a second of the walk later; from what is worn nobody could tell where it is to be. By each reach
    from the same worn garment, which is left as it is."""
    later, without, spacing = 8, cut(edit), walking.sim.settings.subspace_spacing
    worn = carry_over(walking.sim, walking.mesh, without).simulation
    for k in range(1, later + 1):
        worn.advance(walking.pose(AT + k), k / FPS)
    where = (part.astype(np.float64) for part in (walking.sim.cloth_positions(), walking.sim.body_positions()))
    hung = Hung(walking.mesh, walking.sim.scene.garment.faces, *where, walking.sim.body.pose)
    made = NewCut.of(walking.mesh, without, spacing)

    def back(hung, reach):
        *_, prepared = prepare(worn, made, worn.scene.fabric)
        return put_on(prepared, worn, without, hung, reach).simulation

    before = [part.copy() for part in state_of(worn)]
    lay = worn.cloth_positions()[worn.scene.garment.faces[made.overlay.face]]
    there = made.welded.mean_of_vertices(np.einsum("vk,vkd->vd", made.overlay.weights, lay))
    for reach in REACHES:
        with pytest.raises(CarryError):
            back(None, reach)
        sim = back(hung, reach)
        moved = np.linalg.norm(sim.cloth_positions() - there, axis=1)
        stays = np.mean(moved < 1e-3)
        assert stays < 0.05 if reach == 0.0 else stays > 0.25, "what is worn stays where it is unless all goes back"
        assert_goes_on(walking, sim, AT + later)
        for one, other in zip(before, state_of(worn)):
            np.testing.assert_array_equal(one, other)


def test_what_has_come_off_meanwhile_goes_back_with_what_comes_back(walking):
    """A T-shirt without its front, 20 cm lower than it hung by now, is worn around the shoulders again."""
    without, sim = cut({"kind": "remove_piece", "panel": "front"}), walking.sim
    worn = carry_over(sim, walking.mesh, without).simulation
    where = (part.astype(np.float64) for part in (sim.cloth_positions(), sim.body_positions()))
    hung = Hung(walking.mesh, sim.scene.garment.faces, *where, sim.body.pose)
    x = worn.state.x.numpy()
    x[: worn.cloth_count, 1] -= 0.2
    worn.state.x.assign(x)
    made = NewCut.of(walking.mesh, without, sim.settings.subspace_spacing)
    *_, prepared = prepare(worn, made, worn.scene.fabric)
    carried = put_on(prepared, worn, without, hung, REACHES[0])
    back = carried.simulation
    assert carried.went == pytest.approx(0.2, abs=0.01)
    np.testing.assert_allclose(back.cloth_positions(), sim.cloth_positions(), atol=5e-3)
    assert_goes_on(walking, back)


def test_the_old_garment_goes_on_as_if_nothing_were_made_beside_it_and_the_new_one_from_where_it_comes_to(walking):
    """The cut is made ready while frames go by, and put on: all frames before and after it are clean."""
    alone, sim = (built_where_it_is(walking.sim) for _ in range(2))
    alone.use_inverse(sim.search.inverse.numpy())  # made twice, the last bits may differ
    after = cut(EDITS["cut and sewn"])
    parts = prepare(sim, NewCut.of(after, walking.mesh, sim.settings.subspace_spacing), sim.scene.fabric)
    asked = sim.cloth_positions()
    for k in range(1, 4):
        assert next(parts) is None
        for garment in (alone, sim):
            garment.advance(walking.pose(AT + k), k / FPS)
        for one, other in zip(state_of(sim), state_of(alone)):
            np.testing.assert_array_equal(one, other)
    assert np.abs(sim.cloth_positions() - asked).max() > 0.01
    *rest, prepared = parts
    assert set(rest) <= {None}
    assert prepared is not None
    new = put_on(prepared, sim, walking.mesh).simulation
    for one, other in zip(state_of(new), state_of(carry_over(sim, walking.mesh, after).simulation)):
        np.testing.assert_array_equal(one, other)
    assert np.abs(new.state.v.numpy()).max() > 0.1
    np.testing.assert_allclose(new.body_positions(), sim.body_positions(), atol=5e-3)  # but where it makes room
    judge = FrameJudge(new.scene.garment.faces, walking.body.faces, new.cloth_positions(), new.body_positions())
    assert judge.judge(new.cloth_positions(), new.body_positions()).clean
    for k in range(1, 6):
        new.advance(walking.pose(AT + 3 + k), k / FPS)
        assert judge.judge(new.cloth_positions(), new.body_positions()).clean, k


@pytest.mark.parametrize("name", ["dart", "open seam", "pocket"])
def test_what_a_cut_hands_on_is_all_made_and_is_what_its_mesh_comes_to_from_scratch(walking, name):
    mesh, spacing = cut(EDITS[name]), walking.sim.settings.subspace_spacing
    handed = pickle.loads(pickle.dumps(NewCut.of(mesh, walking.mesh, spacing)))
    garment = weld(mesh).garment()
    for one, other in zip(csr_parts(handed.basis), csr_parts(basis_by_edges(garment, spacing))):
        np.testing.assert_array_equal(one, other)
    found, own = handed.garment.connectivity, Connectivity(garment.faces, garment.vertex_count)
    made = set(vars(found))
    for part in ("edges", "owned", "hinges", "hinge_corners"):
        np.testing.assert_array_equal(getattr(found, part), getattr(own, part))
    for part in ("corners", "pairs"):
        for one, other in zip(getattr(found, part), getattr(own, part)):
            np.testing.assert_array_equal(one, other)
    for part in ("triangle_sum", "hinge_sum"):
        one, other = getattr(found, part), getattr(own, part)
        np.testing.assert_array_equal(one.order, other.order)
        np.testing.assert_array_equal(one.starts, other.starts)
        for ours, theirs in zip(csr_parts(one.pattern), csr_parts(other.pattern)):
            np.testing.assert_array_equal(ours, theirs)
    assert set(vars(found)) == made, "nothing was left to be made by the simulation"


def csr_parts(matrix):
    return matrix.data, matrix.indices, matrix.indptr


@pytest.mark.parametrize("name", sorted(set(FABRICS) - {"cotton_jersey"}))
def test_the_same_cut_of_another_fabric_goes_on_where_the_garment_was(walking, name):
    fabric = FABRICS[name]
    made = NewCut.of(walking.mesh, walking.mesh, walking.sim.settings.subspace_spacing)
    *_, prepared = prepare(walking.sim, made, fabric)
    sim = put_on(prepared, walking.sim, walking.mesh).simulation
    assert sim.scene.fabric == fabric
    mass = fabric.areal_density / walking.sim.scene.fabric.areal_density
    np.testing.assert_allclose(sim.mass.sum(), mass * walking.sim.mass.sum(), rtol=1e-6)
    assert sim.contact.sizes.xi_self == pytest.approx(fabric.thickness)
    np.testing.assert_allclose(sim.cloth_positions(), walking.sim.cloth_positions(), atol=3e-3)
    assert_goes_on(walking, sim)


def test_an_overlay_over_what_the_garment_was_before_is_not_looked_at(walking):
    after = cut(EDITS["cut and sewn"])
    stale = Overlay(walking.mesh.placed + 1.0, np.full(len(after.uv), -1), np.full((len(after.uv), 3), np.nan))
    made = NewCut.of(after, walking.mesh, walking.sim.settings.subspace_spacing)
    *_, prepared = prepare(walking.sim, replace(made, overlay=stale), walking.sim.scene.fabric)
    new = put_on(prepared, walking.sim, walking.mesh).simulation
    for one, other in zip(state_of(new), state_of(carry_over(walking.sim, walking.mesh, after).simulation)):
        np.testing.assert_array_equal(one, other)


def test_pieces_that_are_as_they_were_lie_where_they_lay(walking):
    """What is told of them without a search is a place as the search finds it, and the other pieces are searched."""
    before, after = walking.mesh, cut(EDITS["dart"])
    made = Overlay.of(before, after)
    face, weights = locate(after.placed, before.placed[before.faces])
    for one, of in ((made.face, made.weights), (face, weights)):
        there = np.einsum("vk,vkd->vd", of, before.placed[before.faces[one]])
        np.testing.assert_allclose(there, after.placed, atol=2e-3)
    told = np.flatnonzero(np.isin(after.panel_of_vertex, [list(after.panel_names).index("back")]))
    assert (made.weights[told].max(axis=1) == 1.0).all()
    corner = before.faces[made.face, made.weights.argmax(axis=1)]
    np.testing.assert_array_equal(before.placed[corner][told], after.placed[told])
    names = [before.panel_names[k] for k in before.panel_of_face[made.face[told]]]
    assert set(names) == {"back"}
    front = np.flatnonzero(after.panel_of_vertex == list(after.panel_names).index("front"))
    np.testing.assert_array_equal(made.face[front], face[front])
    np.testing.assert_array_equal(made.weights[front], weights[front])


def test_a_gap_is_bridged_by_its_own_piece():
    """A dart that gapes by 2 cm: u - l^2 Laplace(u) = 0 on the front's graph, and all others stay where they are."""
    after = cut(EDITS["dart"])
    joined = weld(after)
    rng = np.random.default_rng(1)
    x = rng.normal(size=(joined.vertex_count, 3))[joined.welded_of_vertex]
    front = after.panel_of_vertex == list(after.panel_names).index("front")
    twice = np.bincount(joined.welded_of_vertex[front], minlength=joined.vertex_count)[joined.welded_of_vertex] > 1
    dart = np.flatnonzero(front & twice)
    assert len(dart) >= 4
    for vertex in dart:
        x[vertex, 0] += 0.01 if (joined.welded_of_vertex[:vertex] == joined.welded_of_vertex[vertex]).any() else -0.01
    moved = drawn_together(after, joined, x)
    np.testing.assert_array_equal(moved[~front], x[~front])
    np.testing.assert_allclose(moved[dart], joined.mean_of_vertices(x)[joined.welded_of_vertex[dart]], atol=1e-12)
    u, length = moved - x, mean_edge(after)
    free = np.flatnonzero(front & (np.bincount(joined.welded_of_vertex)[joined.welded_of_vertex] == 1))
    assert np.abs(u[free]).max() > 1e-3
    for vertex in free:
        near = np.unique(after.faces[(after.faces == vertex).any(axis=1)])
        near = near[near != vertex]
        links = np.array([shared(after.faces, vertex, other) for other in near])
        weight = links.sum() * (1 + (length / (SPREAD * 0.01)) ** 2)
        np.testing.assert_allclose(weight * u[vertex], links @ u[near], atol=20 * EXACTLY * 0.01)


def shared(faces, one, other):
    """How many triangles have both vertices."""
    return int(((faces == one).any(axis=1) & (faces == other).any(axis=1)).sum())


def built_where_it_is(sim):
    """The same garment at rest where this one is."""
    scene = replace(sim.scene, x_start=sim.cloth_positions().astype(np.float64))
    return build(scene, sim.settings, sim.device, sim.body.pose, sim.body_positions().astype(np.float64))


def state_of(sim):
    return sim.cloth_positions(), sim.body_positions(), sim.state.v.numpy()


def test_the_same_cut_is_where_it_was(walking):
    carried = carry_over(walking.sim, walking.mesh, walking.mesh)
    assert carried.went < 1e-3
    assert carried.slack is None
    there = carried.simulation.cloth_positions()
    np.testing.assert_allclose(there, walking.sim.cloth_positions(), atol=2e-4)
    np.testing.assert_allclose(carried.simulation.state.v.numpy(), walking.sim.state.v.numpy(), atol=1e-4)
    assert np.abs(carried.simulation.state.v.numpy()).max() > 0.01


def test_finer_cloth_lies_on_the_coarse_one(walking):
    finer = mesh_pattern(parse_pattern(demo("tshirt")), 0.7 * EDGE)
    sim = carry_over(walking.sim, walking.mesh, finer).simulation
    assert sim.cloth_count > 1.5 * walking.sim.cloth_count
    reached, old = sim.cloth_positions(), walking.sim.cloth_positions()
    nearest = np.linalg.norm(reached[:, None] - old[None], axis=2).min(axis=1)
    assert nearest.max() < EDGE


def test_what_would_be_stretched_too_far_is_not_carried_over(walking):
    smaller = in_size(walking.mesh, 1 / (MOST_STRETCH * 1.3))
    smaller = replace(smaller, placed=walking.mesh.placed)
    with pytest.raises(CarryError, match=r"is worn, (front|back|\w+_sleeve_\w+) would be stretched to"):
        carry_over(walking.sim, walking.mesh, smaller)


def test_beyond_the_old_edge_the_cloth_goes_on_straight():
    longer = apply(demo("tshirt"), parse_edit({"kind": "lengthen", "panel": "front", "edge": 0, "by": 0.03}))
    old = mesh_pattern(parse_pattern(demo("tshirt")), EDGE)
    new = mesh_pattern(parse_pattern(longer.specification), EDGE)
    face, weights = locate(new.placed, old.placed[old.faces])
    found = np.einsum("vk,vkd->vd", weights, old.placed[old.faces[face]])
    np.testing.assert_allclose(found, new.placed, atol=2e-3)
    assert weights.min() < -0.1


def stretches(garment, x):
    """(3 F,) lengths of the triangles' sides over those in the pattern."""
    corners, flat = x[garment.faces], garment.uv_corners
    lengths, own = (np.linalg.norm(at[:, [1, 2, 0]] - at, axis=2) for at in (corners, flat))
    return (lengths / own).ravel()


def test_what_is_drawn_too_long_draws_on_what_lies_beside_it():
    """A sheet with one vertex 3 cm aside, of edges of 1 cm: longest at its corner, it gives all around."""
    garment, x = sheet(21, 21, 0.2, 0.2)
    before, drawn = x[garment.faces], x.copy()
    drawn[220] += [0.03, 0.0, 0.0]
    assert stretches(garment, drawn).max() > 2.5
    given = eased(garment, drawn, before, 1.15)
    assert stretches(garment, given).max() < 1.5
    moved = np.linalg.norm(given - drawn, axis=1)
    assert moved[220] < 0.03
    assert 8 < (moved > 1e-4).sum() < len(x) / 2, "what is far away stays"
    np.testing.assert_array_equal(eased(garment, x, before, 1.15), x)


def test_what_was_stretched_before_may_be_so_and_gives_no_further():
    garment, x = sheet(11, 11, 0.2, 0.2)
    wide = 1.4 * x
    np.testing.assert_array_equal(eased(garment, wide, wide[garment.faces], 1.15), wide)
    assert stretches(garment, eased(garment, wide, x[garment.faces], 1.15)).max() < 1.4


def test_what_lies_on_each_other_is_drawn_back():
    opened = apply(demo("tshirt"), parse_edit(EDITS["open seam"]))
    mesh = mesh_pattern(parse_pattern(opened.specification), EDGE)
    joined = weld(mesh)
    garment = Garment(joined.vertex_of_corner, joined.uv_corners, joined.panel_of_face, joined.vertex_count)
    x = np.random.default_rng(3).normal(size=(garment.vertex_count, 3))
    x[7] = x[3]
    moved = drawn_back(garment, x, 1e-3)
    np.testing.assert_allclose(np.linalg.norm(moved[[3, 7]] - x[[3, 7]], axis=1), 1e-3, rtol=1e-6)
    assert np.linalg.norm(moved[7] - moved[3]) > 1e-4
    untouched = np.setdiff1d(np.arange(len(x)), [3, 7])
    np.testing.assert_array_equal(moved[untouched], x[untouched])
