"""Prints: what is read of a picture, what is refused with its remedy, and how they are kept."""

from __future__ import annotations

import struct
import zlib

import numpy as np
import pytest
from fastapi.testclient import TestClient
from live_server import make_app

from tryon_server.looks.picture import Picture, read_picture
from tryon_server.looks.png import SIGNATURE, chunk, png
from tryon_server.problems import ProblemError

CHECKS = np.indices((24, 36)).sum(0) % 2  # rows, columns
PICTURE = png(np.repeat((255 * CHECKS).astype(np.uint8)[..., None], 3, axis=2))


def a_png(
    width: int,
    height: int,
    depth: int,
    colour: int,
    interlaced: int = 0,
    size: int = 0,
    filled: int = 0,
    palette: int = 6,
) -> bytes:
    """A PNG of that header with `size` bytes of pixels, all `filled`, and a palette of so many bytes if it asks for
    one."""
    header = struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, interlaced)
    colours = chunk(b"PLTE", bytes(palette)) if colour == 3 and palette else b""
    pixels = zlib.compress(bytes([filled]) * size)
    return SIGNATURE + chunk(b"IHDR", header) + colours + chunk(b"IDAT", pixels) + chunk(b"IEND", b"")


def a_jpeg(frame: int = 0xC0, bits: int = 8, height: int = 24, width: int = 36, colours: int = 3, end=b"\xff\xd9"):
    """The segments of a JPEG with nothing in its tables or its scan."""
    head = struct.pack(">BHHB", bits, height, width, colours) + bytes(3 * colours)
    start = b"\xff\xd8" + b"\xff\xe0" + struct.pack(">H", 16) + b"JFIF\0" + bytes(9)
    return start + bytes([0xFF, frame]) + struct.pack(">H", 2 + len(head)) + head + b"\xff\xda\0\2" + b"pixels" + end


def test_a_picture_is_told_by_its_own_bytes():
    assert read_picture(PICTURE) == Picture("image/png", 36, 24)
    assert read_picture(a_jpeg()) == Picture("image/jpeg", 36, 24)
    assert read_picture(a_jpeg(0xC2, colours=1)) == Picture("image/jpeg", 36, 24)


@pytest.mark.parametrize(
    ("depth", "colour", "interlaced", "size"),
    [
        (8, 6, 0, 10 * (1 + 4 * 9)),
        (1, 0, 0, 10 * (1 + 2)),
        (16, 2, 0, 10 * (1 + 6 * 9)),
        # Adam7's passes of 9 x 10: 2x2, 1x2, 3x1, 2x3, 5x2, 4x5, 9x5, a filter byte a row
        (8, 3, 1, 2 * 3 + 2 * 2 + 1 * 4 + 3 * 3 + 2 * 6 + 5 * 5 + 5 * 10),
    ],
)
def test_a_png_has_as_many_pixels_as_its_header_says(depth, colour, interlaced, size):
    assert read_picture(a_png(9, 10, depth, colour, interlaced, size)) == Picture("image/png", 9, 10)
    for other in (size - 1, size + 1):
        with pytest.raises(ProblemError, match="bytes than its header says"):
            read_picture(a_png(9, 10, depth, colour, interlaced, other))


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"GIF89a", "neither PNG nor JPEG"),
        (PICTURE[:-20], "damaged|cut off"),
        (PICTURE[:60] + b"?" + PICTURE[61:], "damaged"),
        (a_png(9, 10, 3, 2), "colour type 2 with 3 bits"),
        (a_jpeg()[:30], "cut off"),
        (a_jpeg(end=b""), "cut off"),
        (a_jpeg(0xC3), "lossless"),
        (a_jpeg(colours=4), "4 colours"),
        (a_jpeg(width=0), "0 pixels wide"),
        (a_png(5000, 10, 8, 2), "5000 pixels wide"),
        (a_png(9, 2, 8, 2), "2 pixels high"),
        (a_png(9, 10, 8, 3, size=100, palette=0), "palette .PLTE., and that has 0 bytes"),
        (a_png(9, 10, 1, 3, size=30, palette=9), "palette .PLTE., and that has 9 bytes"),
        (a_png(9, 10, 8, 0, size=100, filled=5), "none of PNG's 5 filters"),
    ],
)
def test_what_can_not_be_shown_is_refused_with_what_to_do(content, says):
    with pytest.raises(ProblemError, match=says) as caught:
        read_picture(content)
    problem = caught.value.problem
    assert (problem.place, caught.value.status) == ("body", 422)
    assert problem.remedy


def test_a_file_of_any_bytes_is_read_or_refused():
    """Nothing else may come of it, whichever byte of a picture is another."""
    chance = np.random.default_rng(5)
    refused = 0
    for whole in (PICTURE, a_jpeg()):
        for _ in range(300):
            content = bytearray(whole)
            content[chance.integers(len(content))] = chance.integers(256)
            try:
                read_picture(bytes(content[: chance.integers(1, len(content) + 1)]))
            except ProblemError:
                refused += 1
    assert refused > 400


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    with TestClient(make_app(tmp_path_factory.mktemp("prints")), base_url="http://127.0.0.1") as client:
        yield client


def test_a_print_is_kept_listed_handed_out_and_removed(client):
    reply = client.post("/api/prints?name=Checks&width=0.3", content=PICTURE)
    assert reply.status_code == 201
    kept = reply.json()
    assert (kept["name"], kept["kind"], kept["pixels"], kept["kept_as"]) == ("Checks", "image/png", [36, 24], None)
    assert kept["size"] == pytest.approx([0.3, 0.2])
    assert reply.headers["location"] == f"/api/prints/{kept['id']}"
    assert client.get("/api/prints").json() == [kept]
    image = client.get(kept["image"])
    assert (image.content, image.headers["content-type"]) == (PICTURE, "image/png")
    assert image.headers["x-content-type-options"] == "nosniff"
    again = client.post("/api/prints?name=Chess&width=0.3", content=PICTURE).json()
    assert (again["id"], again["kept_as"]) == (kept["id"], "Checks")
    wider = client.post("/api/prints?name=Wide&width=0.6", content=PICTURE).json()
    assert wider["id"] != kept["id"]
    assert client.delete(f"/api/prints/{kept['id']}").status_code == 204
    assert client.get(kept["image"]).status_code == 404
    assert client.get(wider["image"]).content == PICTURE  # the same file, still needed


@pytest.mark.parametrize(
    ("query", "content", "place"),
    [
        ("name=x", PICTURE, "width"),
        ("name=x&width=0", PICTURE, "width"),
        ("name=x&width=nan", PICTURE, "width"),
        ("name=&width=0.2", PICTURE, "name"),
        ("name=x&width=0.2", b"no picture", "body"),
    ],
)
def test_a_print_that_can_not_be_is_refused_by_its_field(client, query, content, place):
    reply = client.post(f"/api/prints?{query}", content=content)
    assert (reply.status_code, reply.json()["place"]) == (422, place)
    assert reply.json()["remedy"]
