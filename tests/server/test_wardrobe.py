"""Garments put on, taken off, reordered, edited one at a time and kept: over REST of a real server, whose sessions
simulate the analytic drape."""

import asyncio
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from itertools import count

import pytest
from killable_server import KillableServer
from live_server import LiveServer

from tryon_client import connect
from tryon_protocol import ErrorMessage, OutfitMessage, PutOnMessage, ReorderMessage, TakeOffMessage
from tryon_server.persistence import OutfitRecord, SqlOutfits, WornRecord, open_database
from tryon_server.streaming.live_sessions import LiveSessions
from tryon_server.streaming.wardrobes import Wardrobes

WIDER = {"kind": "scale_piece", "panel": "front", "factors": [1.2, 1.0]}


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    live = LiveServer(tmp_path_factory.mktemp("wardrobe"))
    yield live
    live.stop()


@pytest.fixture
def session(server):
    """A new session, once its garment is dressed; its id."""
    opened = server.open()
    for _ in range(1200):
        if server.http.get(f"/api/sessions/{opened}").json()["state"] == "running":
            break
        time.sleep(0.05)
    yield opened
    server.http.delete(f"/api/sessions/{opened}")


def worn(server, session):
    """Names of what is worn, and of the garment that is edited."""
    listed = server.http.get(f"/api/sessions/{session}/garments").json()
    return [one["name"] for one in listed], [one["name"] for one in listed if one["edited"]]


def put_on(server, session, **wish):
    return server.http.post(f"/api/sessions/{session}/garments", json={"garment": "tube"} | wish)


def wait_for_jobs(server, session, jobs):
    """Until so many changes of the session are under way."""
    end = time.monotonic() + 60.0
    while len(server.http.get(f"{session}/jobs").json()) < jobs:
        assert time.monotonic() < end, "it is never told"
        time.sleep(0.02)


def edits(server, session, garment):
    listed = server.http.get(f"/api/sessions/{session}/edits", params={"garment": garment}).json()
    return [entry["edit"] for entry in listed]


def test_garments_are_put_on_reordered_swapped_and_taken_off(server, session):
    assert worn(server, session) == (["tube"], ["tube"])
    made = put_on(server, session, fabric="denim")
    assert made.status_code == 201, made.text
    assert [(one["name"], one["garment"], one["fabric"]) for one in made.json()] == [
        ("tube", "tube", "cotton"),
        ("tube-2", "tube", "denim"),
    ]
    assert worn(server, session) == (["tube", "tube-2"], ["tube-2"])
    under = put_on(server, session, position=0)
    assert [one["name"] for one in under.json()] == ["tube-3", "tube", "tube-2"]
    order = {"order": ["tube-2", "tube", "tube-3"], "edited": "tube"}
    turned = server.http.put(f"/api/sessions/{session}/garments", json=order)
    assert [one["name"] for one in turned.json() if one["again"]] == ["tube", "tube-3"]
    listed = server.http.get(f"/api/sessions/{session}/garments").json()
    assert not any(one["again"] for one in listed), "it is told of the change, not from then on"
    assert worn(server, session) == (["tube-2", "tube", "tube-3"], ["tube"])
    swapped = put_on(server, session, replaces="tube")
    assert [one["name"] for one in swapped.json()] == ["tube-2", "tube-4", "tube-3"]
    inwards = put_on(server, session, replaces="tube-3", position=0)
    assert [one["name"] for one in inwards.json()] == ["tube", "tube-2", "tube-4"]
    assert put_on(server, session, replaces="tube-2", position=3).json()["code"] == "position.outside"
    off = server.http.delete(f"/api/sessions/{session}/garments/tube-2")
    assert [one["name"] for one in off.json()] == ["tube", "tube-4"]
    assert worn(server, session)[0] == ["tube", "tube-4"]


@pytest.fixture
def storing(monkeypatch):
    """Sessions that are opened from now on store no edit before this is set."""
    keep, go_on = LiveSessions._keep, threading.Event()

    def wait(*given):
        go_on.wait(60)
        keep(*given)

    monkeypatch.setattr(LiveSessions, "_keep", wait)
    return go_on


def test_an_edit_is_kept_with_its_garment_however_long_that_takes(server, storing, session):
    """Two swaps later another garment has its name."""
    path = f"/api/sessions/{session}/edits"
    with ThreadPoolExecutor() as pool:
        asked = pool.submit(server.http.post, path, json={"edit": WIDER, "garment": "tube"})
        wait_for_jobs(server, f"/api/sessions/{session}", 1)
        assert put_on(server, session, replaces="tube").status_code == 201
        assert worn(server, session)[0] == ["tube-2"]
        again = pool.submit(put_on, server, session, replaces="tube-2")
        deadline = time.monotonic() + 60
        while worn(server, session)[0] != ["tube"] and time.monotonic() < deadline:
            time.sleep(0.05)
        storing.set()
        assert (asked.result().status_code, again.result().status_code) == (201, 201)
    assert worn(server, session)[0] == ["tube"]
    assert edits(server, session, "tube") == []
    assert server.http.post(f"{path}/undo").status_code == 422


def test_no_two_garments_have_one_name():
    """Also where a garment is stored under what another would be numbered as."""
    outfit = OutfitRecord(
        worn=tuple(
            WornRecord(name=name, number=number, garment=name, fabric="cotton", size=1.0)
            for number, name in enumerate(("tube", "tube-3"), 1)
        ),
        edited="tube",
        highest=2,
    )
    wardrobes = Wardrobes.__new__(Wardrobes)
    made = wardrobes.with_one(outfit, "tube", "cotton", 1.0, None, None)
    assert [one.name for one in made.worn] == ["tube", "tube-3", "tube-4"]


def test_a_garment_is_swapped_for_itself_in_another_fabric_and_has_a_history_of_its_own(server, session):
    edit = f"/api/sessions/{session}/edits"
    assert server.http.post(edit, json={"edit": WIDER}).status_code == 201
    assert put_on(server, session, fabric="denim", size=1.1, replaces="tube").status_code == 201
    assert worn(server, session) == (["tube-2"], ["tube-2"])
    assert server.http.get(f"/api/sessions/{session}").json()["fabric"] == "denim"
    assert edits(server, session, "tube-2") == []
    assert server.http.post(f"{edit}/undo").status_code == 422
    assert server.http.post(edit, json={"edit": WIDER}).json()["id"] == 1
    assert edits(server, session, "tube-2") == [WIDER]


@pytest.mark.parametrize(
    ("method", "path", "body", "status", "code"),
    [
        ("POST", "", {"garment": "nothing"}, 404, "garment.unknown"),
        ("POST", "", {"garment": "tube", "fabric": "steel"}, 422, "fabric.unknown"),
        ("POST", "", {"garment": "tube", "position": 5}, 422, "position.outside"),
        ("POST", "", {"garment": "tube", "replaces": "coat"}, 404, "worn.unknown"),
        ("POST", "", {"garment": "tube", "fabric": "tight"}, 422, "outfit.refused"),
        ("DELETE", "/coat", None, 404, "worn.unknown"),
        ("DELETE", "/tube", None, 409, "outfit.empty"),
        ("PUT", "", {"order": ["tube", "tube"]}, 422, "order.other"),
        ("PUT", "", {"edited": "coat"}, 404, "worn.unknown"),
    ],
)
def test_what_can_t_be_worn_is_refused_with_the_reason_and_changes_nothing(
    server, session, method, path, body, status, code
):
    reply = server.http.request(method, f"/api/sessions/{session}/garments{path}", json=body)
    assert (reply.status_code, reply.json()["code"]) == (status, code), reply.text
    assert reply.json()["remedy"]
    assert worn(server, session) == (["tube"], ["tube"])
    if code == "outfit.refused":
        assert "can't be put on over tube" in reply.json()["message"]


def test_each_garment_has_edits_of_its_own(server, session):
    put_on(server, session, fabric="denim")
    edit = f"/api/sessions/{session}/edits"
    first = server.http.post(edit, json={"edit": WIDER})
    assert first.status_code == 201, first.text
    assert edits(server, session, "tube-2") == [WIDER]
    assert edits(server, session, "tube") == []
    other = server.http.post(edit, json={"edit": WIDER | {"factors": [1.1, 1.0]}, "garment": "tube"})
    assert other.json()["id"] == 1
    assert worn(server, session)[1] == ["tube"]
    undone = server.http.post(f"{edit}/undo", params={"garment": "tube-2"})
    assert undone.json() == {"id": 1, "last": 0, "change": "topology", "notes": []}
    assert [entry["undone"] for entry in server.http.get(edit, params={"garment": "tube-2"}).json()] == [True]
    assert [entry["undone"] for entry in server.http.get(edit, params={"garment": "tube"}).json()] == [False]
    refused = server.http.post(edit, json={"edit": WIDER, "garment": "coat"})
    assert refused.status_code == 422
    assert "Choose one of: tube, tube-2" in refused.json()["remedy"]


def test_an_edited_garment_is_put_on_as_edited_and_a_session_goes_on_with_the_outfit(server, session):
    server.http.post(f"/api/sessions/{session}/edits", json={"edit": WIDER})
    put_on(server, session, fabric="denim")
    server.http.post(f"/api/sessions/{session}/edits", json={"edit": WIDER})
    pattern = server.http.get(f"/api/sessions/{session}/pattern", params={"garment": "tube-2"}).json()
    server.http.delete(f"/api/sessions/{session}")
    assert worn(server, session) == (["tube", "tube-2"], ["tube-2"])
    goes_on = server.open(continues=session)
    assert worn(server, goes_on) == (["tube", "tube-2"], ["tube-2"])
    again = server.http.get(f"/api/sessions/{goes_on}/pattern", params={"garment": "tube-2"}).json()
    assert again == pattern
    assert edits(server, goes_on, "tube-2") == edits(server, session, "tube-2") != []
    server.http.delete(f"/api/sessions/{goes_on}")


def test_frames_go_on_while_another_outfit_is_made_and_no_longer_once_it_is_worn(server, session):
    """Frames of the old topology, then of the new one."""

    async def watch():
        async with connect(server.stream_url(session)) as stream:
            seen = []
            change = asyncio.get_running_loop().run_in_executor(None, lambda: put_on(server, session))
            async for frame in stream.frames():
                seen.append(frame.topology_id)
                if change.done() and len(set(seen)) > 1:
                    break
            return seen, await change

    seen, reply = asyncio.run(asyncio.wait_for(watch(), 60.0))
    assert reply.status_code == 201
    assert seen == sorted(seen)
    assert len(set(seen)) == 2


def test_what_is_asked_while_the_first_garment_is_put_on_waits_for_its_turn(tmp_path):
    """Each is made of what those before it have made, and refused with its own reason."""
    held = tmp_path / "held"
    held.touch()
    with KillableServer(tmp_path, "held_dressing:make_app") as server, ThreadPoolExecutor() as pool:
        session = f"/api/sessions/{server.open(garment='tube', motion='sway')}"
        path, order = f"{session}/garments", count(1)

        def ask(method, where="", body=None):
            asked = pool.submit(server.http.request, method, path + where, json=body)
            wait_for_jobs(server, session, next(order))
            return asked

        over, bad = ask("POST", "", {"garment": "tube"}), ask("POST", "", {"garment": "tube", "position": 9})
        turned = ask("PUT", "", {"order": ["tube-2", "tube"]})
        off, gone = ask("DELETE", "/tube"), ask("DELETE", "/tube")
        assert not any(asked.done() for asked in (over, bad, turned, off, gone))
        held.unlink()
        replies = [asked.result() for asked in (over, bad, turned, off, gone)]
        assert [reply.status_code for reply in replies] == [201, 422, 200, 200, 404]
        assert replies[1].json()["code"] == "position.outside"
        worn = [[one["name"] for one in reply.json()] for reply in replies if reply.status_code < 400]
        assert worn == [["tube", "tube-2"], ["tube-2", "tube"], ["tube-2"]]


def test_what_waits_for_a_garment_that_can_t_be_put_on_is_refused(tmp_path):
    held = tmp_path / "held"
    held.touch()
    with KillableServer(tmp_path, "held_dressing:make_app") as server, ThreadPoolExecutor() as pool:
        session = server.open(garment="tube", fabric="tight", motion="sway")
        asked = pool.submit(server.http.post, f"/api/sessions/{session}/garments", json={"garment": "tube"})
        wait_for_jobs(server, f"/api/sessions/{session}", 1)
        held.unlink()
        reply = asked.result()
        assert (reply.status_code, reply.json()["code"]) == (422, "outfit.refused")
        assert "stayed open" in reply.json()["message"]
        assert reply.json()["remedy"] == "Open a session with another garment."


def test_outfits_in_the_database(tmp_path):
    outfits = SqlOutfits(open_database(f"sqlite:///{tmp_path / 'tryon.db'}"))
    assert outfits.get("s") is None
    one = WornRecord(name="skirt", number=1, garment="skirt", fabric="denim", size="fit")
    two = WornRecord(name="tube", number=2, garment="tube", fabric="cotton", size=1.1)
    for worn_now in ((one,), (two, one)):
        outfit = OutfitRecord(worn=worn_now, edited="skirt", highest=2)
        outfits.put("s", outfit)
        assert outfits.get("s") == outfit


async def asked(url, *wishes):
    """What the server answers to these, each asked once the one before is answered."""
    answers = []
    async with connect(url) as stream:
        left = list(wishes)
        while stream.topology is None:
            await anext(aiter(stream))
        await stream.send(left.pop(0))
        async for event in stream:
            if isinstance(event, OutfitMessage | ErrorMessage):
                answers.append(event)
                if not left:
                    return answers
                await stream.send(left.pop(0))
    raise AssertionError(answers)


def test_garments_are_put_on_reordered_and_taken_off_over_the_websocket(server, session):
    put, turned, off = asyncio.run(
        asked(
            server.stream_url(session),
            PutOnMessage(garment="tube", fabric="denim", request=1),
            ReorderMessage(order=("tube-2", "tube"), edited="tube", request=2),
            TakeOffMessage(garment="tube-2", request=3),
        )
    )
    assert [answer.request for answer in (put, turned, off)] == [1, 2, 3]
    assert [(one.name, one.garment, one.fabric, one.size, one.edited) for one in put.worn] == [
        ("tube", "tube", "cotton", 1.0, False),
        ("tube-2", "tube", "denim", 1.0, True),
    ]
    assert [(one.name, one.again) for one in turned.worn] == [("tube-2", False), ("tube", True)]
    assert [(one.name, one.edited) for one in off.worn] == [("tube", True)]
    assert worn(server, session) == (["tube"], ["tube"])


def test_wishes_over_the_websocket_that_can_t_be_are_refused_and_the_session_lives(server, session):
    wishes = [
        (PutOnMessage(garment="nothing", request=1), "outfit_refused", "garment"),
        (PutOnMessage(garment="tube", fabric="steel", request=2), "unknown_fabric", "$.fabric"),
        (PutOnMessage(garment="tube", position=5, request=3), "outfit_refused", "$.position"),
        (PutOnMessage(garment="tube", fabric="tight", request=4), "outfit_refused", "garments.tube-2"),
        (PutOnMessage(garment="tube", size=3.0, request=5), "invalid_field", "$.size"),
        (TakeOffMessage(garment="coat", request=6), "outfit_refused", "$.garment"),
        (TakeOffMessage(garment="tube", request=7), "outfit_refused", "$.garment"),
        (ReorderMessage(order=("tube", "tube"), request=8), "outfit_refused", "$.order"),
    ]
    answers = asyncio.run(asked(server.stream_url(session), *(wish for wish, _, _ in wishes)))
    for (wish, code, place), answer in zip(wishes, answers, strict=True):
        assert isinstance(answer, ErrorMessage), wish
        assert (answer.code, answer.request, answer.fatal) == (code, wish.request, False)
        assert answer.place.endswith(place)
        assert answer.remedy
    assert worn(server, session) == (["tube"], ["tube"])
    (put,) = asyncio.run(asked(server.stream_url(session), PutOnMessage(garment="tube", request=9)))
    assert [one.name for one in put.worn] == ["tube", "tube-2"]


def test_who_watches_is_told_of_what_somebody_changes_by_rest(server, session):
    async def watched():
        async with connect(server.stream_url(session)) as stream:
            async for event in stream:
                if stream.topology is not None and stream.outfit is None and not put:
                    put.append(asyncio.create_task(asyncio.to_thread(put_on, server, session)))
                if isinstance(event, OutfitMessage):
                    await put[0]
                    return event
        raise AssertionError("the stream ended")

    put = []
    told = asyncio.run(asyncio.wait_for(watched(), 60.0))
    assert told.request is None
    assert [one.name for one in told.worn] == ["tube", "tube-2"]
