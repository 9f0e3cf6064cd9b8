"""What is too large for a part of a person is named."""

import numpy as np
import pytest

from tryon_solver.body import default_body
from tryon_solver.files.raw_mesh import MeshFileError, RawMesh
from tryon_solver.files.surroundings import refuse_surroundings

BODY = default_body()


def scene(ground: float) -> RawMesh:
    """The body on a square, of which `ground` is half the side [m]."""
    corners = ground * np.array([[-1.0, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]])
    count = len(BODY.rest_vertices)
    faces = np.vstack([BODY.faces, count + np.array([[0, 2, 1], [0, 3, 2]])]).astype(np.int32)
    part = np.repeat([0, 1], [len(BODY.faces), 2]).astype(np.int32)
    vertices = np.vstack([BODY.rest_vertices, corners])
    none = np.empty((0, 2), np.int32)
    return RawMesh(vertices, faces, None, none, part, ("Body", "Ground"), np.arange(len(faces)), "triangle", "a.glb")


def test_a_floor_is_named_and_a_small_part_is_not():
    with pytest.raises(MeshFileError, match=r"more than a person: 'Ground' \(10 m\)") as caught:
        refuse_surroundings(scene(5.0))
    assert "Leave that out" in caught.value.remedy
    refuse_surroundings(scene(0.4))


def test_a_person_of_another_size_is_left_to_be_asked_about():
    """Where the rest is no person either, it is not the floor that is at fault."""
    whole = scene(5.0)
    refuse_surroundings(RawMesh(**{**whole.__dict__, "vertices": 100 * whole.vertices}))
