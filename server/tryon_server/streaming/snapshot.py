"""What a live session shows now, taken as a client takes it: a topology and one decoded frame."""

from __future__ import annotations

import asyncio

from tryon_protocol import (
    MAJOR_VERSION,
    ByeMessage,
    DecodedFrame,
    ErrorMessage,
    FrameDecoder,
    GoodbyeMessage,
    HelloMessage,
    Topology,
    TopologyMessage,
    decode_server,
    encode,
    is_frame,
)
from tryon_server.problems import ProblemError, problem_error
from tryon_server.streaming.live_session import LiveSession
from tryon_server.streaming.outbox import Closing, Outbox

WAIT_SECONDS = 10.0  # for a frame of a garment that is dressed


async def snapshot(live: LiveSession) -> tuple[Topology, DecodedFrame]:
    """The newest frame of a session, and what it refers to.

    Raises:
        ProblemError: 409, nothing is dressed yet or not any more; 503, it takes no more clients.
    """
    state = live.machine.status(live.now)
    if state.state in ("preparing", "dressing", "failed"):
        raise _not_dressed(state.detail)
    client, outbox = live.connect()
    try:
        hello = HelloMessage(versions=(MAJOR_VERSION,), client="tryon-snapshot", codecs=("zstd",), resume=None)
        live.receive(client, encode(hello))
        return await asyncio.wait_for(_first_frame(outbox), WAIT_SECONDS)
    except asyncio.TimeoutError as error:
        raise _not_dressed("no frame came") from error
    finally:
        live.receive(client, encode(ByeMessage()))
        live.disconnect(client, left=True)


async def _first_frame(outbox: Outbox) -> tuple[Topology, DecodedFrame]:
    """Raises ProblemError when the session says that there will be none."""
    decoder, topology = FrameDecoder(), None
    while not isinstance(item := await outbox.take(), Closing):
        if is_frame(item):
            if topology is not None:
                return topology, decoder.decode(item)
            continue
        message = decode_server(item)
        if isinstance(message, TopologyMessage):
            topology = Topology.from_message(message)
            decoder.set_topology(topology)
        elif isinstance(message, ErrorMessage) and message.fatal:
            raise problem_error(f"session.{message.code}", message.message, message.remedy, status=503)
        elif isinstance(message, GoodbyeMessage):
            raise _ended()
    raise _ended()


def _not_dressed(detail: str) -> ProblemError:
    message, remedy = f"the garment is not to be seen: {detail}", "Ask again when GET of the session says that it runs"
    return problem_error("session.not_dressed", message, remedy, place="session", status=409)


def _ended() -> ProblemError:
    remedy = "Open a new one with POST /api/sessions"
    return problem_error("session.ended", "the session has ended", remedy, place="session", status=409)
