"""Garments that are meshes, over REST: read on the default body, told how, refused with the place, kept with it all."""

from __future__ import annotations

import importlib.util
import re
import time
from pathlib import Path

import numpy as np
import patterns
import pytest
from asking import refused

from tryon_server.garments.check import check_garment
from tryon_server.persistence.garments import GarmentRecord, SqlGarments
from tryon_server.persistence.tables import open_database
from tryon_server.wording import as_parameters

SCRIPT = Path(__file__).resolve().parents[2] / "scripts" / "make_strangers.py"


@pytest.fixture(scope="module")
def skirt(tmp_path_factory) -> bytes:
    specification = importlib.util.spec_from_file_location("make_strangers", SCRIPT)
    assert specification is not None
    assert specification.loader is not None
    strangers = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(strangers)
    path = tmp_path_factory.mktemp("mesh") / "skirt.obj"
    strangers.write_skirt(path)
    return path.read_bytes()


def test_an_uploaded_mesh_says_how_it_was_read(live, skirt):
    reply = live.http.post("/api/garments", params={"name": "skirt"}, content=skirt)
    assert reply.status_code == 201, reply.text
    garment = reply.json()
    assert garment["notes"][0].startswith("units and axes: cm, Z up")
    assert any("27 stitch lines are sewn" in note for note in garment["notes"])
    assert (garment["panel_count"], garment["seam_count"]) == (2, 1)
    assert garment["vertex_count"] == 1296
    assert 0.4 < garment["area"] < 0.8
    assert live.http.get(f"/api/garments/{garment['id']}").json() == garment
    assert garment in live.http.get("/api/garments").json()


def test_what_is_told_is_checked_and_is_part_of_the_garment(live, skirt):
    told = live.http.post("/api/garments", params={"name": "skirt", "units": "cm", "up": "z"}, content=skirt)
    assert told.status_code == 201, told.text
    assert "as told" in told.json()["notes"][0]
    found = live.http.post("/api/garments", params={"name": "skirt"}, content=skirt).json()
    assert told.json()["id"] != found["id"]
    wrong = live.http.post("/api/garments", params={"name": "skirt", "units": "m"}, content=skirt)
    assert wrong.status_code == 422
    assert wrong.json()["code"] == "garment.mesh"
    assert "not where the body is" in wrong.json()["message"]
    assert "units and up" in wrong.json()["remedy"]
    unknown = live.http.post("/api/garments", params={"name": "skirt", "units": "ell"}, content=skirt)
    assert unknown.status_code == 422
    assert "units" in unknown.json()["place"]


def test_a_meshs_rest_shape_may_be_told(live, skirt):
    """The skirt's texture coordinates are its pattern, of the size it is worn in, unless its owner says otherwise."""

    def post(**told):
        return live.http.post("/api/garments", params={"name": "skirt", **told}, content=skirt)

    found, told = post(), post(rest_shape="shape")
    assert told.status_code == 201, told.text
    assert told.json()["id"] != found.json()["id"]
    assert any(note.startswith("rest shape: the pattern in its") for note in found.json()["notes"])
    assert "rest shape: the shape it comes in, as told" in told.json()["notes"]
    as_pattern = post(rest_shape="pattern").json()["notes"]
    pattern = "rest shape: the pattern in its texture coordinates, in metres, as told"
    assert any(note.startswith(pattern) for note in as_pattern)
    assert refused(post(rest_shape="crumpled"), 422, "request.invalid")["place"] == "rest_shape"
    bare = re.sub(rb"/\d+", b"", skirt)
    reply = live.http.post("/api/garments", params={"name": "bare", "rest_shape": "pattern"}, content=bare)
    problem = refused(reply, 422, "garment.mesh")
    assert "no texture coordinates" in problem["message"]
    assert "leave out rest_shape" in problem["remedy"]


def test_the_rest_shape_told_of_a_mesh_goes_with_it_into_a_session(live, skirt):
    params = {"name": "skirt", "rest_shape": "shape"}
    garment = live.http.post("/api/garments", params=params, content=skirt).json()["id"]
    session = live.http.post("/api/sessions", json={"garment": garment, "fabric": "tight"}).json()
    deadline = time.monotonic() + 20.0
    while (reply := live.http.get(f"/api/sessions/{session['id']}").json())["state"] != "failed":
        assert time.monotonic() < deadline, reply
        time.sleep(0.05)
    assert "stayed open; it rests in its shape. Enlarge" in reply["detail"]
    live.http.delete(f"/api/sessions/{session['id']}")


def test_a_session_of_a_mesh_is_gone_on_from_in_its_fabric_with_its_effects(live, skirt):
    garment = live.http.post("/api/garments", params={"name": "skirt"}, content=skirt).json()["id"]
    wish = {"garment": garment, "fabric": "denim"}
    first = live.http.post("/api/sessions", json=wish).json()
    path = f"/api/sessions/{first['id']}/effects/wind"
    deadline = time.monotonic() + 20.0
    while live.http.put(path, json={"parameters": {"velocity": [0, 0, 3]}}).status_code != 200:
        assert time.monotonic() < deadline
        time.sleep(0.05)
    live.http.delete(f"/api/sessions/{first['id']}")
    again = live.http.post("/api/sessions", json={"garment": garment, "continues": first["id"]})
    assert again.status_code == 201, again.text
    assert again.json()["fabric"] == "denim"
    path = f"/api/sessions/{again.json()['id']}/effects/wind"
    while live.http.get(path).json().get("state") != "active":
        assert time.monotonic() < deadline
        time.sleep(0.05)
    assert live.http.get(path).json()["parameters"]["velocity"] == [0.0, 0.0, 3.0]
    live.http.delete(f"/api/sessions/{again.json()['id']}")


@pytest.mark.parametrize("size", [0.9, "fit"])
def test_a_session_does_not_size_a_mesh(live, skirt, size):
    garment = live.http.post("/api/garments", params={"name": "skirt"}, content=skirt).json()["id"]
    body = refused(live.http.post("/api/sessions", json={"garment": garment, "size": size}), 422, "size.of_mesh")
    assert (body["place"], body["remedy"]) == ("size", "Leave the size out")


def test_a_broken_mesh_is_refused_with_its_line(live, skirt):
    lines = skirt.decode().splitlines()
    at = next(k for k, line in enumerate(lines) if line.startswith("f "))
    lines[at] = "f 1/1 2/2 99999/1 3/3"
    reply = live.http.post("/api/garments", params={"name": "skirt"}, content="\n".join(lines).encode())
    assert reply.status_code == 422
    assert reply.json()["code"] == "garment.mesh"
    assert reply.json()["place"].endswith(f"line {at + 1}")
    assert "no vertex 99999" in reply.json()["message"]


def through_itself(content: bytes) -> bytes:
    """The skirt with the middle of its front's lower half pushed back, through the back."""
    lines = content.decode().splitlines()
    placed = [k for k, line in enumerate(lines) if line.startswith("v ")]
    for k in placed[: len(placed) // 2]:
        x, y, z = map(float, lines[k].split()[1:])
        share = max(0.0, (95.0 - z) / 33.0) * max(0.0, 1.0 - abs(x) / 12.0)
        lines[k] = f"v {x} {y + 60.0 * share:.6f} {z}"
    return "\n".join(lines).encode()


def test_a_mesh_that_passes_through_itself_says_so_when_it_is_uploaded(live, skirt):
    garment = live.http.post("/api/garments", params={"name": "tangled"}, content=through_itself(skirt)).json()
    (note,) = [note for note in garment["notes"] if "crossings of itself" in note]
    found = re.match(r"it comes with (\d+) crossings of itself \(the mesh, lines ([\d, ]+) and \d+ more\): ", note)
    assert found is not None, note
    assert int(found[1]) > 10
    lines = through_itself(skirt).decode().splitlines()
    assert all(lines[int(number) - 1].startswith("f ") for number in found[2].split(", "))
    assert "drawn apart when it is put on, or it is refused" in note
    clean = live.http.post("/api/garments", params={"name": "skirt"}, content=skirt).json()
    assert not any("crossings" in note for note in clean["notes"])


def moved(content: bytes, along: float) -> bytes:
    """The skirt so far [cm] from the default body, as it lies on somebody who stands there."""
    lines = content.decode().splitlines()
    for k, line in enumerate(lines):
        if line.startswith("v "):
            x, y, z = map(float, line.split()[1:])
            lines[k] = f"v {x + along} {y} {z}"
    return "\n".join(lines).encode()


def test_a_mesh_that_lies_on_another_body_than_the_default_one_is_kept_and_told(live, skirt):
    """A session with a body of its own wears it; that of the default one says why it can't."""
    garment = live.http.post("/api/garments", params={"name": "elsewhere"}, content=moved(skirt, 300.0)).json()
    assert garment["notes"][-1].startswith("on the default body it can't be worn: the garment is not where the body is")
    assert "a body of your own that it lies on" in garment["notes"][-1]
    assert garment["notes"][0].startswith("units and axes: cm, Y up (0.5"), "the first unit that suits a garment"
    assert (garment["vertex_count"], garment["panel_count"]) == (1296, 2)
    worn = live.http.post("/api/garments", params={"name": "skirt"}, content=skirt).json()
    assert worn["notes"][-1].startswith("it was read as it lies on the default body")
    told = live.http.post("/api/garments", params={"name": "a", "units": "m"}, content=moved(skirt, 300.0))
    assert "not where the body is" in refused(told, 422, "garment.mesh")["message"], "no garment has 5000 m^2"


def test_patterns_have_no_notes(live):
    assert live.http.get("/api/garments/tube").json()["notes"] == []


def test_a_mesh_too_large_is_refused():
    x = np.random.default_rng(0).uniform(size=(50_001, 3))
    lines = ["v {} {} {}".format(*p) for p in x] + [f"f {k} {k + 1} {k + 2}" for k in range(1, 50_000)]
    reply = check_garment("\n".join(lines).encode(), "m", "y")
    assert reply.problem is not None
    assert reply.status == 422
    assert "50001 vertices" in reply.problem.message


def test_readings_are_kept_beside_the_garments_of_older_databases(tmp_path):
    url = f"sqlite:///{tmp_path / 'a.sqlite3'}"
    store = SqlGarments(open_database(url))
    values = {"digest": "d", "panel_count": 1, "seam_count": 0, "vertex_count": 3, "triangle_count": 1, "area": 1.0}
    plain = GarmentRecord(id="plain", name="plain", created=1.0, **values)
    mesh = GarmentRecord(id="mesh", name="mesh", created=2.0, units="cm", notes=("cm, Z up",), **values)
    for garment in (plain, mesh, mesh):
        store.add(garment)
    again = SqlGarments(open_database(url))
    assert again.all() == [plain, mesh]
    assert again.get("mesh") == mesh


def wedge(tip: float) -> bytes:
    """A tube of two trapezia whose upper edges are so long [cm]."""
    drawn = patterns.tube(45.0, 20.0)
    for piece in drawn["pattern"]["panels"].values():
        piece["vertices"] = [[0, 0], [45, 0], [22.5 + tip / 2, 20], [22.5 - tip / 2, 20]]
    return patterns.as_bytes(drawn)


def test_a_pattern_is_checked_with_triangles_as_fine_as_a_session_has_them():
    """Six millimetres are too narrow for the check's first mesh; a tenth of one is for any."""
    assert check_garment(wedge(0.6), None, None).facts is not None
    reply = check_garment(wedge(0.01), None, None)
    assert reply.problem is not None
    assert "edge length" not in reply.problem.remedy, "nobody who uploads can choose one"
    assert reply.problem.remedy


def test_a_session_is_told_of_presets_where_the_command_has_an_edge_length():
    assert as_parameters("Use a shorter edge length, or a pattern that lies smoother there").startswith("Use a finer p")
    assert as_parameters("use a smaller edge length than 0.017 m") == "use a finer preset"
    assert as_parameters("choose a longer edge length or another fabric") == "choose a coarser preset or another fabric"


def test_what_nobody_thought_of_is_told_as_itself_and_not_as_too_much(monkeypatch):
    def breaks(*_):
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr("tryon_solver.files.garment_file.read_garment", breaks)
    monkeypatch.setattr("tryon_solver.geometry.pattern.parse_pattern_bytes", breaks)
    for content in (b"v 0 0 0\n", b"{}"):
        reply = check_garment(content, "m", "y")
        assert reply.problem is not None
        assert (reply.status, reply.problem.code) == (500, "server.fault")
        assert "(ZeroDivisionError: division by zero): this is a fault of the server's" in reply.problem.message
        assert "Report it" in reply.problem.remedy
        assert "in breaks" in reply.trace


@pytest.mark.parametrize(
    ("content", "says", "remedy"),
    [
        (b"HIERARCHY\nROOT Hips\n", "a motion (BVH)", "Upload it as a motion"),
        (b"PK\x03\x04rest", "an archive", "unpack"),
        (b"Kaydara FBX Binary  \x00", "an .fbx file", ".glb"),
        (b"\n<?xml version='1.0'?><svg/>", "(XML)", "specification JSON"),
        (b"", "the file is empty", "an .obj: text with lines 'v x y z'"),
        (b" \n", "the file is empty", "an .obj: text with lines 'v x y z'"),
        (bytes(range(256)) * 4, "neither JSON nor OBJ nor GLB", "'f 1 2 3'"),
        (b"hello\n", "neither JSON nor OBJ nor GLB", "'f 1 2 3'"),
    ],
)
def test_a_file_of_another_kind_is_called_by_its_name(content, says, remedy):
    reply = check_garment(content, None, None)
    assert reply.problem is not None
    assert (reply.status, reply.problem.code, reply.problem.place) == (400, "pattern.not_json", "garment")
    assert says in reply.problem.message
    assert remedy in reply.problem.remedy
