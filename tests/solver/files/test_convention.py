"""Units and axes are found where the evidence decides and asked for where it does not."""

import numpy as np
import pytest

from tryon_solver.body import default_body
from tryon_solver.body.pose import skin
from tryon_solver.files.convention import (
    AXES,
    BODY_AXES,
    FACINGS,
    UNITS,
    Convention,
    Told,
    find_for_body,
)
from tryon_solver.files.garment_convention import find_for_garment
from tryon_solver.files.raw_mesh import MeshFileError


def written(x, unit, up):
    """Our metres, Y up, as a file of that unit and axis has them."""
    turned = {"y": x, "z": np.stack([x[:, 0], -x[:, 2], x[:, 1]], axis=1), "x": x[:, [1, 2, 0]]}[up]
    return turned / UNITS[unit]


@pytest.mark.parametrize("up", BODY_AXES)
@pytest.mark.parametrize("unit", UNITS)
def test_a_body_is_read_back_from_any_unit_and_axis(unit, up):
    x = default_body().rest_vertices
    found = find_for_body(written(x, unit, up), Told(), "body.obj")
    assert (found.unit, found.up) == (unit, up)
    np.testing.assert_allclose(found.apply(written(x, unit, up)), x, atol=1e-9)


ABOUT = [np.linalg.matrix_power([[0, 0, 1], [0, 1, 0], [-1, 0, 0]], k) for k in range(4)]  # quarter turns


@pytest.mark.parametrize("turn", ABOUT)
@pytest.mark.parametrize("lifted", [0.0, -0.9])
@pytest.mark.parametrize("told", [Told(), Told(up="x")])
def test_a_body_with_x_up_faces_where_its_toes_point(turn, lifted, told):
    """Whether it stands on x = 0 or has its middle there, and whichever way round it is."""
    x = default_body().rest_vertices
    strange = np.add(x @ turn.T, [0.0, lifted, 0.0])
    found = find_for_body(written(strange, "cm", "x"), told, "body.obj")
    assert (found.unit, found.up) == ("cm", "x")
    assert "it faces where its toes point" in found.because
    np.testing.assert_allclose(found.apply(written(strange, "cm", "x")), np.add(x, [0.0, lifted, 0.0]), atol=1e-9)


def test_a_body_with_x_up_whose_feet_do_not_tell_where_it_faces_is_refused():
    x = default_body().rest_vertices
    without_feet = x[x[:, 1] > 0.2]
    with pytest.raises(MeshFileError, match=r"X is up .* feet don't tell which way it faces") as caught:
        find_for_body(written(without_feet, "m", "x"), Told(), "body.obj")
    assert caught.value.remedy == "Say it with --body-facing, or turn it so that y or z is up"


@pytest.mark.parametrize("turn", ABOUT)
def test_a_body_faces_where_it_is_told_to(turn):
    """With X up its toes are not asked then; along the upward axis nobody faces."""
    x = default_body().rest_vertices
    without_feet = x[x[:, 1] > 0.2]
    strange = written(without_feet @ turn.T, "m", "x")
    ahead = written(np.array([[0.0, 0.0, 1.0]]) @ turn.T, "m", "x")[0]
    told = next(name for name, axis in FACINGS.items() if np.array_equal(axis, ahead))
    found = find_for_body(strange, Told(facing=told), "body.obj")
    np.testing.assert_allclose(found.apply(strange), without_feet, atol=1e-9)
    np.testing.assert_allclose(found.direction(told), [0.0, 0.0, 1.0], atol=1e-9)
    for up, axis in (("y", "-y"), ("z", "z"), ("x", "x")):
        with pytest.raises(MeshFileError, match=f"it can't face along {axis}, as told: {up} is up") as caught:
            find_for_body(written(x, "m", up), Told(facing=axis), "body.obj")
        assert "--body-facing" in caught.value.remedy
    with pytest.raises(MeshFileError, match="'w' is no axis to face along") as caught:
        find_for_body(x, Told(facing="w"), "body.obj")
    assert "--body-facing" in caught.value.remedy


def test_what_is_up_does_not_hang_on_arms(strangers):
    """Arms out as far as the body is tall, or down, on the floor or not: y is not taken for x."""
    body = default_body()
    motion = strangers.motion_from_rest(body, "squat", 1.0)
    for x in (skin(body, motion.pose(k)) for k in (0, 20, 29)):
        for up in AXES:
            assert find_for_body(written(x - [0.0, 0.9, 0.0], "m", up), Told(), "body.obj").up == up


def test_a_garment_with_x_up_is_read_as_its_body_is_and_by_itself_refused(strangers):
    """Front and back of a skirt are alike: nothing but its body says how it is turned."""
    x, _, quads, *_ = strangers.skirt()
    skin_of = default_body().rest_vertices
    body = find_for_body(written(skin_of, "cm", "x"), Told(), "body.obj")
    for told in (Told(), Told(up="x")):
        found = find_for_garment(written(x, "cm", "x"), quads[:, :3], skin_of, told, body, "skirt.obj")
        assert (found.unit, found.up, found.turns) == ("cm", "x", body.turns)
        np.testing.assert_allclose(found.apply(written(x, "cm", "x")), x, atol=1e-9)
    with pytest.raises(MeshFileError, match="not where the body is"):
        find_for_garment(written(x, "cm", "x"), quads[:, :3], skin_of, Told(), None, "skirt.obj")
    with pytest.raises(MeshFileError, match="'x' can't be up, only y or z can"):
        find_for_garment(written(x, "cm", "x"), quads[:, :3], skin_of, Told(up="x"), None, "skirt.obj")


@pytest.mark.parametrize("turns", range(4))
def test_no_reading_mirrors(turns):
    for up in BODY_AXES:
        axes = Convention("m", up, "in a test", turns).apply(np.eye(3))
        assert np.linalg.det(axes) == pytest.approx(1.0)


def test_a_body_of_no_size_is_asked_about():
    x = default_body().rest_vertices
    with pytest.raises(MeshFileError, match="in no unit we know"):
        find_for_body(x * 8.0, Told(), "body.obj")


@pytest.mark.parametrize(
    ("tall", "taken", "otherwise"),
    [
        (0.60, "in", "0.60 m in cm"),  # as likely a grown-up of 1.52 m
        (0.85, "cm", "2.16 m in in"),
        (1.20, "cm", ""),
        (2.25, "cm", ""),
    ],
)
def test_a_child_is_no_giant_and_where_two_units_fit_the_other_is_told(tall, taken, otherwise):
    """Of somebody so tall, in a file in centimetres."""
    x = default_body().rest_vertices
    x = x * (100 * tall / np.ptp(x[:, 1]))
    found = find_for_body(x, Told(), "body.obj")
    assert found.unit == taken
    said = f", and could also be {otherwise}: --body-units tells" if otherwise else " m; "
    assert said in found.because
    assert found.others == (("cm",) if taken == "in" else ("in",) if otherwise else ())
    told = find_for_body(x, Told("cm"), "body.obj")
    assert (told.unit, told.others) == ("cm", ())


def test_a_child_in_metres_is_read_and_what_its_owner_tells_is_believed_further():
    x = default_body().rest_vertices
    assert find_for_body(0.5 * x, Told(), "body.obj").unit == "m"
    doll = 0.2 * x
    assert find_for_body(doll, Told("m"), "doll.obj").unit == "m"
    with pytest.raises(MeshFileError, match=r"in m \(as glTF prescribes\).*0\.344 m, no human's"):
        find_for_body(doll, Told("m", "y", "as glTF prescribes"), "doll.glb")


def test_a_body_whose_axes_contradict_is_asked_about():
    """A column that stands on neither axis and is as deep as it is wide."""
    rng = np.random.default_rng(1)
    x = rng.uniform(-0.8, 0.8, (500, 3))
    with pytest.raises(MeshFileError, match="which axis is up") as caught:
        find_for_body(x, Told(), "body.obj")
    assert "--body-up" in caught.value.remedy
    assert find_for_body(x, Told(up="z", source="as told"), "body.obj").up == "z"


def test_a_unit_that_is_told_but_can_not_be_is_refused():
    x = default_body().rest_vertices
    with pytest.raises(MeshFileError, match=r"in m \(as told\).*172 m"):
        find_for_body(100 * x, Told("m", None), "body.obj")


@pytest.mark.parametrize(
    ("told", "words", "option"),
    [(Told("furlong"), "'furlong' is no unit", "units"), (Told(up="w"), "'w' can't be up", "up")],
)
def test_what_is_told_must_be_known(told, words, option):
    x = default_body().rest_vertices
    faces = default_body().faces
    with pytest.raises(MeshFileError, match=words) as caught:
        find_for_body(x, told, "body.obj")
    assert f"--body-{option}" in caught.value.remedy
    with pytest.raises(MeshFileError, match=words) as caught:
        find_for_garment(x, faces, x, told, None, "shirt.obj")
    assert f"--{option}" in caught.value.remedy


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


def test_a_figure_too_large_for_people_says_that_it_could_be_one():
    """A giant of 2.72 m: a child of 0.83 m in feet, which is told with what else it may be."""
    rest = default_body().rest_vertices
    x = rest * (2.72 / np.ptp(rest, axis=0).max())
    found = find_for_body(x, Told(up="y"), "giant.obj")
    assert found.unit == "ft"
    assert "2.72 m in m: --body-units tells" in found.describe()
