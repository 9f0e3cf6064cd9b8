"""How fabrics look: the maps of each, and what the API tells of them."""

from __future__ import annotations

import zlib

import numpy as np
import pytest
from fastapi.testclient import TestClient
from live_server import make_app

from tryon_server.looks.dye import read_dye
from tryon_server.looks.maps import TEXELS, colours, face_colour, normals, roughness, tile_size
from tryon_server.looks.png import SIGNATURE, png
from tryon_server.looks.weave import COVERAGE, THREADS, tile_of
from tryon_server.problems import ProblemError
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.materials.look import Look

LOOKS = [pytest.param(fabric.look, id=fabric.name) for fabric in FABRICS.values()]
GREY = (0.2, 0.2, 0.2)


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    with TestClient(make_app(tmp_path_factory.mktemp("looks")), base_url="http://127.0.0.1") as client:
        yield client


def linear(pixels: np.ndarray) -> np.ndarray:
    """sRGB of 0 to 255 as linear RGB, by the definition."""
    seen = pixels / 255
    return np.where(seen <= 0.04045, seen / 12.92, ((seen + 0.055) / 1.055) ** 2.4)


def read_png(content: bytes) -> np.ndarray:
    """(rows, columns, 3) of a PNG whose rows are differences to the row above."""
    assert content[:8] == SIGNATURE
    at, packed = 8, b""
    width = height = 0
    while at < len(content):
        length, kind = int.from_bytes(content[at : at + 4], "big"), content[at + 4 : at + 8]
        body = content[at + 8 : at + 8 + length]
        assert int.from_bytes(content[at + 8 + length : at + 12 + length], "big") == zlib.crc32(kind + body)
        if kind == b"IHDR":
            width, height = int.from_bytes(body[:4], "big"), int.from_bytes(body[4:8], "big")
        packed += body if kind == b"IDAT" else b""
        at += 12 + length
    rows = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(height, 1 + 3 * width)
    assert (rows[:, 0] == 2).all()
    return np.cumsum(rows[:, 1:], axis=0, dtype=np.uint8).reshape(height, width, 3)


def test_a_written_picture_is_read_as_it_was():
    pixels = np.random.default_rng(3).integers(0, 256, (5, 7, 3), dtype=np.uint8)
    np.testing.assert_array_equal(read_png(png(pixels)), pixels)


@pytest.mark.parametrize("look", LOOKS)
def test_the_mean_of_the_colours_is_what_is_seen_from_afar(look):
    np.testing.assert_allclose(linear(colours(look)).mean(axis=(0, 1)), face_colour(look), atol=0.004)


@pytest.mark.parametrize("look", LOOKS)
def test_a_tile_goes_on_in_the_next_one(look):
    """Across its border neighbouring texels differ as they do within it."""
    height = tile_of(look).height
    for axis in (0, 1):
        steps = np.abs(np.diff(height, axis=axis)).mean(axis=1 - axis)
        border = np.abs(np.take(height, 0, axis) - np.take(height, -1, axis)).mean()
        assert steps.max() > 0
        assert border <= steps.max()


@pytest.mark.parametrize("look", LOOKS)
def test_normals_are_of_length_one_and_level_on_the_whole(look):
    normal = normals(look) / 127.5 - 1
    np.testing.assert_allclose(np.linalg.norm(normal, axis=-1), 1, atol=0.012)  # half a step of 1/127.5 each way
    assert normal[..., 2].min() > 0
    np.testing.assert_allclose(normal[..., :2].mean(axis=(0, 1)), 0, atol=0.03)
    assert normal[..., :2].std() > 0.02


def test_a_slope_that_rises_along_u_looks_the_other_way():
    """The normal of z = f(u, v) is (-df/du, -df/dv, 1); in a picture's rows v goes up."""
    look = Look("plain", unevenness=0.0, pitch=(1e-3, 1e-3))
    height, normal = np.flipud(tile_of(look).height), normals(look) / 127.5 - 1
    rising_u = np.roll(height, -1, 1) - np.roll(height, 1, 1)
    rising_v = np.roll(height, 1, 0) - np.roll(height, -1, 0)  # the row above has the larger v
    for rising, along in ((rising_u, normal[..., 0]), (rising_v, normal[..., 1])):
        steep = np.abs(rising) > 0.05
        assert steep.mean() > 0.1
        assert (np.sign(along[steep]) == -np.sign(rising[steep])).all()


@pytest.mark.parametrize("weave", sorted(COVERAGE))
def test_the_warp_covers_the_share_of_the_face_that_its_weave_says(weave):
    assert tile_of(Look(weave)).warp.mean() == COVERAGE[weave]


def test_twill_runs_up_to_the_right():
    """Where the weft shows in one row, it shows one thread to the right in the row of threads above."""
    weft = ~tile_of(Look("twill", unevenness=0.0)).warp
    thread = TEXELS // THREADS["twill"]
    np.testing.assert_array_equal(np.roll(weft[0], thread), weft[thread])
    assert weft[0].any()


def test_a_thread_is_as_thick_in_the_map_as_in_the_fabric():
    """Denim's 29 warp ends to the centimetre: so many crowns of a row in a tile of that length."""
    look = Look("plain", pitch=(0.34e-3, 0.5e-3), unevenness=0.0)
    row = tile_of(look).height[TEXELS // THREADS["plain"] // 2]
    crowns = ((row > np.roll(row, 1)) & (row >= np.roll(row, -1))).sum()
    assert tile_size(look)[0] / 0.34e-3 == pytest.approx(THREADS["plain"])
    assert crowns >= THREADS["plain"] / 2  # those of the warp on top


def test_a_dye_colours_the_warp_and_leaves_a_weft_of_its_own():
    red = (0.5, 0.01, 0.01)
    plain = face_colour(Look("plain", GREY), red)
    denim = face_colour(Look("twill", GREY, weft=(0.8, 0.8, 0.8)), red)
    assert plain == pytest.approx(red)
    assert denim == pytest.approx((0.75 * 0.5 + 0.2, 0.2075, 0.2075))


def test_a_dye_is_a_colour_of_the_web():
    assert read_dye(None) is None
    assert read_dye("ff0080") == pytest.approx((1.0, 0.0, 0.2158605))
    with pytest.raises(ProblemError) as caught:
        read_dye("reddish")
    assert (caught.value.problem.place, caught.value.status) == ("dye", 422)


def test_rough_fibres_lie_between_the_yarns():
    look = Look("plain", roughness=0.4, unevenness=0.0)
    rough, height = np.flipud(roughness(look))[..., 1] / 255, tile_of(look).height
    assert rough.min() == pytest.approx(0.4, abs=1 / 255)
    assert np.corrcoef(rough.ravel(), height.ravel())[0, 1] < -0.99


def test_lustre_is_that_of_the_yarns_crowns_and_cotton_has_none():
    shiny = np.flipud(roughness(Look("satin", lustre=0.4, unevenness=0.0)))[..., 2] / 255
    assert shiny.max() == pytest.approx(0.4, abs=1 / 255)
    assert shiny.min() < 0.2
    assert not roughness(Look("plain"))[..., 2].any()


@pytest.mark.parametrize(
    ("field", "value"), [("weave", "felt"), ("sheen", 1.5), ("colour", (2, 0, 0)), ("weft", (0, 0)), ("pitch", (0, 1))]
)
def test_a_look_that_can_not_be_is_refused_by_its_field(field, value):
    with pytest.raises(ValueError, match=field):
        Look(**{field: value})


def test_the_api_tells_of_the_maps_and_hands_them_out(client):
    fabric = client.get("/api/fabrics").json()[0]
    look = fabric["look"]
    assert look["tile"] == [pytest.approx(0.08), pytest.approx(0.08)]
    for path in (look["colour_map"], look["normal_map"], look["roughness_map"], look["colour_map"] + "?dye=aa0000"):
        reply = client.get(path)
        assert (reply.status_code, reply.headers["content-type"]) == (200, "image/png")
        assert read_png(reply.content).shape == (TEXELS, TEXELS, 3)


@pytest.mark.parametrize(
    ("path", "status", "place"),
    [("tweed/colour.png", 404, "fabric"), ("denim/colour.png?dye=blue", 422, "dye")],
)
def test_what_there_is_not_is_refused_by_name(client, path, status, place):
    reply = client.get(f"/api/fabrics/{path}")
    assert (reply.status_code, reply.json()["place"]) == (status, place)
    assert reply.json()["remedy"]
