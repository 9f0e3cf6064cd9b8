"""Effects of sessions over REST and the websocket of a real server, kept in its database, and what continues them."""

import asyncio
import time

import pytest
from asking import refused
from live_server import LiveServer

from tryon_client import connect
from tryon_protocol import EffectsMessage, ErrorMessage, MeasureEffectsMessage, RemoveEffectMessage, SetEffectMessage
from tryon_server.persistence import SqlSessions, open_database


@pytest.fixture(scope="module")
def own_server(tmp_path_factory):
    """A server of its own: these sessions leave effects behind."""
    server = LiveServer(tmp_path_factory.mktemp("effects"))
    yield server
    server.stop()


@pytest.fixture
def worn(own_server):
    """A session whose garment is worn: the paths of its effects and of itself."""
    session = own_server.open()
    yield dressed(own_server, session), session
    own_server.http.delete(f"/api/sessions/{session}")


def dressed(server, session):
    path = f"/api/sessions/{session}/effects"
    for _ in range(600):
        reply = server.http.get(path)
        if reply.status_code == 200:
            assert reply.json()["effects"], "nothing was kept"
            return path
        refused(reply, 409, "effects.early")
        time.sleep(0.02)
    raise AssertionError("it is never dressed")


def of(reply, name):
    assert reply.status_code == 200, reply.text
    return next(effect for effect in reply.json()["effects"] if effect["name"] == name)


def test_all_effects_and_their_parameters_are_listed(own_server):
    words = {word["name"]: word for word in own_server.http.get("/api/effects").json()}
    assert len(words) == 17
    velocity = words["wind"]["fields"][0]
    assert velocity["name"] == "velocity"
    assert (velocity["kind"], velocity["unit"], velocity["live"]) == ("vector", "m/s", True)
    assert words["self_contact"]["kept"]


def test_what_is_asked_while_the_garment_is_put_on_is_kept_and_acts_once_it_is_worn(held_server):
    """Dressing takes until all is asked."""
    server, held = held_server
    http, session = server.http, server.open()
    path = f"/api/sessions/{session}/effects"
    south = {"velocity": [0, 0, 3]}
    reply = http.put(f"{path}/wind", json={"parameters": south})
    assert (reply.status_code, reply.json()["effects"]) == (202, []), reply.text
    wind = {"name": "wind", "state": "active", "parameters": south, "refused": ""}
    assert reply.json()["kept"] == [wind]
    reply = http.put(f"{path}/pressure", json={"parameters": {"nonsense": 1}})
    assert reply.status_code == 202, "only the worn garment can tell"
    refused(http.put(f"{path}/snow", json={}), 422, "effect.refused")
    refused(http.get(f"{path}?measure=true"), 409, "effect.unexpected_message")
    assert [one["name"] for one in http.get(f"/api/sessions/{session}").json()["kept_effects"]] == ["wind", "pressure"]
    assert http.get(path).json()["kept"][0] == wind
    refused(http.get(f"{path}/wind"), 409, "effects.early")
    held.unlink()
    for _ in range(1500):
        told = http.get(path).json()
        if told["effects"] and not any(one["refused"] == "" for one in told["kept"]):
            break
        time.sleep(0.02)
    wind = next(effect for effect in told["effects"] if effect["name"] == "wind")
    assert (wind["state"], wind["parameters"]["velocity"]) == ("active", [0, 0, 3])
    (left,) = http.get(f"/api/sessions/{session}").json()["kept_effects"]
    assert left["name"] == "pressure"
    assert "nonsense" in left["refused"]


def test_an_effect_is_set_changed_measured_and_removed(own_server, worn):
    http, (path, _) = own_server.http, worn
    assert of(http.get(path), "wind")["state"] == "absent"
    wind = of(http.put(f"{path}/wind", json={"parameters": {"velocity": [0, 0, 3]}}), "wind")
    assert (wind["state"], wind["pending"]) == ("active", "")
    assert wind["parameters"]["velocity"] == [0.0, 0.0, 3.0]
    assert wind["why"] == "asked for"
    armed = of(http.put(f"{path}/pressure", json={"state": "armed"}), "pressure")
    assert armed["state"] == "armed"
    assert http.get(f"{path}/wind").json() == wind
    measured = http.get(path, params={"measure": True})
    assert of(measured, "wind")["ms"] == 2.625
    assert measured.json()["plan"].startswith("project: membrane")
    assert of(http.delete(f"{path}/wind"), "wind")["state"] == "absent"


def test_what_is_refused_says_where_and_what_to_do(own_server, worn):
    http, (path, session) = own_server.http, worn
    bad = refused(http.put(f"{path}/wind", json={"parameters": {"velocity": [0, 99, 0]}}), 422, "effect.refused")
    assert bad["place"] == "parameters.velocity[1]"
    unknown = refused(http.put(f"{path}/wnd", json={}), 422, "effect.refused")
    assert "wind" in unknown["remedy"]
    assert refused(http.get(f"{path}/wnd"), 404, "effect.unknown")["place"] == "name"
    refused(http.delete(f"{path}/body_contact"), 422, "effect.refused")
    refused(http.put(f"{path}/wind", json={"sped": 1}), 422, "request.invalid")
    refused(http.get("/api/sessions/nobody/effects"), 404, "session.unknown")
    own_server.http.delete(f"/api/sessions/{session}")
    refused(http.get(path), 409, "session.ended")


def test_clients_of_a_session_are_told_and_may_ask(own_server, worn):
    _, session = worn

    async def ask():
        seen = []
        async with connect(own_server.stream_url(session)) as stream:
            await stream.send(SetEffectMessage(name="wind", parameters={"velocity": [1, 0]}, request=7))
            await stream.send(SetEffectMessage(name="wind", parameters={"velocity": [1, 0, 0]}))
            async for event in stream:
                if isinstance(event, ErrorMessage):
                    assert (event.request, event.code) == (7, "effect_refused")
                    assert event.place == "$.parameters.velocity"
                if not isinstance(event, EffectsMessage):
                    continue
                wind = next(effect for effect in event.effects if effect.name == "wind")
                seen.append((wind.state, wind.ms is not None))
                if seen[-1] == ("active", False):
                    await stream.send(MeasureEffectsMessage())
                if seen[-1] == ("active", True):
                    await stream.send(RemoveEffectMessage(name="wind"))
                if seen[-1][0] == "absent" and ("active", True) in seen:
                    return seen, stream.errors
        raise AssertionError(seen)

    seen, errors = asyncio.run(asyncio.wait_for(ask(), 60.0))
    assert seen[0] == ("absent", False)
    assert len(errors) == 1


def test_what_was_asked_for_is_kept_and_continued(own_server, worn):
    http, (path, session) = own_server.http, worn
    http.put(f"{path}/wind", json={"parameters": {"velocity": [0, 0, 3]}})
    http.delete(f"{path}/sleep")
    http.delete(f"/api/sessions/{session}")
    store = SqlSessions(open_database(own_server.app.state.services.settings.effective_database_url()))
    for _ in range(200):
        kept = store.effects(session)
        if set(kept.get("effects", {})) == {"wind", "sleep"}:
            break
        time.sleep(0.02)
    assert kept["effects"]["wind"]["parameters"]["velocity"] == [0.0, 0.0, 3.0]
    assert kept["effects"]["sleep"]["state"] == "absent"
    again = own_server.open(continues=session)
    path = dressed(own_server, again)
    for _ in range(600):
        reply = http.get(path)
        if of(reply, "wind")["state"] == "active":
            break
        time.sleep(0.02)
    assert of(reply, "wind")["parameters"]["velocity"] == [0.0, 0.0, 3.0]
    assert of(reply, "sleep")["state"] == "absent"
    assert store.effects(again) == kept
    http.delete(f"/api/sessions/{again}")


def test_time_stands_still_while_nobody_watches(own_server, worn):
    path, session = worn
    assert "Nobody watches" in own_server.http.get(f"/api/sessions/{session}").json()["detail"]

    async def watch(frames):
        """The times that so many frames show."""
        async with connect(own_server.stream_url(session)) as stream:
            times = []
            async for frame in stream.frames():
                times.append(frame.t_sim)
                if len(times) == frames:
                    assert "Nobody watches" not in stream.status.detail
                    return times
        raise AssertionError(times)

    seen = asyncio.run(asyncio.wait_for(watch(60), 30.0))
    own_server.http.put(f"{path}/wind", json={})  # what is asked meanwhile is done: it needs no time
    time.sleep(1.0)
    later = asyncio.run(asyncio.wait_for(watch(5), 30.0))
    assert 0.0 <= later[0] - seen[-1] < 0.5 < seen[-1] - seen[1], "but for what was on its way"


def test_by_itself_is_a_choice_of_its_own(own_server, worn):
    http, (path, _) = own_server.http, worn
    assert not http.get(path).json()["auto"]
    assert http.put(f"{path}/auto", json={}).json()["auto"]
    assert http.get(f"{path}/auto").json()["state"] == "active"
    assert not http.delete(f"{path}/auto").json()["auto"]
    assert http.get(f"{path}/auto").json()["state"] == "absent"
