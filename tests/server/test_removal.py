"""What was uploaded is removed over REST: at once for who comes later, and never from under a session that has it."""

from __future__ import annotations

import asyncio
import hashlib
import io
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import patterns
import pytest
from asking import refused
from live_server import LiveServer

from tryon_client import connect
from tryon_protocol import ClientMessage, SetFabricMessage, SetMotionMessage, StatusMessage
from tryon_solver.body import default_body

BVH = (Path(__file__).resolve().parents[2] / "server/tryon_server/demo/motions/walk.bvh").read_bytes()
WALK = BVH.replace(b"0.016667", b"0.016661")  # bytes of its own: a file stays while any other test's motion has it


def moving_body() -> bytes:
    body, held = default_body(), io.BytesIO()
    there = body.rest_vertices + np.array([0.0, 0.0, 0.04])
    np.savez_compressed(held, vertices=np.stack([body.rest_vertices, there]), faces=body.faces, fps=3.0)
    return held.getvalue()


def post(live: LiveServer, kind: str, content: bytes) -> dict:
    reply = live.http.post(f"/api/{kind}", params={"name": "to go"}, content=content, timeout=240.0)
    assert reply.status_code == 201, reply.text
    return reply.json()


def file_of(live: LiveServer, content: bytes) -> Path:
    digest = hashlib.sha256(content).hexdigest()
    return live.app.state.services.settings.data_dir / "blobs" / digest[:2] / digest


def gone_soon(path: Path) -> bool:
    """Whether a file is removed, which happens a moment after a session has ended."""
    for _ in range(600):
        if not path.exists():
            return True
        time.sleep(0.05)
    return False


def tell(live: LiveServer, session: str, message: ClientMessage, done: Callable[[StatusMessage], bool]) -> None:
    """Send a message into a session and wait for the status that says that it was done."""

    async def ask() -> None:
        async with connect(live.stream_url(session)) as stream:
            await stream.send(message)
            async for event in stream:
                if isinstance(event, StatusMessage) and done(event):
                    return

    asyncio.run(asyncio.wait_for(ask(), 120.0))


def test_a_garment_that_is_removed_is_worn_on_and_its_file_goes_with_the_last_who_has_it(live):
    content = patterns.as_bytes(patterns.tube(61.0, 41.0))
    garment = post(live, "garments", content)
    assert garment["built_in"] is False
    session = live.open(garment=garment["id"])
    address = f"/api/garments/{garment['id']}"
    assert live.http.delete(address).status_code == 204
    refused(live.http.get(address), 404, "garment.unknown")
    refused(live.http.delete(address), 404, "garment.unknown")
    assert garment["id"] not in [known["id"] for known in live.http.get("/api/garments").json()]
    refused(live.http.post("/api/sessions", json={"garment": garment["id"]}), 404, "garment.unknown")
    assert file_of(live, content).exists(), "it is read again when another fabric is chosen"
    tell(live, session, SetFabricMessage(fabric="denim"), lambda now: (now.fabric, now.state) == ("denim", "running"))
    assert post(live, "garments", content)["id"] == garment["id"], "it may come again"
    assert live.http.delete(address).status_code == 204
    live.http.delete(f"/api/sessions/{session}")
    assert gone_soon(file_of(live, content))


def test_a_garment_that_came_with_the_server_stays(live):
    assert live.http.get("/api/garments/tube").json()["built_in"] is True
    body = refused(live.http.delete("/api/garments/tube"), 409, "garment.built_in")
    assert body["place"] == "garment"
    assert live.http.get("/api/garments/tube").status_code == 200
    refused(live.http.delete("/api/garments/tube", headers={"origin": "http://evil.example"}), 403, "origin.refused")


def test_a_motion_that_came_with_the_server_is_there_and_stays(live):
    listed = live.http.get("/api/motions").json()[0]
    assert live.http.get("/api/motions/sway").json() == listed
    body = refused(live.http.delete("/api/motions/sway"), 409, "motion.built_in")
    assert body["place"] == "motion"
    assert live.http.get("/api/motions").json()[0] == listed


def test_a_motion_that_is_removed_is_played_on_by_who_plays_it_and_by_nobody_else(live):
    motion = post(live, "motions", WALK)["name"]
    session, late = live.open(motion=motion), live.open()
    tell(live, late, SetMotionMessage(motion=motion), lambda now: now.motion == motion)
    assert live.http.delete(f"/api/motions/{motion}").status_code == 204
    assert live.http.get(f"/api/sessions/{session}").json()["motion"] == motion
    refused(live.http.post("/api/sessions", json={"garment": "tube", "motion": motion}), 422, "motion.unknown")
    live.http.delete(f"/api/sessions/{session}")
    time.sleep(0.5)
    assert file_of(live, WALK).exists(), "the other session has it"
    live.http.delete(f"/api/sessions/{late}")
    assert gone_soon(file_of(live, WALK))


def test_a_body_that_is_removed_stays_under_its_garment(live):
    content = moving_body()
    body = post(live, "bodies", content)["id"]
    session = live.http.post("/api/sessions", json={"garment": "tube", "body": body}).json()["id"]
    assert live.http.delete(f"/api/bodies/{body}").status_code == 204
    refused(live.http.post("/api/sessions", json={"garment": "tube", "body": body}), 404, "body.unknown")
    assert file_of(live, content).exists()
    live.http.delete(f"/api/sessions/{session}")
    assert gone_soon(file_of(live, content))


@pytest.mark.long
def test_a_session_that_can_not_be_opened_holds_nothing(live):
    """A garment on a body whose file is lost is asked for; then both are removed."""
    content, lost = patterns.as_bytes(patterns.tube(62.0, 42.0)), moving_body()
    garment, body = post(live, "garments", content)["id"], post(live, "bodies", lost)["id"]
    file_of(live, lost).unlink()
    refused(live.http.post("/api/sessions", json={"garment": garment, "body": body}), 410, "body.lost")
    for address in (f"/api/garments/{garment}", f"/api/bodies/{body}"):
        assert live.http.delete(address).status_code == 204
    assert not file_of(live, content).exists()
