"""Request bodies: each has a cap, whatever the address, and is refused as soon as it is known to be too long."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TypeVar

from pydantic import BaseModel, ValidationError
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from tryon_server.api.faults import LingeringReply
from tryon_server.problems import Problem, problem_error

MAX_JSON_BYTES = 2**16  # parsed on the event loop, in well under a millisecond
WHERE = re.compile(r" at line (\d+) column (\d+)$")

Request = TypeVar("Request", bound=BaseModel)


class CappedBodies:
    """Takes the body of a request in before the application sees the request: whole, or not at all.

    Args:
        app: the application.
        file_caps: most bytes of the body of a POST to these paths, and what an operator sets to raise that.

    Any other body may have ``MAX_JSON_BYTES``.
    """

    def __init__(self, app: ASGIApp, file_caps: Mapping[str, tuple[int, str]]) -> None:
        self._app = app
        self._file_caps = file_caps

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        file_cap = self._file_caps.get(scope["path"]) if scope["method"] == "POST" else None
        cap, setting = file_cap or (MAX_JSON_BYTES, "")
        announced = Headers(scope=scope).get("content-length", "")
        too_long = announced.isdecimal() and int(announced) > cap
        body = bytearray()
        more = not too_long
        while more:
            message = await receive()
            if message["type"] == "http.disconnect":
                return
            body += message.get("body", b"")
            too_long = len(body) > cap
            more = message.get("more_body", False) and not too_long
        if too_long:
            remedy = f"Send a smaller file, or raise {setting}"
            if file_cap is None:
                remedy = "Send only what /openapi.json names for this address"
            await LingeringReply(_too_long(cap, remedy), 413)(scope, receive, send)
            return
        whole: Message | None = {"type": "http.request", "body": bytes(body), "more_body": False}

        async def replay() -> Message:
            nonlocal whole
            if whole is None:
                return await receive()
            message, whole = whole, None
            return message

        await self._app(scope, replay, send)


def _too_long(cap: int, remedy: str) -> Problem:
    size = f"{cap / 2**20:g} MiB" if cap >= 2**20 else f"{cap / 2**10:g} KiB"
    message = f"the body of this request may have at most {cap} bytes ({size})"
    return Problem(code="body.too_long", place="body", message=message, remedy=remedy)


def json_body(kind: type[BaseModel]) -> dict[str, object]:
    """What /openapi.json is to say of a request whose body `read_json` reads."""
    return {"requestBody": {"required": True, "content": {"application/json": {"schema": kind.model_json_schema()}}}}


def read_json(content: bytes, kind: type[Request]) -> Request:
    """A request's body as what it is to be: JSON in UTF-8 of at most ``MAX_JSON_BYTES``.

    Raises:
        ProblemError: 422; its place is a field, ``$`` for the whole, or line and column of what is no JSON.
    """
    try:
        return kind.model_validate_json(content)
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False, include_input=False)[0]
    message, remedy = f"the request is not as expected: {first['msg']}", "See /openapi.json for what this address takes"
    place = ".".join(str(part) for part in first["loc"]) or "$"
    field = kind.model_fields.get(str(first["loc"][0])) if first["loc"] else None
    if field is not None and field.description:
        remedy = f"Of {first['loc'][0]!r} it expects: {field.description}. {remedy}"
    if first["type"] == "json_invalid":
        found = WHERE.search(first["msg"])
        place = f"line {found[1]} column {found[2]}" if found else "$"
        remedy = "Send JSON in UTF-8, without halves of surrogate pairs; see /openapi.json for what this address takes"
    raise problem_error("request.invalid", message, remedy, place=place, status=422)
