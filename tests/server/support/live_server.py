"""A real server on loopback, in a thread of its own, whose sessions simulate the analytic drape."""

from __future__ import annotations

import asyncio
import threading
from pathlib import Path

import httpx
import patterns
from fastapi import FastAPI

from tryon_server.app import create_app
from tryon_server.runtime.interface import Catalogue, Device, FabricEntry, MotionEntry, Runtime
from tryon_server.runtime.local_processes import LocalProcesses
from tryon_server.runtime.order import Workshop
from tryon_server.settings import Settings
from tryon_server.streaming.server import Server, listen
from tryon_solver.effect_words.table import WORDS
from tryon_solver.materials.look import Look

FABRICS = ("cotton", "denim", "tight", "nan", "failing", "crash", "greedy")
CATALOGUE = Catalogue(
    motions=(MotionEntry("sway", 1.0),),
    fabrics=tuple(FabricEntry(name, 0.2, 5e-4, 1.1, Look()) for name in FABRICS),
    presets=("auto", "draft", "live", "fit", "reference"),
    effects=tuple(word.described() for word in WORDS),
)


def analytic_runtime(settings: Settings) -> Runtime:
    workshop = Workshop("analytic_drape:build", "analytic_drape:load_motion", "pretended_effects:Compiled")
    return Runtime(
        placement=LocalProcesses(workshop, settings.session_memory_bytes),
        catalogue=CATALOGUE,
        devices=lambda: (Device("cpu", "the test's processor", 2**30),),
    )


def make_app(folder: Path, runtime=analytic_runtime, **settings):
    """An application whose data and only demo garment, ``tube``, lie in ``folder``. A change is waited for as long as a
    client may have it waited for: whether it is answered by 202 is not up to how busy the machine is."""
    demo = folder / "demo"
    demo.mkdir(exist_ok=True)
    (demo / "tube.json").write_bytes(patterns.as_bytes(patterns.tube()))
    patient = {"answer_seconds": Settings().longest_wait_seconds}
    chosen = Settings(**({"data_dir": folder / "data", "warm": False} | patient | settings))
    return create_app(chosen, runtime, patterns=demo, web=folder / "web")


class LiveServer:
    """Runs until ``stop``. ``http`` talks to it; ``stream_url`` is the address of a new session's stream."""

    def __init__(self, folder: Path, app: FastAPI | None = None, **settings) -> None:
        """With an `app` of its own, or that of `make_app`."""
        self.app = app or make_app(folder, **settings)
        self.server = Server(self.app)
        listener = listen("127.0.0.1", 0)
        self.port = listener.getsockname()[1]
        self.thread = threading.Thread(target=lambda: asyncio.run(self.server.serve([listener])), daemon=True)
        self.thread.start()
        while not self.server.started:
            assert self.thread.is_alive(), "the server did not start"
            self.thread.join(0.01)
        self.http = httpx.Client(base_url=f"http://127.0.0.1:{self.port}", timeout=60.0)

    def stop(self) -> None:
        self.http.close()
        self.server.should_exit = True
        self.thread.join(60.0)
        assert not self.thread.is_alive(), "the server did not stop"

    def open(self, **wishes) -> str:
        """Open a session; its id."""
        reply = self.http.post("/api/sessions", json={"garment": "tube", "motion": "sway", "fabric": "cotton"} | wishes)
        assert reply.status_code == 201, reply.text
        return reply.json()["id"]

    def stream_url(self, session_id: str) -> str:
        return f"ws://127.0.0.1:{self.port}/api/sessions/{session_id}/stream"

    def pid(self, session_id: str) -> int:
        """Number of a session's process."""
        live = self.app.state.services.sessions.get(session_id)
        return live._simulation.pid
