"""A headset without a head: sends a simulated tracker's poses in real time and measures the frames that come back."""

from __future__ import annotations

import asyncio
import contextlib
import json
import ssl
import time
from collections.abc import Iterator
from dataclasses import dataclass
from urllib.error import HTTPError, URLError
from urllib.parse import urlsplit, urlunsplit
from urllib.request import Request, urlopen

import numpy as np
import numpy.typing as npt

from tryon_protocol import (
    DecodedFrame,
    ErrorMessage,
    PingMessage,
    PlayMessage,
    PongMessage,
    SetMotionMessage,
    StatusMessage,
)

from .frame_ages import FrameAges
from .simulated_tracker import SimulatedTracker, TrackerErrors
from .stream import Stream, as_exception, connect

PING_SECONDS = 0.5
WARM_UP_SECONDS = 3.0  # while the body comes from where it stood to where the wearer is
CLIENT = "tryon-headset-sim"


class RefusedError(Exception):
    """The server did not open a session; the message says why."""


@dataclass(frozen=True)
class Outcome:
    """What came of a run.

    Attributes:
        sent: poses sent. captured: poses there were; the difference got lost on purpose.
        ages: of the frames. errors: what the server had to object, each different sentence once.
    """

    sent: int
    captured: int
    ages: FrameAges
    errors: tuple[str, ...]

    def text(self) -> str:
        """For people."""
        lines = [
            f"{self.captured} poses captured, {self.sent} sent; {self.ages.count} frames counted, "
            f"{self.ages.rate():.1f} a second",
            self.ages.table(),
            *(f"the server objected: {error}" for error in self.errors),
        ]
        return "\n".join(lines)


async def replay(
    url: str,
    roots: npt.NDArray[np.float64],
    rotations: npt.NDArray[np.float64],
    errors: TrackerErrors,
    convention: str = "webxr",
    trust: ssl.SSLContext | None = None,
) -> Outcome:
    """Have a session's body follow a simulated tracker, and measure until the last pose is sent.

    Args:
        url: address of the session's stream.
        roots: (T,3) m, and rotations: (T,J,4): poses of the session's body, one per capture at ``errors.rate``.
        errors: how the tracker errs.
        convention: how it tells its poses, one of `simulated_tracker.CONVENTIONS`.
        trust: for wss with a certificate of one's own.

    Raises:
        ProtocolError: the session failed, or its body can't be tracked so.
        OSError, websockets.WebSocketException: the connection failed.
    """
    async with connect(url, client=CLIENT, trust=trust) as stream:
        await stream.send(SetMotionMessage(motion=None))
        await stream.send(PlayMessage())
        await _dressed(stream)
        assert stream.topology is not None
        tracker = SimulatedTracker(stream.topology.body, roots, rotations, errors, convention)
        subject = stream.welcome.subjects[0]
        skeleton = tracker.skeleton(subject)
        if skeleton is not None:
            await stream.send(skeleton)
        start = time.monotonic()
        poses = tracker.poses(subject, start)
        ages = FrameAges(start + min(WARM_UP_SECONDS, 0.5 * len(roots) / errors.rate))
        measuring = asyncio.create_task(_measure(stream, ages))
        pinging = asyncio.create_task(_ping(stream))
        try:
            for pose in poses:
                await asyncio.sleep(max(0.0, start + pose.leaves - time.monotonic()))
                if measuring.done():
                    break
                await stream.send(pose.message)
        finally:
            pinging.cancel()
            measuring.cancel()
            outcome = (await asyncio.gather(measuring, pinging, return_exceptions=True))[0]
        if isinstance(outcome, Exception):
            raise outcome
        told = tuple(dict.fromkeys(f"{error.message} {error.remedy}" for error in stream.errors))
        return Outcome(len(poses), len(roots), ages, told)


async def _dressed(stream: Stream) -> None:
    """Until there is a garment on a body. Raises ProtocolError when there will be none."""
    async for event in stream:
        if isinstance(event, StatusMessage) and event.state == "failed":
            raise as_exception(ErrorMessage(code="simulation_failed", place="$", message=event.detail, remedy=""))
        if isinstance(event, DecodedFrame):
            return


async def _measure(stream: Stream, ages: FrameAges) -> None:
    async for event in stream:
        now = time.monotonic()
        if isinstance(event, DecodedFrame):
            ages.frame(event, now)
        elif isinstance(event, PongMessage):
            ages.pong(event, now)


async def _ping(stream: Stream) -> None:
    while True:
        await stream.send(PingMessage(t=time.monotonic()))
        await asyncio.sleep(PING_SECONDS)


@contextlib.contextmanager
def session(server: str, garment: str, preset: str | None, trust: ssl.SSLContext | None) -> Iterator[str]:
    """Address of the stream of a new session, which ends with the block.

    Raises:
        RefusedError: the server doesn't answer, or refuses.
    """
    opened = _ask(server, "POST", "/api/sessions", {"garment": garment, "motion": None, "preset": preset}, trust)
    parts = urlsplit(server)
    scheme = "wss" if parts.scheme == "https" else "ws"
    try:
        yield urlunsplit((scheme, parts.netloc, opened["stream"], "", ""))
    finally:
        with contextlib.suppress(RefusedError):
            _ask(server, "DELETE", f"/api/sessions/{opened['id']}", None, trust)


def _ask(
    server: str, method: str, path: str, body: dict[str, str | None] | None, trust: ssl.SSLContext | None
) -> dict[str, str]:
    parts = urlsplit(server)
    if parts.scheme not in ("http", "https"):
        raise RefusedError(f"{server!r} is no http or https address")
    request = Request(
        urlunsplit((parts.scheme, parts.netloc, path, "", "")),
        method=method,
        data=None if body is None else json.dumps(body).encode(),
        headers={"content-type": "application/json"},
    )
    try:
        with urlopen(request, timeout=30, context=trust) as reply:
            answer: dict[str, str] = json.load(reply) if reply.status != 204 else {}
            return answer
    except HTTPError as error:
        raise RefusedError(f"the server answered {error.code}: {error.read().decode(errors='replace')}") from error
    except (URLError, OSError) as error:
        raise RefusedError(f"{server} doesn't answer: {getattr(error, 'reason', error)}") from error
