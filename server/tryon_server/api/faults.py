"""Every error reply has the same four fields: code, place, message, remedy."""

from __future__ import annotations

import asyncio
import logging
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException
from starlette.types import Receive, Scope, Send

from tryon_server.api.models import ProblemReply
from tryon_server.problems import Problem, ProblemError

LINGER_SECONDS = 30.0  # how long the rest of a refused body is read and thrown away

logger = logging.getLogger(__name__)

ERROR_REPLIES: dict[int | str, dict[str, Any]] = {
    status: {"model": ProblemReply} for status in (400, 403, 404, 409, 410, 413, 422, 500, 503)
}


def reply(problem: Problem, status: int) -> JSONResponse:
    """A problem as JSON."""
    return JSONResponse(_body(problem), status)


def _body(problem: Problem) -> dict[str, str]:
    fields = ProblemReply(code=problem.code, place=problem.place, message=problem.message, remedy=problem.remedy)
    return {name: _encodable(text) for name, text in fields.model_dump().items()}


def _encodable(text: str) -> str:
    """The text with halves of surrogate pairs, which no reply can hold, written as escapes."""
    return text.encode("utf-8", "backslashreplace").decode()


class LingeringReply(JSONResponse):
    """A reply to a request whose body is not wanted: sent at once, then the body is thrown away for a while.

    A connection that is closed while the client still sends is reset, and the client loses the reply with it.
    """

    def __init__(self, problem: Problem, status: int) -> None:
        super().__init__(_body(problem), status, {"Connection": "close"})

    async def __call__(self, _scope: Scope, receive: Receive, send: Send) -> None:
        start = {"type": "http.response.start", "status": self.status_code, "headers": self.raw_headers}
        await send(start)
        await send({"type": "http.response.body", "body": self.body, "more_body": True})
        try:
            await asyncio.wait_for(_throw_away(receive), LINGER_SECONDS)
        except asyncio.TimeoutError:
            logger.debug("a client still sends a body that was refused")
        await send({"type": "http.response.body", "body": b""})


async def _throw_away(receive: Receive) -> None:
    while (await receive()).get("more_body", False):
        pass


def install(app: FastAPI) -> None:
    """Have ``app`` answer every failure with a ``ProblemReply``."""
    app.add_exception_handler(ProblemError, _problem)
    app.add_exception_handler(RequestValidationError, _invalid_request)
    app.add_exception_handler(HTTPException, _http)
    app.add_exception_handler(Exception, _unexpected)


async def _problem(_request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, ProblemError)
    return reply(error.problem, error.status)


async def _invalid_request(_request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    first = error.errors()[0]
    place = ".".join(str(part) for part in first["loc"][1:]) or "$"
    message = f"the request is not as expected: {first['msg']}"
    problem = Problem(
        code="request.invalid", place=place, message=message, remedy="See /openapi.json for what this address takes"
    )
    return reply(problem, 422)


async def _http(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    problem = Problem(
        code=f"http.{error.status_code}",
        place="",
        message=f"{request.method} {request.url.path}: {error.detail}",
        remedy="See /openapi.json for the addresses of this server",
    )
    return reply(problem, error.status_code)


async def _unexpected(request: Request, error: Exception) -> JSONResponse:
    logger.error("%s %s failed", request.method, request.url.path, exc_info=error)
    problem = Problem(
        code="server.fault",
        place="",
        message="the server failed to answer this request",
        remedy="Try again; if it fails again, report it with the server's log",
    )
    return reply(problem, 500)
