"""The websocket side of a live session: one task reads, one task writes, and neither waits for the other."""

from __future__ import annotations

import asyncio
import contextlib

from starlette.websockets import WebSocket, WebSocketDisconnect

from tryon_protocol import SUBPROTOCOL
from tryon_server.streaming.live_session import LiveSession
from tryon_server.streaming.outbox import Closing, Outbox

CLOSE_SECONDS = 5.0  # a client that reads nothing is cut off this long after its connection was to be closed
LEFT = (1000, 1001, 1005)  # close codes of a client that leaves: done, page left, none given (RFC 6455 section 7.4.1)


async def serve_client(websocket: WebSocket, session: LiveSession) -> None:
    """Accept a client and serve it until either side ends the connection."""
    await websocket.accept(subprotocol=SUBPROTOCOL)
    client, outbox = session.connect()
    sending = asyncio.create_task(_send(websocket, outbox))
    receiving = asyncio.create_task(_receive(websocket, session, client))
    closing = asyncio.create_task(outbox.closing.wait())
    left = False
    try:
        await asyncio.wait({sending, receiving, closing}, return_when=asyncio.FIRST_COMPLETED)
        if closing.done() and not receiving.done():
            await asyncio.wait({sending}, timeout=CLOSE_SECONDS)
        elif not receiving.done():  # a frame found the connection closed: how, the reading side is told
            await asyncio.wait({receiving}, timeout=CLOSE_SECONDS)
        left = receiving.done() and receiving.exception() is None and receiving.result()
    finally:
        for task in (sending, receiving, closing):
            task.cancel()
        await asyncio.gather(sending, receiving, closing, return_exceptions=True)
        session.disconnect(client, left)


async def _send(websocket: WebSocket, outbox: Outbox) -> None:
    with contextlib.suppress(WebSocketDisconnect):  # the reading side sees it too and ends the connection
        while not isinstance(item := await outbox.take(), Closing):
            await websocket.send_bytes(item)
        await websocket.close(item.code, _shortened(item.reason))


async def _receive(websocket: WebSocket, session: LiveSession, client: int) -> bool:
    """Hands on what the client sends until the connection ends; returns whether the client itself closed it.

    A connection that broke has no reason; its code is 1005 as well.
    """
    while True:
        message = await websocket.receive()
        if message["type"] == "websocket.disconnect":
            return message.get("code") in LEFT and message.get("reason") is not None
        if message.get("bytes") is not None:
            session.receive(client, message["bytes"])
        else:
            session.receive_text(client)
        await asyncio.sleep(0)  # a burst is all there at once: the answers to it leave meanwhile, and don't pile up


def _shortened(reason: str) -> str:
    """A close frame has room for 123 bytes of reason (RFC 6455 section 5.5)."""
    return reason.encode()[:123].decode(errors="ignore")
