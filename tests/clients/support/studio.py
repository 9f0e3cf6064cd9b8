"""A real server in a process of its own, whose sessions simulate the dress form. It can be killed and started again."""

from __future__ import annotations

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any
from urllib.request import urlopen

ROOT = Path(__file__).parents[3]
START_SECONDS = 60.0
FABRICS = {"cotton": (0.5, 0.02, 0.03), "denim": (0.02, 0.06, 0.4), "tight": (0.1, 0.1, 0.1)}


def build_page(folder: Path) -> str:
    """Build the page into ``folder``; what is missing if that can't be done, else nothing."""
    node = shutil.which("node")
    if node is None:
        return "no Node: the page can't be built"
    if not (ROOT / "node_modules" / "esbuild").is_dir():
        return "the page's dependencies are not installed: run `npm ci`"
    done = subprocess.run([node, ROOT / "clients/web/build.mjs", folder], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return ""


def piece(width: float, height: float, z: float) -> dict[str, Any]:
    """A rectangle [cm] of a pattern, in front of (z > 0) or behind the body."""
    return {
        "translation": [-width / 2, 80.0, z],
        "rotation": [0.0, 0.0, 0.0] if z > 0 else [0.0, 180.0, 0.0],
        "vertices": [[0, 0], [width, 0], [width, height], [0, height]],
        "edges": [{"endpoints": [i, (i + 1) % 4]} for i in range(4)],
    }


def pattern(width: float = 60.0) -> dict[str, Any]:
    """Two rectangles sewn at the sides."""
    panels = {"front": piece(width, 50.0, 30.0), "back": piece(width, 50.0, -30.0)}
    sides = [[{"panel": "front", "edge": i}, {"panel": "back", "edge": 4 - i}] for i in (1, 3)]
    return {
        "pattern": {"panels": panels, "stitches": sides},
        "properties": {"curvature_coords": "relative", "units_in_meter": 100},
    }


def free_port() -> int:
    """A port on which nobody listens at the moment."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Studio:
    """The server. ``url`` is the page's address; it stays the same over ``kill`` and ``start``. No dress form is
    dressed while there is a file ``held``."""

    def __init__(self, folder: Path, web: Path, workshop: str = "dress_form") -> None:
        self.port, self.held = free_port(), folder / "held"
        demo = folder / "demo"
        demo.mkdir()
        for name in ("tshirt", "cape"):
            (demo / f"{name}.json").write_text(json.dumps(pattern(60.0 if name == "tshirt" else 90.0)))
        self.url = f"http://127.0.0.1:{self.port}/"
        self._command = [sys.executable, __file__, str(self.port), str(folder), str(web), workshop]
        self._log = (folder / "server.log").open("w")
        self.start()

    def start(self) -> None:
        """Start the server and wait until it answers."""
        self._process = subprocess.Popen(self._command, stdout=self._log, stderr=self._log, start_new_session=True)
        deadline = time.monotonic() + START_SECONDS
        while True:
            try:
                with urlopen(f"{self.url}api/health", timeout=5):
                    return
            except OSError:
                assert self._process.poll() is None, f"the server ended, see {self._log.name}"
                assert time.monotonic() < deadline, f"the server does not answer, see {self._log.name}"
                time.sleep(0.1)

    def kill(self) -> None:
        """End the server and its simulations at once, without a goodbye."""
        os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()


def serve(port: int, folder: Path, web: Path, workshop: str) -> None:
    """Body of the server's process."""
    from tryon_server.app import create_app
    from tryon_server.runtime.interface import Catalogue, Device, FabricEntry, MotionEntry, Runtime
    from tryon_server.runtime.local_processes import LocalProcesses
    from tryon_server.runtime.order import Workshop
    from tryon_server.settings import Settings
    from tryon_server.streaming.server import Server, listen
    from tryon_solver.effect_words.table import WORDS
    from tryon_solver.materials.look import Look

    def fabric(name: str) -> FabricEntry:
        return FabricEntry(name, 0.2, 5e-4, 1.1, Look(colour=FABRICS[name]))

    def runtime(settings: Settings) -> Runtime:
        works = Workshop(f"{workshop}:build", f"{workshop}:load_motion", "pretended_effects:Compiled")
        return Runtime(
            placement=LocalProcesses(works, settings.session_memory_bytes),
            catalogue=Catalogue(
                motions=(MotionEntry("walk", 4.0), MotionEntry("turn", 4.0)),
                fabrics=tuple(fabric(name) for name in FABRICS),
                presets=("auto", "draft", "live", "fit", "reference"),
                effects=tuple(word.described() for word in WORDS),
            ),
            devices=lambda: (Device("cpu", "the test's processor", None),),
        )

    rate = 20.0 if workshop == "dress_form" else 60.0  # who follows a wearer in real time needs more
    settings = Settings(data_dir=folder / "data", frames_per_second=rate, session_grace_seconds=20.0, warm=False)
    Server(create_app(settings, runtime, patterns=folder / "demo", web=web)).run([listen("127.0.0.1", port)])


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "support"))
    serve(int(sys.argv[1]), Path(sys.argv[2]), Path(sys.argv[3]), sys.argv[4])
