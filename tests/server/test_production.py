"""The solver behind the server's interface: a garment is dressed once and worn again."""

import os
import pickle
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import patterns
import pytest
import trimesh
from analytic_drape import small_body
from scipy.spatial import cKDTree
from small_scenes import sheet

from tryon_protocol import FrameDecoder, Topology, decode_server
from tryon_server.problems import ProblemError
from tryon_server.runtime import production, solver_drape
from tryon_server.runtime.bodies import load_body
from tryon_server.runtime.motions import list_motions, load_motion
from tryon_server.runtime.order import DrapeOrder
from tryon_server.runtime.publishing import Publisher
from tryon_server.runtime.sources import Move
from tryon_server.runtime.wardrobe import CAPACITY, Wardrobe, wardrobe_key
from tryon_server.runtime.worn_garment import alone
from tryon_server.sessions.commands import AllowFrame
from tryon_server.wording import in_parameters
from tryon_solver.body.model import default_body
from tryon_solver.body.pose import Pose
from tryon_solver.dressing import carry_over
from tryon_solver.dressing import dress as dressing
from tryon_solver.dressing.carry_over import CarryError
from tryon_solver.dressing.fit import DressingError
from tryon_solver.dressing.returned import REACHES
from tryon_solver.dressing.untangle import TangledError
from tryon_solver.geometry import piece_meshes
from tryon_solver.geometry.placement import PlacementError
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.plain import parse_edit

POSITIONS = np.arange(12, dtype=np.float32).reshape(4, 3)


@pytest.fixture
def order(tmp_path):
    capsule = trimesh.creation.capsule(height=0.6, radius=0.14, count=[16, 16])
    capsule.apply_transform(trimesh.transformations.rotation_matrix(-np.pi / 2, [1, 0, 0]))
    capsule.apply_translation([0, 0.75, 0])
    capsule.export(tmp_path / "capsule.ply")
    (tmp_path / "bag.json").write_bytes(patterns.as_bytes(patterns.bag(60.0, 40.0)))
    return DrapeOrder(
        pattern=tmp_path / "bag.json",
        fabric="cotton_jersey",
        preset="auto",
        device="cpu",
        edge_length=0.06,
        body=tmp_path / "capsule.ply",
        wardrobe=tmp_path / "dressed",
    )


def test_a_mesh_keeps_its_own_edges(order, tmp_path):
    (tmp_path / "skirt.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(ProblemError, match="simulated with the edges it comes with") as caught:
        production.build_drape(replace(order, pattern=tmp_path / "skirt.obj"), lambda *_: None)
    problem = caught.value.problem
    assert (problem.code, problem.place) == ("edge_length.of_mesh", "edge_length")
    assert problem.remedy == "Leave the edge length out, or remesh the garment before"


@pytest.mark.parametrize(("name", "called"), [("Grandmother's skirt", "Grandmother's skirt"), (None, "5ab1e5")])
def test_a_mesh_that_can_not_be_worn_is_named_as_its_owner_names_it(order, tmp_path, name, called):
    """Uploads lie in files that are named by what is in them."""
    path = tmp_path / "5ab1e5"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n")
    with pytest.raises(ProblemError) as caught:
        production.build_drape(replace(order, pattern=path, garment_name=name, edge_length=None), lambda *_: None)
    assert caught.value.problem.message.startswith(f"{called}, line 4: ")


@pytest.mark.parametrize(("name", "called"), [("Grandmother", "Grandmother"), (None, "5ab1e5")])
@pytest.mark.parametrize("hurt", [False, True])
def test_a_body_that_can_not_be_worn_on_is_named_as_its_owner_names_it(order, tmp_path, name, called, hurt):
    path = tmp_path / "5ab1e5"
    vertices = np.zeros((2, 3, 3))
    vertices[1, 2] = np.nan if hurt else 0.0
    with path.open("wb") as file:
        np.savez(file, vertices=vertices, faces=[[0, 1, 2]])
    with pytest.raises(ProblemError) as caught:
        production.build_drape(replace(order, body=path, body_name=name), lambda *_: None)
    assert caught.value.problem.message.startswith(f"{called}: ")
    assert "5ab1e5" not in caught.value.problem.message.replace(called, "")


@pytest.mark.parametrize("size", [0.9, None])
def test_a_mesh_has_no_sizes_not_even_one_to_be_found(order, tmp_path, size):
    path = tmp_path / "5ab1e5"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(ProblemError, match="worn in the size it comes in") as caught:
        production.build_drape(replace(order, pattern=path, size=size), lambda *_: None)
    assert (caught.value.problem.place, caught.value.problem.remedy) == ("size", "Leave the size out")


def test_a_size_that_is_looked_for_is_told_as_it_is_tried_and_hung_up_for_the_next_time(order, monkeypatch):
    told = []
    drape = production.build_drape(replace(order, size=None), lambda stage, _: told.append(stage))
    assert drape.outfit.size == 1.0
    assert "Sewing the seams in size 1" in told
    assert drape.notes[0].startswith("body: units and axes: m, Y up (as a closed surface is read that says nothing")
    assert drape.notes[1].startswith("garment: size 1")
    monkeypatch.setattr(production, "dress", lambda *_, **__: pytest.fail("it was dressed again"))
    assert production.build_drape(order, lambda *_: None).outfit.size == 1.0


@pytest.mark.long
def test_another_size_is_another_garment(order):
    """In the wardrobe, too: what hung there in the pattern's own size is not taken for it."""
    own, small = (production.build_drape(replace(order, size=size), lambda *_: None) for size in (1.0, 0.9))
    assert np.ptp(small.outfit.uv, axis=(0, 1)) == pytest.approx(0.9 * np.ptp(own.outfit.uv, axis=(0, 1)))
    assert small.outfit.vertex_count < own.outfit.vertex_count


@pytest.mark.parametrize(
    ("crumpled", "freed", "worn"),
    [
        pytest.param([True, False], False, True, marks=pytest.mark.long),
        pytest.param([True, True], True, True, marks=pytest.mark.long),
        ([True, True], False, False),
    ],
    ids=["sewn-once-more", "freed", "refused"],
)
def test_what_is_crumpled_at_a_seam_is_sewn_once_more_then_freed(order, monkeypatch, crumpled, freed, worn):
    """Whether the seams can be welded and what crosses be freed is said here; the sewing is the solver's."""
    sewn, freeings, free = iter(crumpled), [], dressing.untangle

    def untangle(simulation, rounds):
        freeings.append(simulation)
        if not freed:
            raise TangledError("3 triangles cross other triangles of the garment", np.arange(3))
        return free(simulation, rounds=rounds)

    monkeypatch.setattr(dressing, "_if_closed", lambda *_: None)  # asked at the end of each sewing alone
    monkeypatch.setattr(dressing, "proven_free", lambda *_: not next(sewn))
    monkeypatch.setattr(dressing, "untangle", untangle)
    if worn:
        drape = production.build_drape(replace(order, wardrobe=None), lambda *_: None)
        assert np.isfinite(drape.cloth_positions()).all()
    else:
        with pytest.raises(ProblemError, match="crumpled where it is sewn"):
            production.build_drape(replace(order, wardrobe=None), lambda *_: None)
    assert list(sewn) == []
    assert len(freeings) == all(crumpled)


def test_an_opening_that_slips_is_told(order):
    """A tube of 120 cm around a capsule of 88 cm, which holds it by nothing."""
    order.pattern.write_bytes(patterns.as_bytes(patterns.tube(60.0, 40.0)))
    drape = production.build_drape(replace(order, wardrobe=None), lambda *_: None)
    assert "the opening of front and back (120.0 cm) lies below the body" in drape.outfit.fit
    assert drape.notes[1:] == (f"fit: {drape.outfit.fit}",)


def test_garment_is_dressed_once_and_worn_again_as_it_hung(order, monkeypatch):
    told = []
    first = production.build_drape(order, lambda stage, _: told.append(stage))
    assert "Sewing the seams" in told
    hung, pressed = first.cloth_positions(), first.body_positions()
    assert isinstance(first.pose, Pose)
    facts = first.advance(Pose(first.pose.root + [0.0, 0.005, 0.0], first.pose.rotations), 1 / 60)
    assert facts.to_dict()["times_ms"], "who moves wakes what hangs still"
    assert not np.array_equal(first.cloth_positions(), hung), "it is simulated"

    monkeypatch.setattr(production, "dress", lambda *_, **__: pytest.fail("it was dressed again"))
    again = production.build_drape(order, lambda *_: None)
    np.testing.assert_array_equal(again.cloth_positions(), hung)
    np.testing.assert_array_equal(again.body_positions(), pressed)
    again.advance(again.pose, 1 / 60)
    np.testing.assert_allclose(again.cloth_positions(), hung, atol=0.01)
    assert again.outfit.vertex_count == len(hung)
    assert again.outfit.panel_names == ("front", "back")


def test_a_dressed_garment_goes_to_another_process_and_on_as_it_hung(order):
    drape = production.build_drape(order, lambda *_: None)
    *_, again = pickle.loads(pickle.dumps(drape.packed())).unpacking()
    np.testing.assert_array_equal(again.cloth_positions(), drape.cloth_positions())
    np.testing.assert_array_equal(again.body_positions(), drape.body_positions())
    assert (again.specification, again.outfit.notes) == (drape.specification, drape.outfit.notes)
    assert again.notes == drape.notes
    poses = [Pose(drape.pose.root + [0.0, 0.005 * k, 0.0], drape.pose.rotations) for k in range(1, 4)]
    for k, pose in enumerate(poses, 1):
        again.advance(pose, k / 60)
    assert np.abs(again.cloth_positions() - drape.cloth_positions()).max() > 0.005
    assert again.reshape(again.specification) == "", "it can be edited"


def test_a_garment_that_was_put_away_far_from_the_start_is_worn_again_there_and_in_its_shape(order):
    drape = production.build_drape(order, lambda *_: None)
    begun = drape.specification
    wide = apply(begun, parse_edit({"kind": "scale_piece", "panel": "front", "factors": [1.02, 1.0]})).specification
    away = np.array([40.0, 0.0, -20.0])
    drape.leap(away)
    assert drape.reshape(wide) == ""
    for k in range(1, 9):
        drape.advance(Pose(drape.pose.root + away + [0.0, 0.003 * k, 0.0], drape.pose.rotations), k / 60)
    hung, where = drape.cloth_positions() + drape.origin, drape.body_positions() + drape.origin
    *parts, again = pickle.loads(pickle.dumps(drape.packed())).unpacking(wide)
    assert set(parts) == {None}
    np.testing.assert_array_equal(again.cloth_positions() + again.origin, hung)
    np.testing.assert_array_equal(again.body_positions() + again.origin, where)
    np.testing.assert_allclose(again.pose.root, drape.pose.root + away + [0.0, 0.024, 0.0], atol=1e-9)
    shape, first = (it.simulation.scene.garment.uv_corners for it in (again, drape))
    np.testing.assert_array_equal(shape, first)
    assert again.specification == begun, "its mesh is of the pattern that it was made of"
    again.advance(again.pose, 1 / 60)
    assert np.abs(again.cloth_positions() + again.origin - hung).max() < 0.005
    assert again.reshape(begun) == "", "it is edited on"


def test_another_cut_is_meshed_elsewhere_and_put_on_in_parts_while_the_old_one_is_worn(order, monkeypatch):
    drape = production.build_drape(order, lambda *_: None)
    opened = apply(drape.specification, parse_edit({"kind": "open_seam", "panel": "front", "edge": 1})).specification
    assert "is sewn otherwise" in drape.reshape(opened)
    cut = pickle.loads(pickle.dumps(pickle.loads(pickle.dumps(drape.cutting(opened, order.fabric)))()))
    monkeypatch.setattr(piece_meshes, "triangulate", lambda *_: pytest.fail("both pieces were known"))
    drape.cutting(opened, order.fabric)()
    parts, seen = drape.recut(cut), []
    for k, part in enumerate(parts, 1):
        if part is None:
            drape.advance(Pose(drape.pose.root + [0.0, 0.02 * k, 0.0], drape.pose.rotations), k / 60)
        seen.append(part)
    assert seen[:-1] == [None] * (len(seen) - 1)
    assert len(seen) > 1
    worn = seen[-1]
    assert worn.specification == opened
    assert worn.outfit.vertex_count > drape.outfit.vertex_count
    np.testing.assert_array_equal(worn.body_positions(), drape.body_positions())
    nearest = cKDTree(drape.cloth_positions()).query(worn.cloth_positions())[0]
    assert nearest.max() < 0.01
    worn.advance(Pose(drape.pose.root + [0.0, 0.05, 0.0], drape.pose.rotations), len(seen) / 60)
    assert np.isfinite(worn.cloth_positions()).all()


def test_a_cut_that_is_drawn_together_takes_on_its_shape_over_time(order):
    """It is on its way until it has the pattern's own, and what is put away of it has that all the while."""
    drape = production.build_drape(order, lambda *_: None)
    dart = {"kind": "dart", "panel": "front", "edge": 0, "position": 0.5, "width": 0.06, "depth": 0.12}
    darted = apply(drape.specification, parse_edit(dart)).specification
    *_, worn = drape.recut(drape.cutting(darted, order.fabric)())
    shape, k = worn.simulation.scene.garment.uv_corners, 0
    while worn.on_the_way:
        k += 1
        worn.advance(worn.pose, k / 60)
        assert np.array_equal(worn.simulation.scene.garment.uv_corners, shape) is not worn.on_the_way
        np.testing.assert_array_equal(worn.packed().scene.garment.uv_corners, shape)
    assert 6 <= k < 30
    assert worn.reshape(darted) == ""


def test_another_fabric_is_put_on_where_the_garment_is_worn(order):
    drape = production.build_drape(order, lambda *_: None)
    drape.advance(Pose(drape.pose.root + [0.0, 0.01, 0.0], drape.pose.rotations), 1 / 60)
    cut = pickle.loads(pickle.dumps(drape.cutting(drape.specification, "denim")))()
    *_, worn = drape.recut(pickle.loads(pickle.dumps(cut)))
    assert drape.simulation.scene.fabric.name != "denim"
    assert worn.simulation.scene.fabric == FABRICS["denim"]
    assert worn.specification == drape.specification
    np.testing.assert_allclose(worn.cloth_positions(), drape.cloth_positions(), atol=3e-3)
    worn.advance(Pose(drape.pose.root + [0.0, 0.02, 0.0], drape.pose.rotations), 2 / 60)
    assert np.isfinite(worn.cloth_positions()).all()
    again = worn.cutting(worn.specification, order.fabric)()
    *_, back = worn.recut(again)
    assert back.simulation.scene.fabric == drape.simulation.scene.fabric


@pytest.mark.parametrize("serves", [True, False])
def test_what_comes_back_and_can_t_be_freed_is_tried_a_frame_later_giving_way_less_far(order, monkeypatch, serves):
    """Where the garment hung it is put on by either reach; where no reach serves, why the last did not is told."""
    drape = production.build_drape(order, lambda *_: None)
    cut, tried = drape.cutting(drape.specification, "denim")(), []

    def put_on(*those):
        *_, hung, reach = those
        assert hung is not None
        tried.append(reach)
        if reach > REACHES[-1] or not serves:
            error = CarryError(f"not by {reach:g}")
            error.came_back = True
            raise error
        return carry_over.put_on(*those)

    monkeypatch.setattr(solver_drape, "put_on", put_on)
    seen = [(made, [*tried]) for made in drape.recut(cut, drape.packed())]
    assert tried == [*REACHES]
    assert (None, [REACHES[0]]) in seen, "frames go by in between"
    assert (seen[-1][0] is not None) == serves
    assert drape.not_carried == ("" if serves else f"not by {REACHES[-1]:g}")


def test_where_nothing_comes_back_no_other_reach_is_tried(order, monkeypatch):
    drape = production.build_drape(order, lambda *_: None)
    cut, tried = drape.cutting(drape.specification, "denim")(), []

    def tangled(tangle, _):
        tried.append(tangle.most_rounds)
        raise CarryError("not so")

    monkeypatch.setattr(carry_over, "freed_where_worn", tangled)
    assert [made for made in drape.recut(cut, drape.packed()) if made is not None] == []
    assert tried == [carry_over.ROUNDS]
    assert drape.not_carried == "not so"


@pytest.mark.parametrize("kind", [PlacementError, DressingError])
def test_a_piece_that_does_not_fit_is_named_with_what_to_do_about_it(order, monkeypatch, kind):
    def nowhere(*_, **__):
        raise kind("the piece finds no place", "panels.back", "Move it away from the body")

    monkeypatch.setattr(production, "dress", nowhere)
    with pytest.raises(ProblemError) as caught:
        production.build_drape(order, lambda *_: None)
    problem = caught.value.problem
    assert (problem.code, problem.place, problem.remedy) == (
        "garment.unfit", "panels.back", "Move it away from the body",
    )  # fmt: skip
    assert "finds no place" in problem.message


@pytest.mark.parametrize("ending", ["ply", pytest.param("npz", marks=pytest.mark.long)])
@pytest.mark.parametrize(("scale", "size", "told"), [(0.6, 1.0, True), (0.6, 1.1, False), (0.9, 1.0, False)])
def test_a_garment_refused_by_a_child_says_that_it_is_one(order, monkeypatch, tmp_path, scale, size, told, ending):
    def too_wide(*_, **__):
        raise DressingError("the seam stays open", "panels.back", "Move it")

    monkeypatch.setattr(production, "dress", too_wide)
    grown_up, path = default_body(), tmp_path / f"child.{ending}"
    if ending == "ply":
        trimesh.Trimesh(scale * grown_up.rest_vertices, grown_up.faces, process=False).export(path)
    else:
        np.savez(path, vertices=scale * grown_up.rest_vertices[None], faces=grown_up.faces, units="m")
    with pytest.raises(ProblemError) as caught:
        production.build_drape(replace(order, body=path, size=size), lambda *_: None)
    tall = "; the body stands 1.03 m tall, and patterns are mostly drawn for about 1.72 m"
    assert caught.value.problem.message == f"the garment can't be put on: the seam stays open{tall if told else ''}"
    said = in_parameters(caught.value.problem).remedy
    assert said == ("Move it; or say size fit, which looks for a size that fits this body" if told else "Move it")


def published(drape, poses):
    """(frames, N, 3) float64 m: the cloth as a client decodes it, for poses 1/60 s apart."""
    publisher = Publisher(1.0, lambda: 0.0)
    decoder = FrameDecoder()
    told = publisher.dress(drape, Move(drape.pose, 0.0, 0.0, 0)).payload
    decoder.set_topology(Topology.from_message(decode_server(told)))
    frames = []
    for k, pose in enumerate(poses, 1):
        drape.advance(pose, k / 60)
        publisher.show(Move(pose, 1 / 60, k / 60, 0))
        publisher.allow(AllowFrame(k, keyframe=False, standalone=False, plain=False, again=False))
        frames.append(decoder.decode(publisher.publish().shared.data).cloth)
    return np.stack(frames)


@pytest.mark.long
def test_a_wearer_ten_kilometres_away_wears_the_same(order):
    """From dressing on: relative to the root, the cloth of both is the same to within the grid of the wire."""
    away = np.array([10_000.0, 0.0, 10_000.0])
    _, near, far = (production.build_drape(order, lambda *_: None) for _ in range(3))  # the first one dresses it
    way = np.array([0.02, 0.0, 0.005])
    poses = [Pose(near.pose.root + k * way, near.pose.rotations) for k in range(1, 13)]
    distant = [Pose(pose.root + away, pose.rotations) for pose in poses]
    far.leap(away)
    here, there = published(near, poses), published(far, distant)
    assert np.abs(here[-1] - here[0]).max() > 0.05, "it moves"
    assert np.abs(there - away - here).max() < 1e-4


def solver_that_records():
    """Stands for a dressed garment: notes the poses that the solver gets and how its origin was moved."""
    seen = SimpleNamespace(places=[], shifts=[])
    garment, _ = sheet(2, 2, 0.1, 0.1)
    simulation = SimpleNamespace(
        state=SimpleNamespace(time=2.0),
        scene=SimpleNamespace(garment=garment, fabric=FABRICS["cotton_jersey"], effects=()),
        body=SimpleNamespace(moving=small_body().on_device("cpu")),
        plan=SimpleNamespace(contributions=()),
        cloth_positions=lambda: np.zeros((garment.vertex_count, 3), np.float32),
        advance=lambda pose, _time, _longest_step: seen.places.append(np.array(pose.root)),
        move_origin=lambda by: seen.shifts.append(np.array(by)),
    )
    own = alone(simulation, ("all",), None)
    return solver_drape.SolverDrape(simulation, Pose.rest(small_body()), (own,), small_body()), seen


def test_the_solver_sees_a_few_metres_wherever_the_wearer_walks():
    drape, seen = solver_that_records()
    roots = np.cumsum(np.tile([0.07, 0.01, -0.13], (1000, 1)), axis=0)
    for k, root in enumerate(roots, 1):
        drape.advance(Pose(root, drape.pose.rotations), k / 60)
        np.testing.assert_allclose(drape.origin + seen.places[-1], root, rtol=0, atol=1e-9)
        assert np.abs(seen.places[-1]).max() <= solver_drape.FARTHEST
    assert 15 < len(seen.shifts) < 40, "it moves seldom"
    np.testing.assert_array_equal(sum(seen.shifts), drape.origin)
    assert (drape.origin == np.round(drape.origin)).all()


def test_key_of_the_wardrobe_changes_with_everything_that_has_a_say():
    body = small_body()
    keys = {
        wardrobe_key(b"pattern", body, ("cotton", 0.02)),
        wardrobe_key(b"another", body, ("cotton", 0.02)),
        wardrobe_key(b"pattern", body, ("denim", 0.02)),
        wardrobe_key(b"pattern", body, ("cotton", 0.03)),
        wardrobe_key(b"pattern", replace(body, rest_vertices=body.rest_vertices * 1.01), ("cotton", 0.02)),
    }
    assert len(keys) == 5
    assert wardrobe_key(b"pattern", small_body(), ("cotton", 0.02)) in keys


def test_wardrobe_gives_back_only_what_is_sound(tmp_path):
    wardrobe = Wardrobe(tmp_path / "dressed")
    assert wardrobe.recall("key", 4) is None
    wardrobe.keep("key", POSITIONS)
    np.testing.assert_array_equal(wardrobe.recall("key", 4), POSITIONS)
    assert wardrobe.recall("key", 5) is None
    wardrobe.keep("nan", POSITIONS * np.nan)
    assert wardrobe.recall("nan", 4) is None
    (tmp_path / "dressed" / "cut.npy").write_bytes(b"\x93NUMPY\x01")
    assert wardrobe.recall("cut", 4) is None


def test_wardrobe_makes_room_by_giving_up_the_longest_unused(tmp_path):
    wardrobe = Wardrobe(tmp_path)
    for k in range(CAPACITY + 1):
        wardrobe.keep(f"k{k}", POSITIONS)
        os.utime(tmp_path / f"k{k}.npy", (1000 + k, 1000 + k))
    wardrobe.recall("k1", 4)
    wardrobe.keep("last", POSITIONS)
    assert wardrobe.recall("k1", 4) is not None
    assert wardrobe.recall("k2", 4) is None


def test_mesh_file_becomes_a_body_that_stands_still(order):
    body = load_body(order.body)
    assert body.joint_names == ("body",)
    with pytest.raises(ProblemError, match=r"retargeting needs the rig"):
        load_motion("walk", body)


def test_folder_with_a_body_is_a_body(tmp_path):
    small_body().save(tmp_path / "body.npz")
    assert load_body(tmp_path).joint_names == small_body().joint_names
    assert load_body(tmp_path / "body.npz").joint_count == 3
    (tmp_path / "empty").mkdir()
    with pytest.raises(ProblemError, match=r"neither \.obj frames nor body\.npz"):
        load_body(tmp_path / "empty")


def test_demo_motions_are_listed_with_their_length_the_walk_first():
    motions = list_motions()
    assert motions[0].name == "walk"
    assert {"squat", "jumping_jack"} < {motion.name for motion in motions}
    assert all(0.5 < motion.seconds < 60.0 for motion in motions)


def test_a_share_of_the_cloth_is_stretched_by_more_than_its_fabric_bears(order):
    drape = production.build_drape(order, lambda _stage, _share: None)
    sim = drape.simulation
    assert drape.overstretched < 0.1
    x = sim.state.x.numpy()
    x[: sim.cloth_count] *= 2.0
    sim.state.x.assign(x)
    assert drape.overstretched == 1.0
