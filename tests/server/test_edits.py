"""Edits over REST and the websocket of a real server, kept in its database also when it is killed."""

import asyncio
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from analytic_drape import squares, width_of
from asking import refused
from killable_server import KillableServer
from live_server import LiveServer
from sqlalchemy.exc import IntegrityError

from tryon_client import connect
from tryon_protocol import DesignMessage, EditedMessage, EditMessage, ErrorMessage, StatusMessage
from tryon_server.persistence import EditRecord, SqlEdits, Waiting, open_database
from tryon_server.runtime.order import undoable
from tryon_solver.live_edit import RAMP_SECONDS

DENIM = {"kind": "change_fabric", "fabric": "denim"}
STEEL = DENIM | {"fabric": "steel"}
WIDER = {"kind": "scale_piece", "panel": "front", "factors": [1.2, 1.0]}


@pytest.fixture(scope="module")
def own_server(tmp_path_factory):
    """A server of its own: these sessions leave edits behind."""
    live = LiveServer(tmp_path_factory.mktemp("edits"))
    yield live
    live.stop()


@pytest.fixture
def server(own_server, monkeypatch):
    """The server, on which each test ends its sessions: there is room for eight."""
    opened = []

    def open_one(**wishes):
        opened.append(LiveServer.open(own_server, **wishes))
        return opened[-1]

    monkeypatch.setattr(own_server, "open", open_one)
    yield own_server
    for session in opened:
        own_server.http.delete(f"/api/sessions/{session}")


def dressed(server, **wishes) -> str:
    """A new session, once its garment is dressed; its id."""
    session = server.open(**wishes)
    for _ in range(1200):
        if server.http.get(f"/api/sessions/{session}").json()["state"] == "running":
            return session
        time.sleep(0.05)
    raise AssertionError(server.http.get(f"/api/sessions/{session}").json())


def test_the_list_says_of_the_oldest_of_more_than_a_thousand_that_they_can_be_undone_no_more():
    assert undoable(range(1, 1102)) == set(range(102, 1102))


def test_an_edit_over_rest_is_made_listed_and_in_the_pattern(server):
    path = f"/api/sessions/{dressed(server)}"
    reply = server.http.post(f"{path}/edits", json={"edit": WIDER})
    assert (reply.status_code, reply.json()) == (201, {"id": 1, "last": 1, "change": "value", "notes": []})
    (edit,) = server.http.get(f"{path}/edits").json()
    assert (edit["id"], edit["edit"], edit["mirror"], edit["undone"]) == (1, WIDER, False, False)
    assert abs(edit["made"] - time.time()) < 60
    assert width_of(server.http.get(f"{path}/pattern").json()) == 0.6
    assert server.http.post(f"{path}/edits/undo").json() == {"id": 1, "last": 0, "change": "value", "notes": []}
    assert edit["can_be_undone"]
    edit = server.http.get(f"{path}/edits").json()[0]
    assert (edit["undone"], edit["can_be_undone"]) == (True, False)
    refused(server.http.post(f"{path}/edits/undo"), 422, "edit.refused")
    assert server.http.post(f"{path}/edits/redo").json()["last"] == 1


def test_what_happens_besides_is_said_over_rest_too(server):
    """Of who watches, `design` says it."""
    path = f"/api/sessions/{dressed(server)}"
    longer = {"kind": "lengthen", "panel": "front", "edge": 0, "by": 0.05}
    reply = server.http.post(f"{path}/edits", json={"edit": longer, "mirror": True}).json()
    follows, once = reply["notes"]
    assert "'back' follows so that its seams fit" in follows
    assert "no piece is the mirror image of 'front'" in once


def test_whether_it_is_mirrored_is_said_by_true_or_false(server):
    path = f"/api/sessions/{dressed(server)}"
    for mirror in ("yes", 1, "true"):
        reply = server.http.post(f"{path}/edits", json={"edit": WIDER, "mirror": mirror})
        assert reply.status_code == 422, reply.json()
        assert "mirror" in reply.text
    assert server.http.get(f"{path}/edits").json() == []


def worn_in_the_end(server, path) -> list:
    """Whether each edit is worn, once all are or a minute has gone by."""
    for _ in range(1200):
        worn = [edit["worn"] for edit in server.http.get(f"{path}/edits").json()]
        if all(worn):
            break
        time.sleep(0.05)
    return worn


def test_an_edit_that_nobody_watches_is_worn_all_the_same_and_the_list_says_when(server):
    """Answered it is kept, and its shape is on the way: no client has ever connected."""
    path = f"/api/sessions/{dressed(server)}"
    asked = time.monotonic()
    assert server.http.post(f"{path}/edits", json={"edit": WIDER}).status_code == 201
    worn = server.http.get(f"{path}/edits").json()[0]["worn"]
    assert worn is (time.monotonic() - asked > RAMP_SECONDS and worn)  # a busy machine answers when it is there
    assert server.http.get(path).json()["viewers"] == 0
    assert worn_in_the_end(server, path) == [True]
    assert server.http.post(f"{path}/edits/undo").status_code == 200
    assert worn_in_the_end(server, path) == [True]
    server.http.delete(path)
    assert server.http.get(f"{path}/edits").json()[0]["worn"] is None


@pytest.mark.parametrize("factor", [0.7, 0.62], ids=["carried over", "dressed anew"])
def test_an_edit_that_needs_another_mesh_is_made_in_another_process(server, factor):
    """Frames of the old garment come until those of the new one do."""
    session = dressed(server)
    narrower = {"kind": "scale_piece", "panel": "front", "factors": [factor, 1.0]}
    frames, states, answers = [], [], []

    async def watch():
        async with connect(server.stream_url(session)) as stream:
            await stream.send(EditMessage(edit=narrower, request=3))
            async for event in stream:
                if isinstance(event, EditedMessage):
                    answers.append(event)
                elif isinstance(event, StatusMessage):
                    states.append(event.state)
                elif hasattr(event, "cloth"):
                    frames.append(event.topology_id)
                if answers and frames[-1:] == [2]:
                    break

    asyncio.run(asyncio.wait_for(watch(), 60.0))
    assert answers == [EditedMessage(id=1, change="topology", request=3)]
    assert frames == sorted(frames)
    assert frames[0] == 1
    assert set(states) <= {"running"}, "it is worn all the while"
    assert width_of(server.http.get(f"/api/sessions/{session}/pattern").json()) == pytest.approx(0.5 * factor)


def test_the_pattern_of_a_session_without_edits_is_its_garment_s(server):
    session = dressed(server)
    pattern = server.http.get(f"/api/sessions/{session}/pattern").json()
    uploaded = server.http.post("/api/garments", json=pattern)
    assert uploaded.status_code == 201, uploaded.text
    assert server.http.get(f"/api/sessions/{session}/edits").json() == []


@pytest.mark.parametrize(
    ("body", "status", "code", "place"),
    [
        ({"edit": {"kind": "knit"}}, 422, "edit.refused", "kind"),
        ({"edit": WIDER | {"panel": "frond"}}, 422, "edit.refused", "panel"),
        ({"edit": 3}, 422, "request.invalid", "edit"),
        ({"edits": WIDER}, 422, "request.invalid", None),
        ({}, 422, "request.invalid", "edit"),
    ],
)
def test_a_bad_edit_is_refused_and_named(server, body, status, code, place):
    session = dressed(server)
    told = refused(server.http.post(f"/api/sessions/{session}/edits", json=body), status, code)
    assert place in (None, told["place"])
    assert server.http.get(f"/api/sessions/{session}/edits").json() == []


def test_no_session_no_edit(server):
    for method, path in (("GET", "edits"), ("POST", "edits/undo"), ("GET", "pattern")):
        refused(server.http.request(method, f"/api/sessions/none/{path}"), 404, "session.unknown")
    refused(server.http.post("/api/sessions/none/edits", json={"edit": WIDER}), 404, "session.unknown")


def test_what_is_asked_for_before_the_garment_is_worn_is_made_once_it_is_also_after_kill_9(tmp_path):
    """Dressing takes as long as the test wants; the second server is never told of the edits again."""
    held = tmp_path / "held"
    held.touch()
    with KillableServer(tmp_path, "held_dressing:make_app") as server:
        http, session = server.http, server.open(garment="tube", motion="sway")
        path = f"/api/sessions/{session}"
        wider, bad = {"edit": WIDER}, {"edit": {"kind": "?"}}
        for step, json in (("", wider), ("", wider), ("/undo", None), ("", bad)):
            reply = http.post(f"{path}/edits{step}", json=json)
            assert (reply.status_code, reply.json()["doing"]) == (202, "waiting")
        told = http.get(path).json()
        assert told["state"] in ("preparing", "dressing")
        waits = [(one["step"], one["kind"], one["doing"]) for one in told["changes"]]
        assert waits[:3] == [("edit", "scale_piece", "waiting")] * 2 + [("undo", "", "waiting")]
        assert http.get(f"{path}/edits").json() == []
        server.kill()
        held.unlink()
        server.start()
        again = server.open(garment="tube", motion="sway", continues=session)
        path = f"/api/sessions/{again}"
        server.dressed(again)
        end = time.monotonic() + 60.0
        while [one["doing"] for one in http.get(path).json()["changes"]] != ["refused"]:
            assert time.monotonic() < end, http.get(path).json()
            time.sleep(0.05)
        assert "there is no edit '?'. Use" in http.get(path).json()["changes"][0]["detail"]
        assert [(edit["id"], edit["undone"]) for edit in http.get(f"{path}/edits").json()] == [(1, False), (2, True)]
        assert width_of(http.get(f"{path}/pattern").json()) == 0.72, "the tube is 0.6 m wide"
        third = server.open(garment="tube", motion="sway", continues=again)
        server.dressed(third)
        assert http.get(f"/api/sessions/{third}").json()["changes"] == [], "nothing is made twice"


def test_an_edit_that_is_worked_at_is_told_and_can_be_taken_back_and_one_that_takes_too_long_is_refused(tmp_path):
    """The garment that the edit asks for would be dressed anew, which takes as long as the test wants."""
    held = tmp_path / "held"
    bad = {"kind": "scale_piece", "panel": "front", "factors": [0.62, 1.0]}
    with KillableServer(tmp_path, "held_dressing:make_app_of_short_edits") as server, ThreadPoolExecutor() as pool:
        http, session = server.http, server.open(garment="tube", motion="sway")
        path = f"/api/sessions/{session}"
        server.dressed(session)
        held.touch()

        def ask(step="", json=None):
            return pool.submit(http.post, f"{path}/edits{step}", json=json)

        def changes():
            return [(one["kind"], one["doing"]) for one in http.get(path).json()["changes"]]

        slow = ask(json={"edit": bad})
        end = time.monotonic() + 60.0
        while changes() != [("scale_piece", "dressing")]:
            assert time.monotonic() < end, changes()
            time.sleep(0.02)
        assert ask("/undo").result().json() == {"id": 1, "last": 0, "change": "value", "notes": []}
        assert slow.result().json()["id"] == 1
        assert changes() == []
        slow = ask(json={"edit": bad})
        while not changes():
            time.sleep(0.02)
        behind = ask(json={"edit": WIDER | {"panel": "back"}})
        told = refused(slow.result(), 422, "edit.refused")
        assert "2 s" in told["message"]
        assert behind.result().status_code == 201
        assert width_of(http.get(f"{path}/pattern").json()) == 0.5, "the piece that the refused edit was of"


def test_an_ended_session_keeps_its_edits_and_can_be_continued(server):
    session = dressed(server)
    server.http.post(f"/api/sessions/{session}/edits", json={"edit": WIDER})
    server.http.delete(f"/api/sessions/{session}")
    refused(server.http.post(f"/api/sessions/{session}/edits", json={"edit": WIDER}), 409, "session.ended")
    assert len(server.http.get(f"/api/sessions/{session}/edits").json()) == 1
    again = dressed(server, continues=session)
    path = f"/api/sessions/{again}"
    assert width_of(server.http.get(f"{path}/pattern").json()) == 0.6
    assert [edit["id"] for edit in server.http.get(f"{path}/edits").json()] == [1]
    made = server.http.post(f"{path}/edits", json={"edit": WIDER}).json()
    assert made["id"] == 2
    assert width_of(server.http.get(f"{path}/pattern").json()) == 0.72
    third = dressed(server, continues=again)
    assert width_of(server.http.get(f"/api/sessions/{third}/pattern").json()) == 0.72
    refused(server.http.post("/api/sessions", json={"garment": "tube", "continues": "none"}), 404, "session.unknown")


def test_what_was_made_and_taken_back_can_be_taken_back_and_made_again_in_the_session_that_goes_on(server):
    session = dressed(server)
    uploaded = width_of(server.http.get(f"/api/sessions/{session}/pattern").json())
    for _ in range(3):
        server.http.post(f"/api/sessions/{session}/edits", json={"edit": WIDER})
    server.http.post(f"/api/sessions/{session}/edits/undo")
    server.http.delete(f"/api/sessions/{session}")
    path = f"/api/sessions/{dressed(server, continues=session)}"

    def width():
        return round(width_of(server.http.get(f"{path}/pattern").json()), 6)

    assert [(edit["id"], edit["undone"]) for edit in server.http.get(f"{path}/edits").json()] == [
        (1, False),
        (2, False),
        (3, True),
    ]
    assert width() == 0.72
    assert server.http.post(f"{path}/edits/redo").json()["id"] == 3
    assert width() == 0.864
    for number, left in ((3, 0.72), (2, 0.6), (1, uploaded)):
        assert server.http.post(f"{path}/edits/undo").json()["id"] == number
        assert width() == left
    refused(server.http.post(f"{path}/edits/undo"), 422, "edit.refused")
    third = f"/api/sessions/{dressed(server, continues=path.rpartition('/')[2])}"
    assert width_of(server.http.get(f"{third}/pattern").json()) == uploaded
    assert server.http.post(f"{third}/edits/redo").json()["id"] == 1


def test_another_fabric_is_an_edit_and_a_part_of_the_pattern(server):
    session = dressed(server)
    path = f"/api/sessions/{session}"

    def fabric():
        named = server.http.get(f"{path}/pattern").json()["properties"]["fabric"]
        assert server.http.get(path).json()["fabric"] == named
        return named

    assert fabric() == "cotton"
    reply = server.http.post(f"{path}/edits", json={"edit": DENIM})
    assert (reply.status_code, reply.json()) == (201, {"id": 1, "last": 1, "change": "topology", "notes": []})
    assert fabric() == "denim"
    told = refused(server.http.post(f"{path}/edits", json={"edit": STEEL}), 422, "edit.unknown_fabric")
    assert (told["place"], "cotton, denim" in told["remedy"]) == ("edit.fabric", True)
    server.http.post(f"{path}/edits/undo")
    assert fabric() == "cotton"
    server.http.post(f"{path}/edits/redo")
    assert fabric() == "denim"


def test_a_session_begins_in_the_fabric_that_its_pattern_names_unless_another_is_asked_for(server):
    session = dressed(server)
    server.http.post(f"/api/sessions/{session}/edits", json={"edit": DENIM})
    pattern = server.http.get(f"/api/sessions/{session}/pattern").json()
    garment = server.http.post("/api/garments", json=pattern).json()["id"]
    for wish, worn in (({"garment": garment}, "denim"), ({"continues": session}, "denim"), ({}, "cotton")):
        assert server.http.get(f"/api/sessions/{dressed(server, fabric=None, **wish)}").json()["fabric"] == worn
    other = dressed(server, garment=garment, fabric="cotton")
    assert server.http.get(f"/api/sessions/{other}/pattern").json()["properties"]["fabric"] == "cotton"
    pattern["properties"]["fabric"] = "steel"
    named = server.http.post("/api/garments", json=pattern).json()["id"]
    refused(server.http.post("/api/sessions", json={"garment": named}), 422, "fabric.unknown")


def test_an_edit_over_the_websocket_is_answered_and_shown(server):
    session, seen = dressed(server), []

    async def watch():
        async with connect(server.stream_url(session)) as stream:
            await stream.send(EditMessage(edit=WIDER, hold=True))
            await stream.send(EditMessage(edit=WIDER, request=3))
            await stream.send(EditMessage(edit={"kind": "knit"}, request=4))
            async for event in stream:
                seen.append(event)
                if {EditedMessage, ErrorMessage} <= {type(event) for event in seen}:
                    break
            return stream.design

    newest = asyncio.run(asyncio.wait_for(watch(), 60.0))
    assert [event for event in seen if isinstance(event, EditedMessage)] == [
        EditedMessage(id=1, change="value", request=3)
    ]
    designs = [event for event in seen if isinstance(event, DesignMessage)]
    (left, _), (right, _) = designs[-1].panels[0].vertices[:2]
    assert right - left == pytest.approx(0.6)
    assert (designs[-1].held, len(designs[-1].done)) == (False, 1)
    assert newest is designs[-1]
    (fault,) = [event for event in seen if isinstance(event, ErrorMessage)]  # may come before what takes storing
    assert (fault.code, fault.request) == ("edit_refused", 4)
    assert len(server.http.get(f"/api/sessions/{session}/edits").json()) == 1


def test_an_acknowledged_edit_outlives_kill_9(tmp_path):
    """The server's process dies without a chance to write anything, right after it answered."""
    with KillableServer(tmp_path, "live_server:make_app") as server:
        http, session = server.http, server.open(garment="tube", motion="sway")
        server.dressed(session)
        assert http.post(f"/api/sessions/{session}/edits", json={"edit": WIDER}).status_code == 201
        server.kill()
        server.start()
        assert width_of(http.get(f"/api/sessions/{session}/pattern").json()) == 0.6
        assert http.get(f"/api/sessions/{session}").json()["state"] == "closed"
        server.open(garment="tube", motion="sway", continues=session)


def test_edits_in_the_database(tmp_path):
    edits = SqlEdits(open_database(f"sqlite:///{tmp_path / 'edits.db'}"))

    def record(number, session="one"):
        specification = squares(0.5 + 0.01 * number)
        return EditRecord(
            session=session, id=number, edit=WIDER, mirror=True, specification=specification, made=float(number)
        )

    for number in (1, 2, 3):
        edits.add(record(number))
    edits.add(record(1, "other"))
    edits.mark("one", 3, undone=True)
    edits.mark("one", 2, undone=True)
    edits.mark("one", 2, undone=False)
    assert [(edit.id, edit.undone) for edit in edits.all("one")] == [(1, False), (2, False), (3, True)]
    edits.add(record(4))  # what was taken back is gone
    assert [edit.id for edit in edits.all("one")] == [1, 2, 4]
    assert edits.all("one")[1] == record(2)
    assert edits.all("none") == []
    for number in (1, 2, 10):
        edits.wait(Waiting("one", number), {"step": "edit", "number": number})
    edits.wait(Waiting("other", 1), {"step": "undo"})
    assert [change["number"] for change in edits.waiting("one")] == [1, 2, 10]
    edits.add(record(5), Waiting("one", 1))
    edits.mark("one", 5, undone=True, made_of=Waiting("one", 2))
    assert [change["number"] for change in edits.waiting("one")] == [10]
    with pytest.raises(IntegrityError):
        edits.add(record(1), Waiting("one", 10))
    assert len(edits.waiting("one")) == 1, "both or neither"
    edits.forget(Waiting("one", 10))
    assert (edits.waiting("one"), len(edits.waiting("other"))) == ([], 1)
