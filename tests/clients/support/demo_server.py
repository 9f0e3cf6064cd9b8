"""The demo's server as `make demo` starts it: the real server, with the real solver, for tests of the page."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.request import urlopen

import pytest
from playwright.sync_api import Page
from studio import free_port

PATIENCE = 600.0  # [s] for a machine that compiles the solver's kernels for the first time, shared with others
BODY_COMMAND = "python scripts/make_body.py"


@contextmanager
def serving(folder: Path) -> Iterator[str]:
    """Address of `tryon serve` on a free port, with its data in this folder. The page must have been built."""
    from tryon_server.api.page import WEB_FOLDER
    from tryon_solver.body.model import default_body_path

    for made, command in ((WEB_FOLDER / "index.html", "npm ci && npm run build"), (default_body_path(), BODY_COMMAND)):
        if not made.is_file():
            pytest.skip(f"{made.name} is not there: run `{command}`, as `make test` does")
    port, log = free_port(), folder / "server.log"
    kept = str(folder / "data")
    command = [sys.executable, "-m", "tryon_server.cli", "serve", "--port", str(port), "--data-dir", kept]
    with log.open("w") as sink:
        server = subprocess.Popen(
            command, stdout=sink, stderr=subprocess.STDOUT, env=os.environ | {"PYTHONUNBUFFERED": "1"}
        )
    try:
        wait_until_it_answers(f"http://127.0.0.1:{port}/", server, log)
        yield f"http://127.0.0.1:{port}/"
    finally:
        server.terminate()
        try:
            server.wait(20)
        except subprocess.TimeoutExpired:
            server.kill()
            server.wait()


def wait_until_it_answers(url: str, server: subprocess.Popen[bytes], log: Path) -> None:
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        assert server.poll() is None, f"the server ended:\n{log.read_text()}"
        try:
            with urlopen(f"{url}api/health", timeout=5):
                return
        except OSError:
            time.sleep(0.2)
    raise AssertionError(f"the server does not answer:\n{log.read_text()}")


def wait_until_dressed(page: Page) -> None:
    """Until the garment moves; a garment that can't be worn is told with the server's own words."""
    page.wait_for_function(
        "['running', 'failed'].includes(document.getElementById('status').dataset.state)", timeout=1000 * PATIENCE
    )
    assert page.get_attribute("#status", "data-state") == "running", page.inner_text("#status-text")
