"""Uvicorn as this server needs it: no compression of what is compressed already, and a goodbye before the end."""

from __future__ import annotations

import socket
from collections.abc import Callable

import uvicorn
from starlette.applications import Starlette

from tryon_protocol import MAX_CLIENT_MESSAGE_BYTES
from tryon_server.certificate import Certificate
from tryon_server.problems import problem_error
from tryon_server.services import Services

PING_SECONDS = 10.0  # a client that has vanished without a word is noticed after at most two of these
SHUTDOWN_SECONDS = 8
LARGEST_MESSAGE = 16 * MAX_CLIENT_MESSAGE_BYTES  # beyond the protocol's own limit, which is answered with an error


class Server(uvicorn.Server):
    """Tells clients that the server stops, before uvicorn closes their connections."""

    def __init__(
        self,
        app: Starlette,
        log_level: str = "warning",
        on_start: Callable[[], None] = lambda: None,
        certificate: Certificate | None = None,
    ) -> None:
        self._app = app
        self._on_start = on_start
        config = uvicorn.Config(
            app,
            log_level=log_level,
            ws="websockets-sansio",
            ws_per_message_deflate=False,
            ws_max_size=LARGEST_MESSAGE,
            ws_ping_interval=PING_SECONDS,
            ws_ping_timeout=PING_SECONDS,
            timeout_graceful_shutdown=SHUTDOWN_SECONDS,
            ssl_certfile=certificate.chain if certificate else None,
            ssl_keyfile=certificate.key if certificate else None,
        )
        super().__init__(config)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End the sessions, then the connections."""
        services: Services | None = getattr(self._app.state, "services", None)
        if services is not None:
            await services.sessions.close()
        await super().shutdown(sockets)

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start to answer, and say so."""
        await super().startup(sockets)
        if self.started:
            self._on_start()


def listen(host: str, port: int) -> socket.socket:
    """A socket that listens on this address; port 0 lets the system choose one.

    Raises:
        ProblemError: the address is taken or not this machine's.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.socket(family)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
    except OSError as error:
        listener.close()
        remedy = "Stop the program that uses it, or choose another --port"
        raise problem_error("address.taken", f"can't listen on {host} port {port}: {error.strerror}", remedy) from error
    return listener
