"""The REST side, through a real server: what is listed, what is refused and how it is said."""

from __future__ import annotations

import json
import threading
import time

import patterns
import pytest
from asking import FIELDS, answer_to, refused
from live_server import LiveServer

from tryon_server.garments.check import check_pattern
from tryon_server.persistence.sessions import SqlSessions


def upload(live, pattern, name: str = "my tube"):
    content = pattern if isinstance(pattern, bytes) else patterns.as_bytes(pattern)
    return live.http.post("/api/garments", params={"name": name}, content=content)


def test_health_and_catalogue(live):
    assert live.http.get("/api/health").json()["status"] == "ok"
    (sway,) = live.http.get("/api/motions").json()
    assert sway == {"name": "sway", "seconds": 1.0, "title": "sway", "found": None, "kept_as": None}
    fabrics = live.http.get("/api/fabrics").json()
    assert fabrics[0]["name"] == "cotton"
    numbers = {"areal_density", "thickness", "strain_limit", "bending", "drape"}
    assert set(fabrics[0]) == {"name", "source", "look", *numbers}
    assert live.http.get("/api/devices").json()[0]["name"] == "cpu"
    paths = live.http.get("/openapi.json").json()["paths"]
    assert {"/api/garments", "/api/sessions", "/api/sessions/{session_id}"} <= set(paths)


def test_demo_garment_is_there_from_the_start(live):
    tube = live.http.get("/api/garments/tube").json()
    assert (tube["panel_count"], tube["seam_count"]) == (2, 2)
    assert tube["area"] == pytest.approx(2 * 0.6 * 0.5, rel=1e-6)
    assert tube["vertex_count"] > 100
    assert live.http.get("/api/garments").json()[0] == tube


def test_uploaded_garment_is_stored_by_content(live):
    reply = upload(live, patterns.tube(height=40.0))
    assert reply.status_code == 201, reply.text
    garment = reply.json()
    assert garment["area"] == pytest.approx(2 * 0.6 * 0.4, rel=1e-6)
    assert reply.headers["location"] == f"/api/garments/{garment['id']}"
    assert live.http.get(reply.headers["location"]).json() == garment
    assert garment["kept_as"] is None
    again = upload(live, patterns.tube(height=40.0), "another name").json()
    assert again == {**garment, "kept_as": garment["name"]}
    assert upload(live, patterns.tube(height=40.0), f" {garment['name']} ").json() == garment
    assert [entry["id"] for entry in live.http.get("/api/garments").json()].count(garment["id"]) == 1


def missing_edge():
    pattern = patterns.tube()
    pattern["pattern"]["stitches"][0][0]["edge"] = 7
    return pattern, "stitches[0]"


def unequal_edges():
    pattern = patterns.tube()
    pattern["pattern"]["panels"]["front"] = patterns.piece(60.0, 120.0, 30.0)
    return pattern, "stitches[0]"


def gather_beyond_measure():
    return patterns.gathered(), "stitches[1]"


def no_stitches():
    return patterns.scarf(), "stitches"


def a_piece_sewn_to_nothing():
    pattern = patterns.tube()
    pattern["pattern"]["panels"]["belt"] = patterns.piece(70.0, 5.0, 40.0)
    pattern["pattern"]["panel_order"].append("belt")
    return pattern, "panels.belt"


def sewn_on_one_side_only():
    pattern = patterns.tube()
    del pattern["pattern"]["stitches"][1]
    return pattern, "panels.front"


def zero_area():
    pattern = patterns.tube()
    pattern["pattern"]["panels"]["back"]["vertices"] = [[0, 0], [60, 0], [60, 0], [0, 0]]
    return pattern, "panels.back"


def not_a_number():
    pattern = patterns.tube()
    pattern["pattern"]["panels"]["back"]["vertices"][2][1] = float("nan")
    return pattern, "panels.back.vertices[2][1]"


def number_beyond_float():
    pattern = patterns.tube()
    pattern["pattern"]["panels"]["back"]["translation"][0] = 10**400
    return pattern, "panels.back.translation[0]"


def panel_without_edges():
    pattern = patterns.tube()
    pattern["pattern"]["panels"]["front"]["edges"] = []
    return pattern, "panels.front.edges"


def no_panels():
    pattern = patterns.tube()
    pattern["pattern"]["panels"] = {}
    return pattern, "panels"


def outline_that_crosses_itself():
    pattern = patterns.tube()
    pattern["pattern"]["panels"]["front"]["vertices"] = [[0, 0], [60, 50], [60, 0], [0, 40]]
    return pattern, "panels.front.edges"


def arc_too_small():
    pattern = patterns.tube()
    edge = pattern["pattern"]["panels"]["front"]["edges"][0]
    edge["curvature"] = {"type": "circle", "params": [29.0, 0, 1]}
    return pattern, "panels.front.edges[0].curvature.params[0]"


def more_fabric_than_can_be_meshed():
    pattern = patterns.tube()
    pattern["pattern"]["panels"] = {f"p{i}": patterns.piece(390.0, 390.0, 30.0) for i in range(200)}
    tubes = [[{"panel": f"p{i}", "edge": 1}, {"panel": f"p{i}", "edge": 3}] for i in range(200)]
    pattern["pattern"].update(stitches=tubes, panel_order=[f"p{i}" for i in range(200)])
    return pattern, "panels"


def corners_on_a_line():
    """What closes the panel are two arcs, so it has an area; its sides have shrunk and match nothing."""
    pattern = patterns.tube()
    back = pattern["pattern"]["panels"]["back"]
    back["vertices"] = [[0, 0], [60, 0], [40, 0], [20, 0]]
    back["edges"][0]["curvature"] = {"type": "circle", "params": [60.0, 0, 1]}
    back["edges"][2]["curvature"] = {"type": "circle", "params": [60.0, 0, 0]}
    return pattern, "panels.back"


def half_a_character():
    pattern = patterns.tube()
    pattern["pattern"]["panels"]["back"]["label"] = "sk\ud800"
    return pattern, "panels.back.label"


def half_a_character_as_a_name():
    text = json.dumps(patterns.tube()).replace('"back"', '"sk\\ud800"')
    return json.loads(text), "panels.sk\\ud800"


def not_a_pattern():
    return {"hello": "world"}, "specification"


FAULTS = [
    missing_edge, unequal_edges, gather_beyond_measure, no_stitches, a_piece_sewn_to_nothing, sewn_on_one_side_only,
    zero_area, not_a_number, number_beyond_float, panel_without_edges, no_panels,
    outline_that_crosses_itself, arc_too_small, more_fabric_than_can_be_meshed, not_a_pattern,
    corners_on_a_line, half_a_character, half_a_character_as_a_name,
]  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_pattern_that_cannot_be_sewn_is_refused_with_the_place(fault):
    pattern, place = fault()
    reply = check_pattern(patterns.as_bytes(pattern))
    assert reply.facts is None
    assert (reply.status, reply.problem.code) == (422, "pattern.invalid")
    assert reply.problem.place.startswith(place)
    assert reply.problem.remedy


@pytest.mark.parametrize("content", [b"", b"{", b"\xff\xfe\x00", b"\x1f\x8b\x08\x00", b"[" * 100_000])
def test_what_is_not_json_is_refused(content):
    reply = check_pattern(content)
    assert reply.facts is None
    assert (reply.status, reply.problem.code) == (400, "pattern.not_json")
    assert "JSON" in reply.problem.message
    assert reply.problem.place
    assert reply.problem.remedy


def test_half_a_character_is_refused_at_the_upload_in_text_that_can_be_read(live):
    body = refused(upload(live, half_a_character_as_a_name()[0]), 422, "pattern.invalid")
    assert body["place"] == "panels.sk\\ud800"
    assert "'sk\\ud800'" in body["message"]
    assert body["remedy"].startswith("Rename it")


def test_faults_of_an_uploaded_pattern_reach_whoever_uploaded_it(live):
    refused(upload(live, b"{"), 400, "pattern.not_json")
    body = refused(upload(live, missing_edge()[0]), 422, "pattern.invalid")
    assert "stitches[0]" in body["place"]


def test_edges_that_differ_in_length_are_both_named_with_their_lengths_and_a_remedy(live):
    body = refused(upload(live, unequal_edges()[0]), 422, "pattern.invalid")
    assert body["place"] == "stitches[0]"
    assert "edge 1 of 'front' is 120.0 cm long and edge 3 of 'back' 50.0 cm" in body["message"]
    assert "a ratio of 2.40 over 1.5" in body["message"]
    assert body["remedy"] == 'Sew edges that match, or add "gather" to the stitch'
    body = refused(upload(live, patterns.gathered()), 422, "pattern.invalid")
    assert body["place"] == "stitches[1]"
    assert "edge 3 of 'front' is 11.7 cm long and edge 1 of 'back' 50.0 cm" in body["message"]
    assert body["remedy"] == "Shorten the longer edge"


def test_a_panel_without_area_is_named_with_its_measures(live):
    pattern = patterns.tube()
    pattern["pattern"]["panels"]["back"]["vertices"] = [[0, 0], [30, 0], [60, 0], [30, 0.004]]
    body = refused(upload(live, pattern), 422, "pattern.invalid")
    assert body["place"] == "panels.back"
    measures = "0.12 cm^2 within an outline of 120.0 cm"
    assert body["message"] == f"the panel 'back' has no area, or nearly none: {measures}"


def test_what_would_fall_off_is_refused_and_not_listed(live):
    before = live.http.get("/api/garments").json()
    body = refused(upload(live, patterns.scarf()), 422, "pattern.invalid")
    assert "no stitches" in body["message"]
    assert "loop" in body["remedy"]
    body = refused(upload(live, a_piece_sewn_to_nothing()[0]), 422, "pattern.invalid")
    assert "the panel 'belt' is sewn to nothing" in body["message"]
    body = refused(upload(live, sewn_on_one_side_only()[0]), 422, "pattern.invalid")
    assert "'front', 'back' are sewn in a row" in body["message"]
    assert live.http.get("/api/garments").json() == before


def test_name_must_be_printable(live):
    refused(upload(live, patterns.tube(), "  "), 422, "garment.name")
    refused(upload(live, patterns.tube(), "a\x00b"), 422, "garment.name")


def test_body_of_300_mb_is_refused_before_it_is_sent(live):
    status, body, sent = answer_to(live, f"Content-Length: {300 * 10**6}", [b"[" * 1000])
    assert status.startswith("HTTP/1.1 413")
    assert sent == 1000
    assert body["code"] == "body.too_long"
    assert "16 MiB" in body["message"]
    assert "TRYON_SERVER_MAX_PATTERN_BYTES" in body["remedy"]


def test_client_that_sends_it_all_the_same_gets_the_refusal(live):
    body = refused(live.http.post("/api/garments", content=b"[" * 50 * 10**6), 413, "body.too_long")
    assert "16 MiB" in body["message"]


def test_body_of_unknown_length_is_refused_at_the_cap(live):
    part = b"100000\r\n" + b" " * 2**20 + b"\r\n"
    status, body, _ = answer_to(live, "Transfer-Encoding: chunked", [part] * 17)
    assert status.startswith("HTTP/1.1 413")
    assert body["code"] == "body.too_long"


@pytest.mark.parametrize("path", ["/api/sessions", "/api/garments/", "/api/sessions/x", "/api/nothing", "/"])
@pytest.mark.parametrize("chunked", [False, True])
def test_every_other_body_has_a_small_cap(live, path, chunked):
    """The reply comes though the body does not end: it can't have waited for it, let alone have parsed it."""
    parts = [b"[" * 1000]
    head = f"Content-Length: {300 * 10**6}"
    if chunked:
        head, parts = "Transfer-Encoding: chunked", [b"10001\r\n" + b"[" * 65537 + b"\r\n"]
    status, body, _ = answer_to(live, head, parts, path)
    assert status.startswith("HTTP/1.1 413")
    assert set(body) == FIELDS
    assert (body["code"], body["place"]) == ("body.too_long", "body")
    assert "64 KiB" in body["message"]
    assert "/openapi.json" in body["remedy"]


def test_body_as_long_as_its_cap_is_read(live):
    wish = json.dumps({"garment": "nothing"}).encode()
    padded = wish + b" " * (2**16 - len(wish))
    refused(live.http.post("/api/sessions", content=padded), 404, "garment.unknown")
    refused(live.http.post("/api/sessions", content=iter([padded[:9], padded[9:]])), 404, "garment.unknown")
    refused(live.http.post("/api/sessions", content=padded + b" "), 413, "body.too_long")


JSON_FAULTS = {
    "nothing": (b"", "line 1 column 0"),
    "cut off": (b'{"garment":', "line 1 column 11"),
    "on the third line": (b'{\n"garment":\n tube}', "line 3 column 3"),
    "nested": (b"[" * 60_000, "line 1 column "),
    "nested objects": (b'{"garment":' * 5_000, "line 1 column "),
    "digits without end": (b'{"garment":' + b"9" * 6000 + b"}", "line 1 column "),
    "no text": (b"\xff\xfe\x00", "line 1 column 1"),
    "another encoding": ('{"garment": "tube"}'.encode("utf-16"), "line 1 column 1"),
    "half a character": (b'{"garment": "a\\ud800b"}', "line 1 column "),
    "half a character in a name": (b'{"garment": "tube", "\\udc00": 1}', "line 1 column "),
    "half a character in bytes": (b'{"garment": "a\xed\xa0\x80b"}', "line 1 column "),
    "character 0": (b'{"garment": "a\\u0000b"}', "garment"),
    "a list": (b'["tube"]', "$"),
    "a number": (b"7", "$"),
}


@pytest.mark.parametrize("name", JSON_FAULTS)
def test_request_that_is_not_the_json_expected_is_refused_with_the_place(live, name):
    content, place = JSON_FAULTS[name]
    body = refused(live.http.post("/api/sessions", content=content), 422, "request.invalid")
    assert body["place"].startswith(place)
    assert "/openapi.json" in body["remedy"]
    assert ("JSON in UTF-8" in body["remedy"]) == place.startswith("line")


@pytest.mark.parametrize(
    ("wish", "status", "code", "place"),
    [
        ({"garment": "nothing"}, 404, "garment.unknown", "garment"),
        ({"garment": "tube", "motion": "moonwalk"}, 422, "motion.unknown", "motion"),
        ({"garment": "tube", "fabric": "steel"}, 422, "fabric.unknown", "fabric"),
        ({"garment": "tube", "preset": "perfect"}, 422, "preset.unknown", "preset"),
        ({"garment": "tube", "motoin": "sway"}, 422, "request.invalid", "motoin"),
        ({"garment": 5}, 422, "request.invalid", "garment"),
        ({}, 422, "request.invalid", "garment"),
    ],
)
def test_session_that_cannot_be_opened_is_refused(live, wish, status, code, place):
    assert refused(live.http.post("/api/sessions", json=wish), status, code)["place"] == place


def test_session_is_found_and_ended(live):
    reply = live.http.post("/api/sessions", json={"garment": "tube"})
    session = reply.json()
    assert (session["garment"], session["motion"], session["fabric"], session["preset"]) == (
        "tube",
        None,
        "cotton",
        "auto",
    )
    assert session["stream"] == f"/api/sessions/{session['id']}/stream"
    found = live.http.get(f"/api/sessions/{session['id']}").json()
    assert found["id"] == session["id"]
    assert found["state"] in ("preparing", "dressing", "waiting")
    for _ in range(2):
        assert live.http.delete(f"/api/sessions/{session['id']}").status_code == 204
    ended = live.http.get(f"/api/sessions/{session['id']}").json()
    assert (ended["state"], ended["detail"]) == ("closed", "Ended by request")


def test_who_asks_while_an_end_is_being_noted_is_told_why(live, monkeypatch):
    noting = threading.Event()
    end = SqlSessions.end

    def slowly(*arguments):
        noting.set()
        time.sleep(0.5)
        end(*arguments)

    monkeypatch.setattr(SqlSessions, "end", slowly)
    session = live.http.post("/api/sessions", json={"garment": "tube"}).json()["id"]
    assert live.http.delete(f"/api/sessions/{session}").status_code == 204
    assert noting.wait(10.0)
    ended = live.http.get(f"/api/sessions/{session}").json()
    assert (ended["state"], ended["detail"]) == ("closed", "Ended by request")


def test_accuracy_and_deadline_of_a_live_session_are_chosen_and_told(live):
    session = live.http.post("/api/sessions", json={"garment": "tube"}).json()
    assert (session["accuracy"], session["deadline_ms"]) == (None, None)
    address = f"/api/sessions/{session['id']}/accuracy"
    chosen = live.http.put(address, json={"accuracy": 0.0002, "deadline_ms": 11}).json()
    assert (chosen["id"], chosen["accuracy"], chosen["deadline_ms"]) == (session["id"], 0.0002, 11)
    assert live.http.get(f"/api/sessions/{session['id']}").json()["deadline_ms"] == 11
    again = live.http.put(address, json={}).json()
    assert (again["accuracy"], again["deadline_ms"]) == (None, None)
    for wish, place in (
        ({"accuracy": 0}, "accuracy"),
        ({"accuracy": "fine"}, "accuracy"),
        ({"accuracy": "1e-4"}, "accuracy"),
        ({"deadline_ms": True}, "deadline_ms"),
        ({"deadline_ms": 0.5}, "deadline_ms"),
        ({"deadline": 11}, "deadline"),
    ):
        assert refused(live.http.put(address, json=wish), 422, "request.invalid")["place"] == place
    remedy = refused(live.http.put(address, json={"accuracy": 2}), 422, "request.invalid")["remedy"]
    assert remedy.startswith("Of 'accuracy' it expects: m: the estimated RMS error"), "and no millimetres"
    none = live.http.put(address, content='{"accuracy": NaN}', headers={"Content-Type": "application/json"})
    assert "finite number" in refused(none, 422, "request.invalid")["message"]
    live.http.delete(f"/api/sessions/{session['id']}")
    refused(live.http.put(address, json={}), 409, "session.ended")
    refused(live.http.put("/api/sessions/nobody/accuracy", json={}), 404, "session.unknown")


def test_a_preset_of_a_live_session_is_chosen_and_told_once_it_is_in_force(live):
    session = live.http.post("/api/sessions", json={"garment": "tube", "preset": "draft"}).json()
    address = f"/api/sessions/{session['id']}"

    def told():
        found = live.http.get(address).json()
        assert found["preset"] == "draft", "that it was opened with"
        return found["chosen_preset"], found["preset_in_force"], found["preset_pending"]

    def wait_until(wanted):
        end = time.monotonic() + 60.0
        while told() != wanted:
            assert time.monotonic() < end, told()
            time.sleep(0.02)

    wait_until((None, "draft", False))
    chosen = live.http.put(f"{address}/accuracy", json={"accuracy": 0.0002, "preset": "fit"}).json()
    assert (chosen["accuracy"], chosen["chosen_preset"]) == (0.0002, "fit")
    wait_until(("fit", "fit", False))
    live.http.put(f"{address}/accuracy", json={"preset": "reference"})  # which breaks
    wait_until(("fit", "fit", False))
    live.http.put(f"{address}/accuracy", json={"deadline_ms": 11})
    wait_until((None, "draft", False))
    for name in ("auto", "fine"):
        refusal = refused(live.http.put(f"{address}/accuracy", json={"preset": name}), 422, "preset.unknown")
        assert refusal["place"] == "preset"
        assert repr(name) in refusal["message"]
        assert refusal["remedy"] == "Choose one of: draft, live, fit, reference"
    refused(live.http.put(f"{address}/accuracy", json={"preset": 3}), 422, "request.invalid")
    assert live.http.get(address).json()["deadline_ms"] == 11, "what is refused changes nothing"
    live.http.delete(address)
    ended = live.http.get(address).json()
    assert (ended["preset"], ended["preset_in_force"], ended["preset_pending"]) == ("draft", "", False)


def test_unknown_session_and_address_are_refused(live):
    refused(live.http.get("/api/sessions/nobody"), 404, "session.unknown")
    refused(live.http.delete("/api/sessions/nobody"), 404, "session.unknown")
    refused(live.http.get("/api/nothing"), 404, "http.404")
    refused(live.http.put("/api/garments"), 405, "http.405")


def test_pages_of_other_origins_change_nothing(live):
    evil = {"origin": "http://evil.example"}
    refused(live.http.post("/api/sessions", json={"garment": "tube"}, headers=evil), 403, "origin.refused")
    assert live.http.get("/api/garments", headers=evil).status_code == 200
    own = {"origin": f"http://127.0.0.1:{live.port}"}
    assert live.http.post("/api/sessions", json={"garment": "nothing"}, headers=own).status_code == 404


def test_names_that_only_resolve_to_this_machine_are_refused(live):
    assert live.http.get("/api/health", headers={"host": "evil.example"}).status_code == 400
    assert live.http.get("/api/health", headers={"host": f"localhost:{live.port}"}).status_code == 200


def test_built_page_is_served_and_data_survive_a_restart(tmp_path):
    (tmp_path / "web").mkdir()
    (tmp_path / "web" / "index.html").write_text("<h1>the page</h1>")
    server = LiveServer(tmp_path)
    assert "the page" in server.http.get("/").text
    first = server.http.get("/api/garments").json()
    session = server.open()
    server.stop()
    server = LiveServer(tmp_path)
    assert server.http.get("/api/garments").json() == first
    ended = server.http.get(f"/api/sessions/{session}").json()
    assert (ended["state"], ended["detail"]) == ("closed", "The server stops")
    server.stop()


def test_sessions_beyond_the_limit_are_refused_until_one_ends(tmp_path):
    server = LiveServer(tmp_path, max_sessions=1)
    first = server.open()
    body = refused(server.http.post("/api/sessions", json={"garment": "tube"}), 503, "server.full")
    assert "TRYON_SERVER_MAX_SESSIONS" in body["remedy"]
    server.http.delete(f"/api/sessions/{first}")
    assert server.open() != first
    server.stop()
