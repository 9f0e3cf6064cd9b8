"""Two persons in one mesh are told; clothes, halves and what a person holds are none."""

import numpy as np
import pytest

from tryon_solver.body import default_body
from tryon_solver.files.convention import Told
from tryon_solver.files.mesh_body import make_body, still_frames
from tryon_solver.files.persons import refuse_several
from tryon_solver.files.raw_mesh import MeshFileError

BODY = default_body()


def together(*surfaces):
    """Surfaces (x, faces) as one mesh."""
    starts = np.cumsum([0, *(len(x) for x, _ in surfaces)])
    faces = [faces + start for (_, faces), start in zip(surfaces, starts)]
    return np.concatenate([x for x, _ in surfaces]), np.concatenate(faces)


def person(aside=0.0, scale=1.0):
    return scale * BODY.rest_vertices + [aside, 0.0, 0.0], BODY.faces


def cylinder(radius, height, aside):
    """A closed one that stands at `aside` m."""
    corners = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    ring = radius * np.stack([np.cos(corners), 0 * corners, np.sin(corners)], axis=1)
    x = np.concatenate([ring, ring + [0, height, 0], [[0, 0, 0], [0, height, 0]]]) + [aside, 0, 0]
    faces = []
    for k in range(12):
        n = (k + 1) % 12
        faces += [[k, 12 + k, n], [n, 12 + k, 12 + n], [24, k, n], [25, 12 + n, 12 + k]]
    return x, np.array(faces)


def half(sign):
    """What is of one side, never joined to the other."""
    faces = BODY.faces[(sign * BODY.rest_vertices[BODY.faces, 0]).mean(axis=1) > 0]
    return BODY.rest_vertices + [sign * 0.01, 0, 0], faces


@pytest.mark.parametrize(
    ("aside", "scale"),
    [
        (0.8, 1.0),
        pytest.param(-1.5, 1.0, marks=pytest.mark.long),
        pytest.param(0.4, 1.0, marks=pytest.mark.long),
        (0.7, 0.65),
    ],
)
def test_two_persons_are_refused_a_grown_up_with_a_child_too(aside, scale):
    x, faces = together(person(), person(aside, scale))
    with pytest.raises(MeshFileError, match="it holds 2 persons: parts as tall as a person, side by side") as caught:
        make_body(still_frames(x, faces, Told("m", "y"), "couple.obj"))
    assert (caught.value.place, caught.value.remedy) == ("couple.obj", "Export one of them")


@pytest.mark.parametrize(
    "more",
    [
        (person(0.03, 1.02),),  # what is worn, as a suit
        (cylinder(0.015, 1.7, 0.5),),  # a staff
        (cylinder(0.3, 0.8, 0.9),),  # a stool
    ],
)
def test_what_a_person_wears_or_holds_is_none(more):
    refuse_several(*together(person(), *more), "scene.glb")


def test_halves_that_were_never_joined_are_one_person():
    refuse_several(*together(half(1), half(-1)), "halves.obj")


def test_a_body_that_lies_in_parts_is_one_person():
    x, faces = together(cylinder(0.15, 0.9, 0.0), cylinder(0.1, 0.8, 0.4))
    refuse_several(x[:, [1, 0, 2]], faces, "doll.obj")
