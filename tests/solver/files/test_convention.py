"""Units and axes are found where the evidence decides and asked for where it does not."""

import numpy as np
import pytest

from tryon_solver.body import default_body
from tryon_solver.files.convention import AXES, UNITS, Told, find_for_body, find_for_garment
from tryon_solver.files.raw_mesh import MeshFileError


def written(x, unit, up):
    """Our metres, Y up, as a file of that unit and axis has them."""
    turned = x if up == "y" else np.stack([x[:, 0], -x[:, 2], x[:, 1]], axis=1)
    return turned / UNITS[unit]


@pytest.mark.parametrize("up", AXES)
@pytest.mark.parametrize("unit", UNITS)
def test_a_body_is_read_back_from_any_unit_and_axis(unit, up):
    x = default_body().rest_vertices
    found = find_for_body(written(x, unit, up), Told(), "body.obj")
    assert (found.unit, found.up) == (unit, up)
    np.testing.assert_allclose(found.apply(written(x, unit, up)), x, atol=1e-9)


def test_a_body_of_no_size_is_asked_about():
    x = default_body().rest_vertices
    with pytest.raises(MeshFileError, match="in no unit we know"):
        find_for_body(x * 12.0, Told(), "body.obj")


def test_a_body_whose_axes_contradict_is_asked_about():
    """A column that stands on neither axis and is as deep as it is wide."""
    rng = np.random.default_rng(1)
    x = rng.uniform(-0.8, 0.8, (500, 3))
    with pytest.raises(MeshFileError, match="which axis is up") as caught:
        find_for_body(x, Told(), "body.obj")
    assert "--up" in caught.value.remedy
    assert find_for_body(x, Told(up="z", source="as told"), "body.obj").up == "z"


def test_a_unit_that_is_told_but_can_not_be_is_refused():
    x = default_body().rest_vertices
    with pytest.raises(MeshFileError, match=r"in m \(as told\).*172 m"):
        find_for_body(100 * x, Told("m", None), "body.obj")


@pytest.mark.parametrize(
    ("told", "words", "option"),
    [(Told("furlong"), "'furlong' is no unit", "--units"), (Told(up="x"), "'x' can't be up", "--up")],
)
def test_what_is_told_must_be_known(told, words, option):
    x = default_body().rest_vertices
    faces = default_body().faces
    with pytest.raises(MeshFileError, match=words) as caught:
        find_for_body(x, told, "body.obj")
    assert option in caught.value.remedy
    with pytest.raises(MeshFileError, match=words):
        find_for_garment(x, faces, x, told, None, "shirt.obj")


@pytest.mark.parametrize("up", AXES)
@pytest.mark.parametrize("unit", UNITS)
def test_a_garment_is_read_by_where_its_body_is(strangers, unit, up):
    x, _, quads, *_ = strangers.skirt()
    skin = default_body().rest_vertices
    found = find_for_garment(written(x, unit, up), quads[:, :3], skin, Told(), None, "skirt.obj")
    assert (found.unit, found.up) == (unit, up)


def test_a_garment_elsewhere_is_refused(strangers):
    x, _, quads, *_ = strangers.skirt()
    with pytest.raises(MeshFileError, match="not where the body is"):
        find_for_garment(np.add(x, [3.0, 0, 0]), quads[:, :3], default_body().rest_vertices, Told(), None, "skirt.obj")


def test_a_told_unit_is_not_doubted_but_checked(strangers):
    x, _, quads, *_ = strangers.skirt()
    skin = default_body().rest_vertices
    found = find_for_garment(100 * x, quads[:, :3], skin, Told("cm", "y"), None, "skirt.obj")
    assert "as told" in found.because
    with pytest.raises(MeshFileError, match="not where the body is"):
        find_for_garment(100 * x, quads[:, :3], skin, Told("m", "y"), None, "skirt.obj")
