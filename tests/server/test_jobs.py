"""Changes that take longer than who asks may wait: answered 202 in time, told until they are done, cancelled, and made
after all where the server was killed. Dressing takes as long as the test wants."""

from __future__ import annotations

import asyncio
import time

import pytest
from asking import refused
from killable_server import KillableServer

from tryon_client import Changes, RefusedError
from tryon_server.api.prefer import Wait, preferred
from tryon_server.problems import ProblemError, problem_error
from tryon_server.streaming.jobs import Jobs, Progress

AT_ONCE = {"Prefer": "respond-async"}
NARROW = {"kind": "scale_piece", "panel": "front", "factors": [0.62, 1.0]}  # has to be dressed anew
WIDER = {"kind": "scale_piece", "panel": "back", "factors": [1.2, 1.0]}
LONGEST = 30.0  # s, that anything here may take


@pytest.fixture
def held(tmp_path):
    """The file that holds whatever is dressed."""
    return tmp_path / "held"


@pytest.fixture
def server(tmp_path):
    with KillableServer(tmp_path, "held_dressing:make_app") as server:
        yield server


@pytest.fixture
def path(server, held):
    """That of a session whose garment is worn; the next one is held."""
    session = server.open(garment="tube", motion="sway")
    server.dressed(session)
    held.touch()
    return f"/api/sessions/{session}"


def accepted(reply):
    """Where its job is."""
    assert reply.status_code == 202, reply.text
    assert reply.headers["Location"] == reply.json()["location"]
    assert int(reply.headers["Retry-After"]) >= 1
    return reply.headers["Location"]


def until(server, location, doing):
    """The job as it is told once this is done for it."""
    end = time.monotonic() + LONGEST
    while True:
        reply = server.http.get(location)
        assert reply.status_code == 202, reply.text
        if reply.json()["doing"] == doing:
            return reply.json()
        assert time.monotonic() < end, reply.json()
        time.sleep(0.02)


def ended(server, location):
    """What it is answered once it is done."""
    end = time.monotonic() + LONGEST
    while (reply := server.http.get(location, headers={"Prefer": "wait=2"})).status_code == 202:
        assert time.monotonic() < end, reply.json()
    return reply


def put_on(server, path, headers=None, **wish):
    return server.http.post(f"{path}/garments", json={"garment": "tube"} | wish, headers=headers)


def worn(server, path):
    return [one["name"] for one in server.http.get(f"{path}/garments").json()]


def test_a_garment_that_takes_longer_is_answered_202_and_told_until_it_is_worn(server, path, held):
    begun = time.monotonic()
    reply = put_on(server, path, {"Prefer": "wait=1"})
    assert time.monotonic() - begun >= 1.0, "it is waited for as long as the client would"
    assert reply.headers["Preference-Applied"] == "wait=1"
    location = accepted(reply)
    told = until(server, location, "dressing")
    while told["progress"] is None:
        told = until(server, location, "dressing")
    assert (told["step"], told["garment"], told["state"]) == ("put_on", "tube", "running")
    assert (told["detail"], told["progress"]) == ("Sewing", 0.5)
    assert [one["job"] for one in server.http.get(f"{path}/jobs").json()] == [told["job"]]
    held.unlink()
    done = ended(server, location)
    assert done.status_code == 201
    assert done.json() == server.http.get(f"{path}/garments").json()
    assert [one["name"] for one in done.json()] == ["tube", "tube-2"]
    assert ended(server, location).json() == done.json(), "also who asks again is told"
    assert [one["state"] for one in server.http.get(f"{path}/jobs").json()] == ["done"]
    assert server.http.delete(location).status_code == 204
    refused(server.http.get(location), 404, "job.unknown")
    assert worn(server, path) == ["tube", "tube-2"], "only the job is forgotten"


def test_what_is_done_in_time_is_answered_as_ever_and_leaves_no_job(server, path, held):
    held.unlink()
    assert put_on(server, path).status_code == 201
    assert server.http.delete(f"{path}/garments/tube").status_code == 200
    assert server.http.get(f"{path}/jobs").json() == []


def test_a_refusal_is_told_as_the_route_would_have(server, path, held):
    location = accepted(put_on(server, path, AT_ONCE, fabric="tight"))
    held.unlink()
    told = refused(ended(server, location), 422, "outfit.refused")
    assert "can't be put on over tube" in told["message"]
    (job,) = server.http.get(f"{path}/jobs").json()
    assert job["state"] == "refused"
    assert told["message"] in job["detail"]
    assert worn(server, path) == ["tube"]


def test_one_that_is_cancelled_leaves_what_is_worn_and_those_behind_it_are_made(server, path, held):
    first, behind, third = (accepted(put_on(server, path, AT_ONCE)) for _ in range(3))
    until(server, first, "dressing")
    assert until(server, behind, "waiting")["detail"]
    assert server.http.delete(behind).status_code == 204, "while it waits for its turn"
    assert server.http.delete(first).status_code == 204, "while it is made"
    refused(ended(server, first), 409, "job.cancelled")
    refused(ended(server, behind), 409, "job.cancelled")
    until(server, third, "dressing")
    assert worn(server, path) == ["tube"]
    held.unlink()
    assert [one["name"] for one in ended(server, third).json()] == ["tube", "tube-2"]
    assert server.http.get(path).json()["state"] == "running"


def test_an_edit_that_is_cancelled_is_not_made_and_those_behind_it_are(server, path, held):
    def edit(wish):
        return accepted(server.http.post(f"{path}/edits", json={"edit": wish}, headers=AT_ONCE))

    slow, behind = edit(NARROW), edit(WIDER)
    assert until(server, slow, "dressing")["step"] == "edit"
    assert server.http.delete(slow).status_code == 204
    refused(ended(server, slow), 409, "job.cancelled")
    made = ended(server, behind)
    assert (made.status_code, made.json()) == (201, {"id": 1, "last": 1, "change": "value", "notes": []})
    assert [one["edit"] for one in server.http.get(f"{path}/edits").json()] == [WIDER]
    held.unlink()


def test_what_was_acknowledged_outlives_kill_9_and_is_made_once(server, path, held):
    accepted(put_on(server, path, AT_ONCE))
    accepted(put_on(server, path, AT_ONCE, position=9))
    off = accepted(server.http.put(f"{path}/garments", json={"order": ["tube-2", "tube"]}, headers=AT_ONCE))
    cancelled = accepted(put_on(server, path, AT_ONCE))
    assert server.http.delete(cancelled).status_code == 204
    server.kill()
    held.unlink()
    server.start()
    refused(server.http.get(off), 404, "job.unknown")
    session = path.rpartition("/")[2]
    assert worn(server, path) == ["tube"]
    again = f"/api/sessions/{server.open(garment='tube', motion='sway', continues=session)}"
    jobs = [one["location"] for one in server.http.get(f"{again}/jobs").json()]
    assert [ended(server, job).status_code for job in jobs] == [201, 422, 200]
    assert worn(server, again) == ["tube-2", "tube"]
    server.kill()
    server.start()
    third = server.open(garment="tube", motion="sway", continues=again.rpartition("/")[2])
    assert server.http.get(f"/api/sessions/{third}/jobs").json() == []
    assert worn(server, f"/api/sessions/{third}") == ["tube-2", "tube"], "nothing is made twice"


def test_the_client_for_programs_waits_tells_and_cancels(server, path, held):
    told = []

    def let_go(job):
        told.append(job["doing"])
        if job["doing"] == "dressing":
            held.unlink(missing_ok=True)

    base, session = f"http://127.0.0.1:{server.port}/", path.rpartition("/")[2]
    changes = Changes(base, session, let_go)
    assert [one["name"] for one in changes.put_on("tube", fabric="denim")] == ["tube", "tube-2"]
    assert "dressing" in told
    made, undone = changes.edit(WIDER), changes.undo()
    assert [(one["id"], one["last"]) for one in (made, undone)] == [(1, 1), (1, 0)]
    assert changes.redo()["last"] == 1
    assert [one["name"] for one in changes.rearrange(edited="tube") if one["edited"]] == ["tube"]
    assert [one["name"] for one in changes.take_off("tube-2")] == ["tube"]
    held.touch()
    cancelling = Changes(base, session, lambda job: job["cancelling"] or cancelling.cancel(job))
    with pytest.raises(RefusedError, match="cancelled before it was worn") as error:
        cancelling.put_on("tube")
    assert (error.value.status, error.value.code) == (409, "job.cancelled")
    assert worn(server, path) == ["tube"]


def test_the_description_tells_of_it(server):
    described = server.http.get("/openapi.json").json()["paths"]
    for route, method in (("garments", "post"), ("garments", "put"), ("edits", "post"), ("edits/undo", "post")):
        told = described[f"/api/sessions/{{session_id}}/{route}"][method]
        assert set(told["responses"]["202"]["headers"]) == {"Location", "Retry-After"}
        assert [one["name"] for one in told["parameters"] if one["in"] == "header"] == ["prefer"]


@pytest.mark.parametrize(
    ("values", "wait"),
    [
        ([], Wait(None)),
        (["respond-async"], Wait(0.0, "respond-async")),
        (["respond-async, wait=10"], Wait(10.0, "respond-async, wait=10")),
        (['Wait="3"; strict', "wait=9"], Wait(3.0, "wait=3")),
        (["wait=600"], Wait(25.0, "wait=25")),
        (["wait=soon, return=minimal"], Wait(None)),
        (["wait=-1"], Wait(None)),
        ([f"wait={'9' * 5000}"], Wait(None)),
    ],
)
def test_what_a_client_prefers_is_applied_and_told_or_neither(values, wait):
    """RFC 7240, sections 2, 4.1 and 4.3."""
    assert preferred(values, longest=25.0) == wait


def test_those_that_ended_are_kept_for_a_while_and_by_number():
    async def begun(jobs, error=None):
        async def work():
            if error is not None:
                raise error
            return "worn"

        job = jobs.begin(
            "s", "edit", "", work(), status=201, progress=lambda: Progress("waiting", ""), give_up=lambda: None
        )
        assert await job.wait(1.0)
        return job

    async def run():
        few = Jobs(kept_seconds=60.0, most_kept=2)
        first, second, third = [await begun(few) for _ in range(3)]
        assert few.of("s") == [second, third]
        assert few.of("other") == []
        for session, job in (("s", first), ("other", second)):
            with pytest.raises(ProblemError, match="no job"):
                few.get(session, job.id)
        short = Jobs(kept_seconds=0.01, most_kept=9)
        bad = await begun(short, problem_error("edit.refused", "no", "Don't", status=422))
        assert bad.state == "refused"
        with pytest.raises(ProblemError, match="no"):
            bad.outcome()
        await asyncio.sleep(0.02)
        assert short.of("s") == []

    asyncio.run(run())


def test_an_effect_that_takes_longer_is_a_job(server):
    """Bound, refused and taken away: who asks is answered at once, and the job comes to what the route would answer."""
    session = server.open(garment="tube", motion="sway")
    server.dressed(session)
    path = f"/api/sessions/{session}"
    wind = {"parameters": {"velocity": [1.0, 0.0, 0.5]}}
    location = accepted(server.http.put(f"{path}/effects/wind", json=wind, headers=AT_ONCE))
    told = {job["location"]: job["step"] for job in server.http.get(f"{path}/jobs").json()}
    assert told[location] == "effect"
    made = ended(server, location)
    assert made.status_code == 200
    (own,) = (one for one in made.json()["effects"] if one["name"] == "wind")
    assert (own["state"], own["parameters"]["velocity"]) == ("active", [1.0, 0.0, 0.5])
    strong = {"parameters": {"velocity": [1e4, 0.0, 0.0]}}
    too_strong = server.http.put(f"{path}/effects/wind", json=strong, headers=AT_ONCE)
    refused(ended(server, accepted(too_strong)), 422, "effect.refused")
    assert server.http.get(f"{path}/effects/wind").json()["parameters"]["velocity"] == [1.0, 0.0, 0.5]
    gone = ended(server, accepted(server.http.delete(f"{path}/effects/wind", headers=AT_ONCE)))
    assert {one["name"]: one["state"] for one in gone.json()["effects"]}["wind"] == "absent"
    changes = Changes(str(server.http.base_url), session)
    assert changes.effect("wind", **wind)["effects"] == server.http.get(f"{path}/effects").json()["effects"]
    assert {one["name"]: one["state"] for one in changes.no_effect("wind")["effects"]}["wind"] == "absent"
