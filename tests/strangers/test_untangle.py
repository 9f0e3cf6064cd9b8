"""Garments that come crossing themselves or the body are freed, or refused with the triangles named; ipctk judges."""

import ipctk
import numpy as np
import pytest
from frame_judge import FrameJudge
from small_scenes import icosphere, rigid_body, sheet

from tryon_solver.body.pose import Pose
from tryon_solver.dressing.untangle import TangledError, _opposite_corners, untangle
from tryon_solver.files.convention import Convention
from tryon_solver.files.mesh_garment import make_garment
from tryon_solver.files.obj import parse_obj
from tryon_solver.files.self_crossing import crossing_notes
from tryon_solver.geometry.garment import Garment
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.scene import BodyContact, Scene, SelfContact
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build

SIZE, COUNT = 0.3, 25


def sheets(second):
    """Two square sheets: a flat one in y = 0, and one of the heights `second`(distances from corner and middle)."""
    u, v = np.meshgrid(*(np.linspace(0, SIZE, COUNT),) * 2, indexing="ij")
    uv = np.stack([u.ravel(), v.ravel()], axis=1)
    i, j = np.meshgrid(np.arange(COUNT - 1), np.arange(COUNT - 1), indexing="ij")
    a = (i * COUNT + j).ravel()
    faces = np.vstack(
        [np.stack([a, a + COUNT, a + COUNT + 1], axis=1), np.stack([a, a + COUNT + 1, a + 1], axis=1)]
    )
    flat = np.column_stack([uv[:, 0], np.zeros(len(uv)), uv[:, 1]])
    height = second(np.hypot(*uv.T), np.hypot(*(uv - SIZE / 2).T))
    other = np.column_stack([uv[:, 0] + 0.0531, height, uv[:, 1] + 0.0531])
    garment = Garment(
        np.vstack([faces, faces + len(uv)]).astype(np.int32),
        np.concatenate([uv[faces], uv[faces]]),
        np.repeat([0, 1], len(faces)).astype(np.int32),
        2 * len(uv),
    )
    return garment, np.vstack([flat, other])


def crossed(garment, x):
    mesh = ipctk.CollisionMesh(np.asfortranarray(x), ipctk.edges(garment.faces), np.asfortranarray(garment.faces))
    return ipctk.has_intersections(mesh, np.asfortranarray(x.astype(np.float64)))


def corner(depth):
    return lambda from_corner, _: 0.02 - (0.02 + depth) * np.clip(1 - from_corner / 0.12, 0, 1)


def bubble(depth):
    return lambda _, from_middle: 0.02 - (0.02 + depth) * np.exp(-((from_middle / 0.06) ** 2))


def flat(from_corner, _):
    return np.zeros_like(from_corner)


def flat_above(from_corner, _):
    return np.full_like(from_corner, 0.02)


@pytest.mark.parametrize("second", [corner(0.01), corner(0.03), bubble(0.005), bubble(0.02)])
def test_sheets_that_pass_through_each_other_are_drawn_apart(second):
    garment, x = sheets(second)
    assert crossed(garment, x)
    sim = build(Scene(garment, x, None, FABRICS["cotton_jersey"], (SelfContact(),)), PRESETS["draft"], tangled=True)
    told: list[float] = []
    freed = untangle(sim, told.append)
    assert freed.crossed_itself > 10
    assert len(told) > 3
    assert told == sorted(told)
    assert told[0] == 0.0
    assert 0.3 < told[-1] < 1.0
    assert not crossed(garment, sim.cloth_positions())
    # what could be freed is moved by what it had gone through and little more, and not torn
    assert freed.largest_move < 0.03
    corners = sim.cloth_positions().astype(np.float64)[garment.faces]
    came = x[garment.faces]
    ratio = np.linalg.norm(corners[:, [1, 2, 0]] - corners, axis=2) / np.linalg.norm(
        came[:, [1, 2, 0]] - came, axis=2
    )
    assert np.median(np.abs(ratio - 1)) < 0.02
    report = sim.advance(None, 1 / 30)
    assert report.retries == 0
    assert not crossed(garment, sim.cloth_positions())


def test_what_is_told_of_a_file_is_what_is_found_when_it_is_put_on():
    garment, x = sheets(bubble(0.02))
    text = ["v {} {} {}".format(*v) for v in x] + ["f {} {} {}".format(*face) for face in garment.faces + 1]
    mesh = make_garment(parse_obj("\n".join(text), "two.obj"), Convention("m", "y", "in a test"))
    (note,) = crossing_notes(mesh)
    scene = Scene(mesh.garment, mesh.x, None, FABRICS["cotton_jersey"], (SelfContact(),))
    freed = untangle(build(scene, PRESETS["draft"], tangled=True))
    assert note.startswith(f"it comes with {freed.crossed_itself} crossings of itself (two.obj, lines ")
    assert f"came with {freed.crossed_itself} crossings of itself" in freed.describe()


def test_sheets_that_cross_from_side_to_side_are_refused_by_triangle():
    """Nothing says which half belongs above."""
    garment, x = sheets(flat)
    x[COUNT**2 :, 1] = 0.4 * (x[COUNT**2 :, 0] - SIZE / 2)
    sim = build(Scene(garment, x, None, FABRICS["cotton_jersey"], (SelfContact(),)), PRESETS["draft"], tangled=True)
    with pytest.raises(TangledError, match="cross other triangles") as caught:
        untangle(sim)
    assert len(caught.value.faces) > 4
    middles = x[garment.faces].mean(axis=1)[caught.value.faces]
    assert np.abs(middles[:, 0] - SIZE / 2).max() < 0.1


def over_a_ball(drop):
    """A flat sheet that lies `drop` m below the top of a ball of 100 mm."""
    garment, x = sheets(flat)
    first = garment.faces[: len(garment.faces) // 2]
    one = Garment(first, garment.uv_corners[: len(first)], np.zeros(len(first), np.int32), COUNT**2)
    x = x[: COUNT**2] - [SIZE / 2, 0, SIZE / 2] + [0, 0.1 - drop, 0]
    return one, x, rigid_body(*icosphere(0.1, 4))


def test_a_sheet_sunk_into_a_body_is_laid_on_it():
    """The body yields at once and returns while the cloth settles, which it then carries."""
    garment, x, body = over_a_ball(0.02)
    pose = Pose.rest(body)
    scene = Scene(garment, x, body, FABRICS["cotton_jersey"], (BodyContact(), SelfContact()))
    sim = build(scene, PRESETS["draft"], "cpu", pose, tangled=True)
    judge = FrameJudge(garment.faces, body.faces, x, body.rest_vertices)
    assert not judge.judge(x, body.rest_vertices).clean
    freed = untangle(sim)
    assert freed.crossed_body > 10
    assert 0.02 < freed.deepest_dent < 0.04
    assert judge.judge(sim.cloth_positions(), sim.body_positions()).clean
    for k in range(15):
        report = sim.advance(pose, (k + 1) / 30)
        assert report.retries == 0
        assert judge.judge(sim.cloth_positions(), sim.body_positions()).clean
    assert report.body_lag < 1e-3
    assert sim.cloth_positions()[:, 1].max() > 0.099


def test_a_sheet_through_the_middle_of_a_body_is_refused():
    garment, x, body = over_a_ball(0.1)
    scene = Scene(garment, x, body, FABRICS["cotton_jersey"], (BodyContact(),))
    sim = build(scene, PRESETS["draft"], "cpu", Pose.rest(body), tangled=True)
    with pytest.raises(TangledError, match="too deeply"):
        untangle(sim)


def test_what_comes_free_is_left_as_it_is():
    garment, x = sheets(flat_above)
    sim = build(Scene(garment, x, None, FABRICS["cotton_jersey"], (SelfContact(),)), PRESETS["draft"], tangled=True)
    freed = untangle(sim)
    assert freed.describe() == "the garment came free of the body and of itself"
    np.testing.assert_array_equal(sim.cloth_positions(), x.astype(np.float32))


def test_corners_opposite_an_edge():
    """Of both triangles at it, in their order; -1 where there is only one."""
    garment = sheet(4, 3, 0.1, 0.1)[0]
    edges = garment.edges()
    wanted = [[v for face in garment.faces if set(edge) <= set(face) for v in face if v not in edge] for edge in edges]
    found = _opposite_corners(garment.faces, edges)
    assert [[v for v in row if v >= 0] for row in found.tolist()] == wanted
    assert {len(row) for row in wanted} == {1, 2}
    assert (found[:, 0] >= 0).all()
