"""Requests as somebody with bad intentions sends them, and replies as they have to be."""

from __future__ import annotations

import json
import socket
from collections.abc import Iterable

FIELDS = {"code", "place", "message", "remedy"}


def refused(reply, status: int, code: str) -> dict:
    assert reply.status_code == status, reply.text
    body = reply.json()
    assert set(body) == FIELDS
    assert body["code"] == code
    assert body["message"]
    assert body["remedy"]
    return body


def answer_to(live, head: str, parts: Iterable[bytes], path: str = "/api/garments") -> tuple[str, dict, int]:
    """Send a request by hand, until the server has said all it has to say: status line, body, bytes sent."""
    sent = 0
    with socket.create_connection(("127.0.0.1", live.port), timeout=60.0) as client:
        client.sendall(f"POST {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n{head}\r\n\r\n".encode())
        for part in parts:
            client.sendall(part)
            sent += len(part)
        answer = b""
        while b"}" not in answer:
            received = client.recv(65536)
            assert received, answer
            answer += received
    head, _, body = answer.decode().partition("\r\n\r\n")
    return head.splitlines()[0], json.loads(body), sent


def answered(http, reply):
    """The answer to a change of a session once it is made, however long it takes: `reply`, or what its job comes to."""
    while reply.status_code == 202:
        reply = http.get(reply.headers["Location"], headers={"Prefer": "wait=10"})
    return reply
