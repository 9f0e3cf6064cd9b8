"""A server without a simulation, whose session has a sewing pattern: it says what a test has it say, and keeps what the
page sends."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket, WebSocketDisconnect
from studio import free_port

import tryon_protocol as wire
from tryon_protocol.messages import DesignEdge, DesignMessage, DesignPanel, DesignSeam

SECONDS = 30.0  # for anything that must happen sooner or later
SESSION = {
    "id": "s1",
    "garment": "shirt",
    "motion": "walk",
    "fabric": "cotton",
    "preset": "auto",
    "size": 1,
    "worn_size": 1.0,
    "body": None,
    "state": "running",
    "detail": "",
    "stream": "/api/sessions/s1/stream",
}
GARMENT = {"name": "Shirt", "panel_count": 2, "seam_count": 2, "area": 1.0, "notes": [], "built_in": True}


def look(name: str, colour: Sequence[float]) -> dict[str, Any]:
    """A fabric's look, whose pictures this server does not have: the page wears its colour."""
    maps = {f"{kind}_map": f"/api/looks/{name}/{kind}.png" for kind in ("colour", "normal", "roughness")}
    return {"colour": colour, "tile": [0.01, 0.01], "sheen": [0.0, 0.0, 0.0], "sheen_roughness": 0.5, **maps}


CATALOGUE: dict[str, list[dict[str, Any]]] = {
    "garments": [{"id": "shirt", "kept_as": None, **GARMENT}],
    "motions": [{"name": "walk", "seconds": 4.0, "title": "Walk", "found": None, "kept_as": None}],
    "bodies": [],
    "effects": [],
    "prints": [],
    "fabrics": [
        {"name": name, "areal_density": 0.2, "thickness": 5e-4, "strain_limit": 1.1, "look": look(name, colour)}
        for name, colour in (("cotton", [0.5, 0.02, 0.03]), ("denim", [0.1, 0.18, 0.36]))
    ],
}
Points = Sequence[tuple[float, float]]


def piece(name: str, corners: Points, bends: dict[int, Points] | None = None) -> DesignPanel:
    """A piece with straight edges, but where ``bends`` has the handle of a quadratic curve. [m]"""
    edges = []
    for i, start in enumerate(corners):
        end = corners[(i + 1) % len(corners)]
        bend = (bends or {}).get(i)
        handles = bend or tuple(mix(start, end, share) for share in (1 / 3, 2 / 3))
        along = [start, end]
        if bend:
            along = [mix(mix(start, bend[0], t / 16), mix(bend[0], end, t / 16), t / 16) for t in range(17)]
        shape = "quadratic" if bend else "line"
        ends = (i, (i + 1) % len(corners))
        edges.append(DesignEdge(ends=ends, shape=shape, handles=tuple(handles), points=tuple(along)))
    return DesignPanel(name=name, label="body", vertices=tuple(corners), edges=tuple(edges))


def mix(a: tuple[float, float], b: tuple[float, float], share: float) -> tuple[float, float]:
    return (a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]))


def design(width: float = 0.5, **changes: Any) -> DesignMessage:
    """Front and back with a round neck, sewn at their sides; the front as wide as told. [m]"""
    panels = tuple(
        piece(name, ((0.0, 0.0), (w, 0.0), (w, 0.6), (0.0, 0.6)), {2: ((w / 2, 0.45),)})
        for name, w in (("front", width), ("back", 0.5))
    )
    seams = (DesignSeam(first=(0, 1), second=(1, 3)), DesignSeam(first=(0, 3), second=(1, 1)))
    return DesignMessage(**{"held": False, "panels": panels, "seams": seams, "done": (), "undone": 0} | changes)


class Tailor:
    """The server, in a thread of its own. ``heard`` is what pages sent but for greetings, clocks and thanks."""

    def __init__(self, web: Path, pattern: DesignMessage | None) -> None:
        self.pattern = pattern
        self.heard: list[Any] = []
        self._sockets: set[WebSocket] = set()
        port = free_port()
        self.url = f"http://127.0.0.1:{port}/"
        routes = [
            *(Route(f"/api/{name}", self._offer(entries)) for name, entries in CATALOGUE.items()),
            Route("/api/sessions", self._session, methods=["POST"]),
            Route("/api/sessions/s1", self._session, methods=["GET", "DELETE"]),
            Route("/api/sessions/s1/garments", self._offer([])),
            Route("/api/sessions/s1/finish", self._offer({"dye": None, "print": None}), methods=["GET", "PUT"]),
            WebSocketRoute("/api/sessions/s1/stream", self._stream),
            Mount("/", StaticFiles(directory=web, html=True)),
        ]
        config = uvicorn.Config(Starlette(routes=routes), port=port, log_level="warning", timeout_graceful_shutdown=1)
        self._server = uvicorn.Server(config)
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_until_complete, args=(self._server.serve(),))
        self._thread.start()
        self._until(lambda: self._server.started, "it does not start")

    def say(self, message: wire.ServerMessage) -> None:
        """Tell it all pages; a pattern is told to those that come later, too."""
        if isinstance(message, DesignMessage):
            self.pattern = message
        for socket in tuple(self._sockets):
            asyncio.run_coroutine_threadsafe(socket.send_bytes(wire.encode(message)), self._loop).result(SECONDS)

    def hears(self, wanted: Callable[[Any], bool]) -> Any:
        """The first message of this kind, once it has come."""
        return self._until(lambda: next(filter(wanted, tuple(self.heard)), None), "no such message has come")

    def stop(self) -> None:
        self._server.should_exit = True
        self._thread.join(SECONDS)

    def _until(self, found: Callable[[], Any], otherwise: str) -> Any:
        deadline = time.monotonic() + SECONDS
        while not (result := found()):
            assert time.monotonic() < deadline, f"{otherwise}: {self.heard}"
            time.sleep(0.02)
        return result

    def _offer(self, entries: Any) -> Callable[[Request], Response]:
        return lambda _request: JSONResponse(entries)

    def _session(self, _request: Request) -> Response:
        return JSONResponse(SESSION)

    async def _stream(self, socket: WebSocket) -> None:
        await socket.accept(subprotocol=wire.SUBPROTOCOL)
        await socket.receive_bytes()  # hello
        for message in (welcome(), status(), self.pattern):
            if message is not None:
                await socket.send_bytes(wire.encode(message))
        self._sockets.add(socket)
        try:
            while True:
                message = wire.decode_client(await socket.receive_bytes())
                if isinstance(message, wire.PingMessage):
                    await socket.send_bytes(wire.encode(wire.PongMessage(t=message.t, clock=time.monotonic())))
                else:
                    self.heard.append(message)
        except WebSocketDisconnect:
            self._sockets.discard(socket)


def welcome() -> wire.WelcomeMessage:
    return wire.WelcomeMessage(
        version=1,
        session="s1",
        epoch="e1",
        server="tailor",
        clock=time.monotonic(),
        credit=2,
        topology_id=0,
        subjects=("wearer",),
        motions=("walk",),
        fabrics=("cotton", "denim"),
    )


def status() -> wire.StatusMessage:
    return wire.StatusMessage(state="running", detail="", motion="walk", fabric="cotton", playing=True)
