"""Unit and axis of a garment: by whether it is worn so, not by which reading is nearest."""

import numpy as np
import pytest
from sample_garments import BAND, DRESS, FULL_SKIRT, GOWN, MAXI_DRESS, SKIN, WORN, tube
from small_glb import plain

from tryon_solver.files.around import goes_through
from tryon_solver.files.convention import AXES, GLTF, UNITS, Told
from tryon_solver.files.garment_convention import find_for_garment
from tryon_solver.files.garment_file import read_garment
from tryon_solver.files.held import GOES_AROUND_NOTHING
from tryon_solver.files.raw_mesh import MeshFileError


def written(x, unit, up):
    x = x / UNITS[unit]
    return x if up == "y" else np.stack([x[:, 0], -x[:, 2], x[:, 1]], axis=1)


@pytest.mark.parametrize("up", AXES)
@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("shape", [FULL_SKIRT, DRESS, MAXI_DRESS, GOWN])
def test_wide_garments_are_not_read_as_their_shrunken_copies(shape, unit, up):
    x, faces = tube(*shape)
    found = find_for_garment(written(x, unit, up), faces, SKIN, Told(), None, "g.obj")
    assert (found.unit, found.up) == (unit, up)


def test_what_is_double_or_split_along_seams_has_its_openings_still():
    x, faces = tube(*FULL_SKIRT)
    for own, what in ((faces, x), (np.arange(faces.size).reshape(-1, 3), x[faces].reshape(-1, 3))):
        both = np.concatenate([own, own[:, ::-1]])
        assert find_for_garment(what, both, SKIN, Told(), None, "g.obj").unit == "m"


@pytest.mark.parametrize("slit", [1, 10, 20])
def test_a_gown_whose_openings_are_one_is_read_as_it_is_or_asked_about(slit):
    x, faces = tube(*GOWN, slit=slit)
    if slit == 20:
        assert find_for_garment(x, faces, SKIN, Told(), None, "g.obj").unit == "m"
    else:
        with pytest.raises(MeshFileError, match=r"can't be told: ft, Z up.* and m, Y up") as caught:
            find_for_garment(x, faces, SKIN, Told(), None, "g.obj")
        assert "--units" in caught.value.remedy
    assert find_for_garment(x, faces, SKIN, Told("m", "y"), None, "g.obj").unit == "m"


@pytest.mark.parametrize("shape", [GOWN, (0.17, 1.0, 1.06, 0.1), BAND])
def test_what_is_told_is_not_doubted_for_its_size(shape):
    x, faces = tube(*shape)
    for unit, up in (("m", "y"), ("cm", "z")):
        found = find_for_garment(written(x, unit, up), faces, SKIN, Told(unit, up), None, "g.obj")
        assert "as told" in found.because


def test_a_small_band_needs_its_unit_alone():
    x, faces = tube(*BAND)
    with pytest.raises(MeshFileError, match="none of") as caught:
        find_for_garment(x, faces, SKIN, Told(), None, "g.obj")
    assert "say its unit" in caught.value.remedy
    assert find_for_garment(x, faces, SKIN, Told("m"), None, "g.obj").up == "y"


def test_told_and_nowhere_near_is_refused_and_not_asked_for_again():
    x, faces = tube(*FULL_SKIRT)
    for told in (Told("cm", "y"), Told("mm", "z")):
        with pytest.raises(MeshFileError, match="not where the body is") as caught:
            find_for_garment(x, faces, SKIN, told, None, "g.obj")
        assert "say another unit and axis" in caught.value.remedy
    with pytest.raises(MeshFileError, match="0 % of it at the body"):
        find_for_garment(x + [3.0, 0, 0], faces, SKIN, Told("m", "y"), None, "g.obj")
    with pytest.raises(MeshFileError) as caught:
        find_for_garment(100 * x, faces, SKIN, GLTF, None, "g.glb")
    assert "say another unit and axis: it is worn with --units cm and --up y" in caught.value.remedy


@pytest.mark.parametrize("what", WORN)
def test_a_glb_whose_exporter_forgot_to_turn_it_is_refused_with_the_axis_that_has_it_worn(what):
    x, faces = WORN[what]
    assert find_for_garment(x, faces, SKIN, GLTF, None, "g.glb").up == "y"
    turned = written(x, "m", "z")
    with pytest.raises(MeshFileError, match=r"as glTF prescribes, m, Y up, it is not worn.*with Z up it is") as caught:
        find_for_garment(turned, faces, SKIN, GLTF, None, "g.glb")
    assert caught.value.remedy.startswith("Say --units m and --up z")
    assert find_for_garment(turned, faces, SKIN, Told("m", "z"), None, "g.glb").up == "z"


@pytest.mark.parametrize("slit", [1, 10, 20])
def test_a_glb_that_no_other_axis_would_have_worn_is_taken(slit):
    x, faces = tube(*GOWN, slit=slit)
    assert find_for_garment(x, faces, SKIN, GLTF, None, "g.glb").up == "y"


def towel(height):
    """(V, 3) m and (F, 3): flat, before the chest."""
    i, j = np.divmod(np.arange(24 * 30), 30)
    x = np.stack([0.018 * (i - 11.5), height + 0.016 * j, 0 * i + 0.16], axis=1)
    k = np.flatnonzero((i < 23) & (j < 29))
    return x, np.concatenate([np.stack([k, k + 30, k + 31], axis=1), np.stack([k, k + 31, k + 1], axis=1)])


def test_what_goes_around_nothing_is_taken_and_told():
    for content in (plain(*towel(0.9)), plain(*towel(0.1))):
        assert read_garment(content, "towel.glb", SKIN, Told()).notes[-1] == GOES_AROUND_NOTHING
    for what in ("a dress", "trousers", "a hat", "a sock"):
        assert GOES_AROUND_NOTHING not in read_garment(plain(*WORN[what]), "g.glb", SKIN, Told()).notes
    x, faces = WORN["trousers"]
    told = read_garment(plain(written(x, "m", "z"), faces), "g.glb", SKIN, Told("m", "y"))
    assert GOES_AROUND_NOTHING not in told.notes, "the feet are in its legs, and what is told is not doubted"
    x, faces = WORN["tights"]
    assert GOES_AROUND_NOTHING in read_garment(plain(written(x, "m", "z"), faces), "g.glb", SKIN, Told("m", "y")).notes


@pytest.mark.parametrize(
    ("shift", "through"), [((0, 0, 0), True), ((0, 0.62, 0), True), ((0.6, -0.4, 0), False), ((0, 0, 0.6), False)]
)
def test_a_loop_goes_around_the_body_only_where_there_is_body_on_both_sides_of_it(shift, through):
    angle = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    ring = np.stack([0.2 * np.cos(angle), 0 * angle + 1.05, 0.02 + 0.2 * np.sin(angle)], axis=1)
    assert goes_through(SKIN, ring + shift) == through
    before_the_toes = np.stack([0.2 * np.cos(angle), 0.1 + 0.2 * np.sin(angle), 0 * angle + 0.3], axis=1)
    assert not goes_through(SKIN, before_the_toes)
    assert not goes_through(SKIN, ring - [0, 1.1, 0]), "under the soles"
    assert not goes_through(SKIN, np.zeros((3, 3)))
