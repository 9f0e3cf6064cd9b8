"""Half a person is told from a whole one with holes."""

import numpy as np
import pytest

from tryon_solver.body import default_body
from tryon_solver.files.convention import Told
from tryon_solver.files.cut_off import cut_off
from tryon_solver.files.mesh_body import RawFrames, make_body

BODY = default_body()
REST = BODY.rest_vertices
Y, Z = REST[:, 1], REST[:, 2]
HEAD, LEGS = "where a head should be", "where legs and feet should be"


def part(kept):
    """Vertices and faces of the body's surface where all corners are among those that are kept (B,)."""
    used, faces = np.unique(BODY.faces[kept[BODY.faces].all(axis=1)], return_inverse=True)
    return REST[used], faces.reshape(-1, 3)


@pytest.mark.parametrize(
    ("kept", "told"),
    [
        (Y < 1.47, "it is cut off: above it ends in an open rim, 0.48 m around, where a head should be"),
        (Y + 0.6 * Z < 1.49, HEAD),
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
