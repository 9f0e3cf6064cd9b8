"""Uvicorn as this server needs it: no compression of what is compressed already, and a goodbye before the end."""

from __future__ import annotations

import socket

import uvicorn
from fastapi import FastAPI
from tryon_protocol import MAX_CLIENT_MESSAGE_BYTES

from tryon_server.services import Services

PING_SECONDS = 10.0  # a client that has vanished without a word is noticed after at most two of these
SHUTDOWN_SECONDS = 8
LARGEST_MESSAGE = 16 * MAX_CLIENT_MESSAGE_BYTES  # beyond the protocol's own limit, which is answered with an error


class Server(uvicorn.Server):
    """Tells clients that the server stops, before uvicorn closes their connections."""

    def __init__(self, app: FastAPI, host: str, port: int, log_level: str = "warning") -> None:
        self._app = app
        config = uvicorn.Config(
            app,
            host=host,
            port=port,
            log_level=log_level,
            ws="websockets-sansio",
            ws_per_message_deflate=False,
            ws_max_size=LARGEST_MESSAGE,
            ws_ping_interval=PING_SECONDS,
            ws_ping_timeout=PING_SECONDS,
            timeout_graceful_shutdown=SHUTDOWN_SECONDS,
        )
        super().__init__(config)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End the sessions, then the connections."""
        services: Services | None = getattr(self._app.state, "services", None)
        if services is not None:
            await services.sessions.close()
        await super().shutdown(sockets)

    @property
    def bound_port(self) -> int:
        """The port that it listens on, once it has started; tells which one the system chose for port 0."""
        return int(self.servers[0].sockets[0].getsockname()[1])
