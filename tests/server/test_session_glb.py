"""The garment of a live session as a .glb file, over HTTP."""

from __future__ import annotations

import json
import struct
import time

import numpy as np
import pytest
import trimesh
from asking import refused

from tryon_server.looks.png import png
from tryon_server.looks.weave import TEXELS

PICTURE = png(np.full((16, 32, 3), 90, np.uint8))


@pytest.fixture(scope="module")
def session(live):
    """A session that runs."""
    session = live.open()
    deadline = time.monotonic() + 60
    while live.http.get(f"/api/sessions/{session}").json()["state"] != "running":
        assert time.monotonic() < deadline
        time.sleep(0.1)
    return session


def finish(live, session: str, **wish):
    """The reply to that choice."""
    return live.http.put(f"/api/sessions/{session}/finish", json=wish)


def scene_of(content: bytes) -> dict:
    (size,) = struct.unpack("<I", content[12:16])
    return json.loads(content[20 : 20 + size])


def scales(scene: dict) -> list[float]:
    colour = scene["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]
    return colour["extensions"]["KHR_texture_transform"]["scale"]


def test_what_is_worn_comes_as_a_file_with_its_fabric(live, session, tmp_path):
    reply = live.http.get(f"/api/sessions/{session}/garment.glb")
    assert (reply.status_code, reply.headers["content-type"]) == (200, "model/gltf-binary")
    (tmp_path / "worn.glb").write_bytes(reply.content)
    read = trimesh.load_scene(tmp_path / "worn.glb")
    assert set(read.geometry) == {"garment", "body"}
    assert np.isfinite(read.geometry["garment"].vertices).all()
    scene = scene_of(reply.content)
    assert [material["name"] for material in scene["materials"]] == ["cotton", "skin"]
    assert scales(scene) == pytest.approx([12.5, 12.5])  # a tile of 80 threads, 1 mm apart
    (primitive,) = scene["meshes"][0]["primitives"]
    assert set(primitive["attributes"]) == {"POSITION", "NORMAL", "TEXCOORD_0"}


def test_a_second_client_changes_nothing_for_the_first(live, session):
    """The picture is taken as by a client that leaves: nobody is left behind."""
    for _ in range(3):
        assert live.http.get(f"/api/sessions/{session}/garment.glb").status_code == 200
    assert live.http.get(f"/api/sessions/{session}").json()["viewers"] == 0


def test_a_print_is_in_the_file_in_its_size(live, session):
    kept = live.http.post("/api/prints?name=Grey&width=0.4", content=PICTURE).json()
    chosen = finish(live, session, print=kept["id"])
    told = live.http.get(f"/api/sessions/{session}/finish").json()
    assert chosen.json() == told == {"dye": None, "print": kept["id"]}
    reply = live.http.get(f"/api/sessions/{session}/garment.glb")
    assert scales(scene_of(reply.content)) == pytest.approx([1 / 0.4, 1 / 0.2])
    assert PICTURE in reply.content


def test_a_dye_is_in_the_file(live, session):
    """The fabric's map in that colour, which is another file than that of its own colour."""
    finish(live, session)
    own = live.http.get(f"/api/sessions/{session}/garment.glb").content
    finish(live, session, dye="ff0000")
    red = live.http.get(f"/api/sessions/{session}/garment.glb").content
    dyed = live.http.get("/api/fabrics/cotton/colour.png?dye=ff0000").content
    assert dyed in red
    assert dyed not in own
    assert TEXELS.to_bytes(4, "big") in dyed[:32]


@pytest.mark.parametrize(
    ("wish", "status", "code"),
    [
        ({"dye": "red"}, 422, "dye.invalid"),
        ({"dye": "ff0000", "print": "x"}, 422, "dye.unused"),
        ({"print": "x"}, 404, "print.unknown"),
        ({"colour": "ff0000"}, 422, "request.invalid"),
    ],
)
def test_what_can_not_be_is_refused_and_changes_nothing(live, session, wish, status, code):
    finish(live, session, dye="00ff00")
    refused(finish(live, session, **wish), status, code)
    assert live.http.get(f"/api/sessions/{session}/finish").json() == {"dye": "00ff00", "print": None}


def test_a_print_that_was_removed_is_told_of(live, session):
    kept = live.http.post("/api/prints?name=Gone&width=0.7", content=PICTURE).json()
    finish(live, session, print=kept["id"])
    live.http.delete(f"/api/prints/{kept['id']}")
    refused(live.http.get(f"/api/sessions/{session}/garment.glb"), 404, "print.unknown")
    finish(live, session)


def test_there_is_no_file_of_a_session_that_is_not(live):
    refused(live.http.get("/api/sessions/nobody/garment.glb"), 404, "session.unknown")
    ended = live.open()
    live.http.delete(f"/api/sessions/{ended}")
    refused(live.http.get(f"/api/sessions/{ended}/garment.glb"), 409, "session.ended")


def test_there_is_no_file_before_the_garment_is_dressed(held_server):
    server, _ = held_server
    problem = refused(server.http.get(f"/api/sessions/{server.open()}/garment.glb"), 409, "session.not_dressed")
    assert problem["remedy"]
