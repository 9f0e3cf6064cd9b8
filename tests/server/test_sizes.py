"""The size in which a session wears its garment: asked for, found, told beside each other, or refused."""

from __future__ import annotations

import asyncio

import pytest
from analytic_drape import FITTING_SIZE
from asking import refused

from tryon_client import connect
from tryon_protocol import StatusMessage


@pytest.mark.parametrize("size", [0.4, 2.1, -1, "large", "1", True, None])
def test_a_size_that_is_none_is_refused(live, size):
    body = refused(live.http.post("/api/sessions", json={"garment": "tube", "size": size}), 422, "request.invalid")
    assert body["place"] == "size"
    assert body["message"].endswith('a size is a number from 0.5 to 2, or "fit"')


@pytest.mark.parametrize(("size", "worn"), [("fit", FITTING_SIZE), (0.9, 0.9)])
def test_the_size_that_is_worn_is_told_beside_the_one_that_was_asked_for(live, size, worn):
    session = live.open(size=size)

    async def told() -> float | None:
        async with connect(live.stream_url(session)) as stream:
            async for event in stream:
                if isinstance(event, StatusMessage) and event.worn_size is not None:
                    return event.worn_size
        return None

    assert asyncio.run(asyncio.wait_for(told(), 20.0)) == worn
    info = live.http.get(f"/api/sessions/{session}").json()
    assert (info["size"], info["worn_size"]) == (size, worn)
    live.http.delete(f"/api/sessions/{session}")
    ended = live.http.get(f"/api/sessions/{session}").json()
    assert (ended["size"], ended["worn_size"]) == (size, None)


def test_the_description_of_a_session_names_the_size_that_fits(live):
    described = live.http.get("/openapi.json").json()
    wish = described["paths"]["/api/sessions"]["post"]["requestBody"]["content"]["application/json"]["schema"]
    for properties in (wish["properties"], described["components"]["schemas"]["SessionReply"]["properties"]):
        assert {"const": "fit", "type": "string"} in properties["size"]["anyOf"]
