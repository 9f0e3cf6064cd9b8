"""Unit and axis of a garment: by whether it is worn so, not by which reading is nearest."""

import numpy as np
import pytest

from tryon_solver.body import default_body
from tryon_solver.files.convention import AXES, UNITS, Told
from tryon_solver.files.garment_convention import find_for_garment
from tryon_solver.files.raw_mesh import MeshFileError

SKIN = default_body().rest_vertices
COLUMNS, ROWS = 40, 24
FULL_SKIRT = (0.17, 0.55, 1.06, 0.62)  # m: radii above and below, heights
DRESS = (0.2, 0.3, 1.35, 0.6)
MAXI_DRESS = (0.2, 0.35, 1.3, 0.1)
GOWN = (0.17, 0.7, 1.06, 0.1)
BAND = (0.17, 0.175, 1.06, 0.985)


def tube(r0, r1, y0, y1, slit=False):
    """(V, 3) m and (F, 3): a cone around the body's hips, along one line of which nothing is joined when it is slit."""
    s, a = np.meshgrid(np.linspace(0, 1, ROWS), np.linspace(0, 2 * np.pi, COLUMNS, endpoint=False), indexing="ij")
    r = r0 + s * (r1 - r0)
    x = np.stack([r * np.cos(a), y0 + s * (y1 - y0), 0.035 + r * np.sin(a)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(ROWS - 1), np.arange(COLUMNS - slit), indexing="ij")
    k, right = (i * COLUMNS + j).ravel(), (i * COLUMNS + (j + 1) % COLUMNS).ravel()
    return x, np.concatenate(
        [np.stack([k, right, right + COLUMNS], axis=1), np.stack([k, right + COLUMNS, k + COLUMNS], axis=1)]
    )


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
