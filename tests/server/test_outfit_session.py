"""All of it at once through the real server and solver: a session that wears two garments, with an effect, a print, an
edit and other outfits; what a client sees is judged by ipctk."""

import json
import struct
from contextlib import suppress

import httpx
import numpy as np
import pytest
from asking import answered
from coarse_garments import make_app
from live_server import LiveServer
from watching import Viewer, crossing

from tryon_server.looks.png import png

WIND = {"velocity": [0.0, 0.0, 2.5]}
PICTURE = png(np.full((16, 32, 3), 90, np.uint8))
LONGEST = 240.0  # s, that the slowest of it may take


def materials(content: bytes) -> dict[str, dict]:
    """By the part's name."""
    (size,) = struct.unpack("<I", content[12:16])
    scene = json.loads(content[20 : 20 + size])
    return {mesh["name"]: scene["materials"][mesh["primitives"][0]["material"]] for mesh in scene["meshes"]}


@pytest.fixture
def server(tmp_path):
    server = LiveServer(tmp_path, make_app(tmp_path))
    yield server
    server.stop()


@pytest.mark.long
def test_two_garments_with_wind_a_print_an_edit_and_another_outfit(server):
    http = httpx.Client(base_url=f"http://127.0.0.1:{server.port}", timeout=LONGEST)
    opened = http.post("/api/sessions", json={"garment": "skirt", "fabric": "cotton_jersey", "motion": "walk"})
    assert opened.status_code == 201, opened.text
    name = opened.json()["id"]
    session = f"/api/sessions/{name}"

    def done(reply):
        reply = answered(http, reply)
        assert reply.status_code in (200, 201), reply.text
        return reply.json()

    def effect(name):
        return done(http.get(f"{session}/effects/{name}"))

    viewer = Viewer(server.stream_url(name))
    try:
        viewer.wait(5)
        own = effect("elastic")
        assert own["why"] == "the pattern has it"
        done(http.put(f"{session}/effects/wind", json={"parameters": WIND}))
        sticky = {"parameters": {"kind": "static_cling", "panels": ["skirt_back"]}}
        done(http.put(f"{session}/effects/adhesion", json=sticky))
        worn = done(http.post(f"{session}/garments", json={"garment": "tshirt", "fabric": "viscose_jersey"}))
        assert [(one["name"], one["edited"]) for one in worn] == [("skirt", False), ("tshirt", True)]
        viewer.wait(10)
        wind = effect("wind")
        assert (wind["state"], wind["parameters"]["velocity"]) == ("active", WIND["velocity"])
        assert effect("adhesion")["state"] == "active"
        assert effect("adhesion")["parameters"]["panels"] == ["skirt/skirt_back"], "its piece keeps its meaning"
        waist = effect("elastic")
        assert waist["state"] == "active"
        assert {edge["panel"] for row in waist["parameters"]["lines"] for edge in row["along"]} == {
            "skirt/skirt_front",
            "skirt/skirt_back",
        }

        done(http.put(f"{session}/garments", json={"edited": "skirt"}))
        printed = done(http.post("/api/prints?name=Grey&width=0.4", content=PICTURE))
        done(http.put(f"{session}/finish", json={"print": printed["id"]}))
        file = http.get(f"{session}/garment.glb")
        found = materials(file.content)
        assert list(found) == ["skirt", "tshirt", "body"]
        assert (found["skirt"]["name"], found["tshirt"]["name"]) == ("cotton_jersey", "viscose_jersey")
        assert PICTURE in file.content
        colour = found["skirt"]["pbrMetallicRoughness"]["baseColorTexture"]
        scale = colour["extensions"]["KHR_texture_transform"]["scale"]
        assert scale == pytest.approx([1 / 0.4, 1 / 0.2]), "the print is on the garment that is edited"

        dart = {"kind": "dart", "panel": "skirt_front", "edge": 0, "position": 0.5, "width": 0.03, "depth": 0.1}
        done(http.post(f"{session}/edits", json={"edit": dart, "garment": "skirt"}))
        viewer.wait(5)
        assert effect("wind")["state"] == effect("elastic")["state"] == "active"
        done(http.post(f"{session}/edits/undo?garment=skirt"))
        viewer.wait(5)
        assert effect("elastic")["parameters"] == waist["parameters"]

        left = done(http.delete(f"{session}/garments/tshirt"))
        assert [one["name"] for one in left] == ["skirt"]
        viewer.wait(5)
        assert effect("wind")["parameters"]["velocity"] == WIND["velocity"]
        assert effect("wind")["state"] == effect("adhesion")["state"] == effect("elastic")["state"] == "active"
    finally:
        viewer.close()
        with suppress(httpx.HTTPError):
            http.delete(session)
        http.close()
    assert viewer.errors == []
    assert len(viewer.seen) >= 6
    assert {len(topology.garments) for topology, _ in viewer.seen} == {1, 2}
    assert crossing(viewer.seen) == 0
