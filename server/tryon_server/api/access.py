"""Who may ask: web pages of this server and of the origins that its operator named. Programs send no origin and may."""

from __future__ import annotations

from typing import Annotated
from urllib.parse import urlsplit

from fastapi import Depends
from starlette.datastructures import Headers
from starlette.requests import HTTPConnection

from tryon_server.problems import problem_error
from tryon_server.services import Services

READING = ("GET", "HEAD", "OPTIONS")


def services(connection: HTTPConnection) -> Services:
    """The parts of the running server."""
    return connection.app.state.services


ServicesDep = Annotated[Services, Depends(services)]


def same_origin(headers: Headers, allowed_origins: tuple[str, ...]) -> bool:
    """Whether a request comes from a page of this server, from an allowed origin, or from no page at all."""
    origin = headers.get("origin")
    if origin is None or origin in allowed_origins:
        return True
    return urlsplit(origin).netloc == headers.get("host")


def refuse_strangers(connection: HTTPConnection) -> None:
    """Raise ProblemError 403 for a request that changes something and comes from a page of another origin.

    A page of another origin can't read the reply, but without this it could upload patterns and open sessions.
    """
    settings = services(connection).settings
    if connection.scope.get("method") not in READING and not same_origin(connection.headers, settings.allowed_origins):
        raise problem_error(
            "origin.refused",
            f"pages of {connection.headers['origin']} may not use this server",
            "Add the origin to TRYON_SERVER_ALLOWED_ORIGINS",
            status=403,
        )
