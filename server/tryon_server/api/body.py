"""Request bodies with a cap: counted while they arrive, refused as soon as they are known to be too long."""

from __future__ import annotations

from fastapi import Request

from tryon_server.problems import ProblemError, problem_error


async def read_capped(request: Request, cap: int, what: str) -> bytes:
    """The body of a request.

    Raises:
        ProblemError: 413 when it is, or announces to be, longer than ``cap`` bytes; ``what`` names it in the message.
    """
    announced = request.headers.get("content-length", "")
    if announced.isdecimal() and int(announced) > cap:
        raise _too_long(what, cap)
    parts: list[bytes] = []
    length = 0
    async for part in request.stream():
        length += len(part)
        if length > cap:
            raise _too_long(what, cap)
        parts.append(part)
    return b"".join(parts)


def _too_long(what: str, cap: int) -> ProblemError:
    return problem_error(
        "body.too_long",
        f"{what} may have at most {cap} bytes ({cap / 2**20:g} MiB)",
        "Send a smaller file, or raise TRYON_SERVER_MAX_PATTERN_BYTES",
        status=413,
    )
