"""How an upload is checked and known again, without a server."""

from __future__ import annotations

import hashlib

import pytest

from tryon_server.uploads.check import Telling, check
from tryon_server.uploads.service import _key


def test_a_file_that_is_kept_already_is_known_again():
    """Its key is of what was told when it was stored, before animations and facings could be."""
    told = b'{"kind":"body","name":"","units":"cm","up":null,"fps":null}'
    key, digest = _key(b"content", Telling(kind="body", name="any", units="cm"))
    assert key == hashlib.sha256(b"content" + told).hexdigest()
    assert digest == hashlib.sha256(b"content").hexdigest()
    assert _key(b"content", Telling(kind="body", name="any", units="cm", animation="walk"))[0] != key
    assert _key(b"content", Telling(kind="body", name="any", units="cm", facing="-z"))[0] != key
    assert _key(b"content", Telling(kind="body", name="any", units="cm", joints={"head": "Top"}))[0] != key


def test_what_nobody_thought_of_is_told_as_itself_and_not_as_too_much(monkeypatch):
    def breaks(*_):
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr("tryon_server.runtime.bodies.load_moving_mesh", breaks)
    reply = check(b"PK", Telling(kind="body", name="odd"))
    assert reply.body is None
    assert reply.problem is not None
    assert (reply.status, reply.problem.code) == (500, "server.fault")
    assert reply.problem.message.startswith("checking the body failed (ZeroDivisionError: division by zero): this is")
    assert "Report it" in reply.problem.remedy
    assert "in breaks" in reply.trace

    def fills(*_):
        raise MemoryError

    monkeypatch.setattr("tryon_server.runtime.bodies.load_moving_mesh", fills)
    with pytest.raises(MemoryError):
        check(b"PK", Telling(kind="body", name="large"))
