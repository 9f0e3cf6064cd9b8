"""`tryon serve --tls`: a page and a websocket of https that a client with the authority's certificate trusts."""

from __future__ import annotations

import asyncio
import datetime
import os
import ssl
import stat
import threading

import httpx
import pytest
import websockets
from live_server import make_app

from tryon_protocol import SUBPROTOCOL, HelloMessage, WelcomeMessage, decode_server, encode
from tryon_server.certificate import LOCAL, development_certificate, names_of, own_addresses
from tryon_server.problems import ProblemError
from tryon_server.streaming.server import Server, listen

NOW = datetime.datetime.now(datetime.timezone.utc)


def test_a_server_with_it_is_trusted_by_who_trusts_the_authority_and_by_nobody_else(tmp_path):
    made = development_certificate(tmp_path / "tls", names_of("127.0.0.1"), NOW)
    server = Server(make_app(tmp_path), certificate=made)
    listener = listen("127.0.0.1", 0)
    port = listener.getsockname()[1]
    thread = threading.Thread(target=lambda: asyncio.run(server.serve([listener])), daemon=True)
    thread.start()
    while not server.started:
        assert thread.is_alive()
        thread.join(0.01)
    try:
        trusting = ssl.create_default_context(cafile=str(made.authority))
        with httpx.Client(base_url=f"https://localhost:{port}", verify=trusting) as client:
            assert client.get("/api/health").status_code == 200
            session = client.post("/api/sessions", json={"garment": "tube", "motion": None}).json()
        with pytest.raises(httpx.ConnectError), httpx.Client() as stranger:
            stranger.get(f"https://127.0.0.1:{port}/api/health")

        async def greet() -> WelcomeMessage:
            url = f"wss://127.0.0.1:{port}{session['stream']}"
            protocols = [websockets.Subprotocol(SUBPROTOCOL)]
            async with websockets.connect(url, ssl=trusting, subprotocols=protocols) as socket:
                await socket.send(encode(HelloMessage(versions=(1,), client="test")))
                return decode_server(await socket.recv())

        assert asyncio.run(asyncio.wait_for(greet(), 30.0)).session == session["id"]
    finally:
        server.should_exit = True
        thread.join(20)


def test_the_authority_is_kept_and_the_keys_are_secret(tmp_path):
    first = development_certificate(tmp_path, LOCAL, NOW)
    authority, chain = first.authority.read_bytes(), first.chain.read_bytes()
    second = development_certificate(tmp_path, LOCAL, NOW)
    assert second.authority.read_bytes() == authority
    assert second.chain.read_bytes() != chain
    for key in (second.key, tmp_path / "authority.key"):
        assert stat.S_IMODE(os.stat(key).st_mode) == 0o600


def test_what_is_no_authority_is_told_with_what_to_do(tmp_path):
    (tmp_path / "authority.pem").write_text("hello")
    (tmp_path / "authority.key").write_text("hello")
    with pytest.raises(ProblemError) as caught:
        development_certificate(tmp_path, LOCAL, NOW)
    assert "Remove" in caught.value.problem.remedy


def test_a_server_for_the_whole_network_is_certified_for_its_addresses():
    assert names_of("0.0.0.0")[:3] == LOCAL
    assert set(own_addresses()) <= set(names_of("0.0.0.0"))
    assert names_of("tryon.example") == (*LOCAL, "tryon.example")
    assert names_of("127.0.0.1") == LOCAL
