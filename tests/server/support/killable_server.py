"""A real server in a process group of its own, which dies without a chance to write anything."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import httpx

SCRIPT = Path(__file__).with_name("serve_app.py")


class KillableServer:
    """Serves the application that `app`, "module:function", makes of this folder, from `start` to `kill`, and again."""

    def __init__(self, folder: Path, app: str) -> None:
        with socket.create_server(("127.0.0.1", 0)) as probe:
            self.port = probe.getsockname()[1]
        self._command = [sys.executable, str(SCRIPT), str(folder), str(self.port), app, *sys.path]
        self._process: subprocess.Popen[bytes] | None = None
        self.http = httpx.Client(base_url=f"http://127.0.0.1:{self.port}", timeout=120.0)

    def __enter__(self) -> KillableServer:
        self.start()
        return self

    def __exit__(self, *_exception: object) -> None:
        self.kill()
        self.http.close()

    def start(self) -> None:
        self._process = subprocess.Popen(self._command, start_new_session=True)
        for _ in range(600):
            try:
                self.http.get("/api/health")
                return
            except httpx.TransportError:
                assert self._process.poll() is None
                time.sleep(0.05)
        raise AssertionError("the server did not start")

    @property
    def pid(self) -> int:
        """Number of its process, which is that of its group, too."""
        assert self._process is not None
        return self._process.pid

    def kill(self) -> None:
        """With -9, and every process that it began."""
        if self._process is not None:
            os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()
            self._process = None

    def stream_url(self, session: str) -> str:
        return f"ws://127.0.0.1:{self.port}/api/sessions/{session}/stream"

    def open(self, **wishes: object) -> str:
        """A new session; its id."""
        reply = self.http.post("/api/sessions", json=wishes)
        assert reply.status_code == 201, reply.text
        return reply.json()["id"]

    def dressed(self, session: str, seconds: float = 120.0) -> dict:
        """What is told of the session once its garment is worn."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            told = self.http.get(f"/api/sessions/{session}").json()
            if told["state"] == "running":
                return told
            assert told["state"] != "failed", told["detail"]
            time.sleep(0.05)
        raise AssertionError(told)
