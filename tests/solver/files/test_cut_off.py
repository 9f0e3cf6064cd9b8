"""Half a person is told from a whole one with holes."""

import numpy as np
import pytest
import trimesh

from tryon_solver.body import default_body
from tryon_solver.files.convention import Told
from tryon_solver.files.cut_off import cut_off
from tryon_solver.files.mesh_body import RawFrames, make_body
from tryon_solver.files.raw_mesh import MeshFileError
from tryon_solver.files.standing import find_stand
from tryon_solver.geometry.boundary_loops import boundary_loops

BODY = default_body()
REST = BODY.rest_vertices
X, Y, Z = REST.T
HEAD, LEGS = "where a head should be", "where legs and feet should be"


def part(kept):
    """Vertices and faces of the body's surface where all corners are among those that are kept (B,)."""
    used, faces = np.unique(BODY.faces[kept[BODY.faces].all(axis=1)], return_inverse=True)
    return REST[used], faces.reshape(-1, 3)


@pytest.mark.parametrize(
    ("kept", "told"),
    [
        (Y < 1.47, "it is cut off: above it ends in an open rim, 0.48 m around, where a head should be"),
        pytest.param(Y + 0.6 * Z < 1.49, HEAD, marks=pytest.mark.long),
        (Y > 0.85, "it is cut off: below it ends in an open rim, 1.13 m around, where legs and feet should be"),
        (Y > 0.45, LEGS),
    ],
    ids=["neck", "slanting", "hips", "knees"],
)
def test_the_end_that_is_missing_is_named(kept, told):
    x, faces = part(kept)
    assert told in cut_off(x, faces)
    assert not (HEAD in cut_off(x, faces) and LEGS in cut_off(x, faces))
    body = make_body(RawFrames(x[None].astype(np.float32), faces, 1 / 30, Told(), "a.npz", ()))
    assert body.cut_off in body.notes
    assert told in body.cut_off


def test_both_ends_may_be_missing():
    said = cut_off(*part((Y > 0.8) & (Y < 1.45)))
    assert HEAD in said
    assert LEGS in said


@pytest.mark.parametrize(
    "kept",
    [Y > -1.0, Y > 0.1, np.abs(REST[:, 0]) < 0.45, np.linalg.norm(REST - [0.0, 1.62, 0.15], axis=1) > 0.06],
    ids=["whole", "ankles", "hands", "face"],
)
def test_holes_elsewhere_leave_a_person_whole(kept):
    assert cut_off(*part(kept)) == ""


def test_a_surface_that_is_no_manifold_is_not_asked():
    x, faces = part(Y < 1.47)
    top = int(x[:, 1].argmax())
    fins = [[top, int(faces[(faces == top).any(axis=1)][0][0]), k] for k in (5, 6, 7)]
    assert cut_off(x, np.vstack([faces, fins])) == ""


def capped(kept, flat=True):
    """The part, each of its rims closed by a fan: in the rim's own plane, or as the rim's zigzag has it."""
    x, faces = part(kept)
    for loop in boundary_loops(faces):
        middle = x[loop].mean(axis=0)
        if flat:
            normal = np.linalg.svd(x[loop] - middle)[2][2]
            x[loop] -= np.outer((x[loop] - middle) @ normal, normal)
        fan = np.stack([np.roll(loop, -1), loop, np.full(len(loop), len(x))], axis=1)
        x, faces = np.vstack([x, middle]), np.vstack([faces, fan])
    assert trimesh.Trimesh(x, faces, process=False).is_watertight
    return x, faces


TORSO = (Y > 0.85) & (Y < 1.47) & (np.abs(X) < 0.2)


@pytest.mark.parametrize(
    ("kept", "head", "legs"),
    [
        (Y < 1.47, True, False),
        (Y + 0.6 * Z < 1.49, True, False),
        (Y < 1.3, True, False),
        (Y < 1.05, True, False),
        (Y > 0.85, False, True),
        (Y > 1.2, False, True),
        (Y > 0.45, False, True),
        ((Y > 0.85) & (Y < 1.47), True, True),
        (TORSO, True, True),
    ],
    ids=["neck", "slanting", "chest", "waist", "hips", "bust", "knees", "with arms", "torso"],
)
@pytest.mark.parametrize("size", [0.6, 1.0])
def test_an_end_that_is_capped_is_told_as_an_open_one_is(kept, head, legs, size):
    x, faces = capped(kept)
    said = cut_off(size * x, faces)
    assert (HEAD in said) == head
    assert (LEGS in said) == legs
    assert "ends in a flat cap of " in said
    assert "rim" not in said


def test_a_cap_whose_rim_follows_the_edges_of_the_mesh_is_told():
    assert LEGS in cut_off(*capped((Y > 0.85) & (Y < 1.47), flat=False))


def with_part(shape, at):
    return np.vstack([REST, shape.vertices + at]), np.vstack([BODY.faces, shape.faces + len(REST)])


UPRIGHT = trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0])
HAT = trimesh.creation.cylinder(0.1, 0.15, transform=UPRIGHT)
SHOES = trimesh.util.concatenate(
    [trimesh.creation.box([0.1, 0.08, 0.3]).apply_translation([side, 0.02, 0.07]) for side in (-0.19, 0.19)]
)


@pytest.mark.parametrize(
    ("x", "faces"),
    [
        (REST, BODY.faces),
        (0.5 * REST, BODY.faces),
        capped(Y > 0.1),
        capped(np.abs(X) < 0.45),
        *(with_part(trimesh.creation.icosphere(3, size), [0.0, 1.6, 0.05]) for size in (0.1, 0.13, 0.16, 0.2)),
        with_part(HAT, [0.0, 1.75, 0.05]),
        with_part(SHOES, [0.0, 0.0, 0.0]),
    ],
    ids=["whole", "child", "ankles", "hands", *(f"hair {k}" for k in range(4)), "top hat", "flat soles"],
)
def test_who_is_whole_has_no_caps(x, faces):
    assert cut_off(x, faces) == ""


def read(x, faces, told=Told()):  # noqa: B008
    return make_body(RawFrames(x[None].astype(np.float32), faces, 1 / 30, told, "torso.obj", ()))


@pytest.mark.parametrize("unit", [1.0, 100.0, 1000.0])
@pytest.mark.parametrize("lifted", [0.0, -0.85, -1.16])
def test_a_mannequins_torso_is_put_where_patterns_expect_a_neck(unit, lifted):
    """In place, on the floor or about the origin: it has no legs to stand on, and is no grown-up in inches."""
    x, faces = capped(TORSO)
    body = read(unit * np.add(x, [0.0, lifted, 0.0]), faces)
    placed = body.for_patterns()
    assert body.lacks == {"head", "legs"}
    assert body.convention.metres_per_unit == 1.0 / unit
    assert body.cut_off in placed.notes
    np.testing.assert_allclose(placed.sequence.rest_vertices.max(axis=0), x.max(axis=0), atol=0.02)
    assert "it has no legs to stand on: taken to face +Z, --body-facing says otherwise" in placed.notes[-1]
    assert ("raised by" in placed.notes[-1]) == (lifted != 0.0)
    with pytest.raises(MeshFileError) if lifted < -1.0 else np.errstate():
        find_stand(np.add(x, [0.0, lifted, 0.0]), faces, "torso.obj")


def test_a_torso_faces_where_it_is_told_to():
    x, faces = capped(TORSO)
    turned = np.add(x, [1.0, 0.0, 1.0])[:, [2, 1, 0]] * [1.0, 1.0, -1.0]  # +Z is +X now
    placed = read(turned, faces, Told(facing="x")).for_patterns()
    np.testing.assert_allclose(placed.sequence.rest_vertices.max(axis=0), x.max(axis=0), atol=0.05)
    assert "turned by 90° about the vertical, to face +Z (as told); moved by 1.4" in placed.notes[-1]


def test_arms_held_out_do_not_make_half_a_person_lie():
    x, faces = capped(Y > 0.85)
    assert read(x, faces).convention.up == "y"
