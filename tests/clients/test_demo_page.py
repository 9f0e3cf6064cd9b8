"""The demo as `make demo` starts it: the real server, the real solver, the page in a real Chromium."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path
from urllib.request import urlopen

import numpy as np
import pytest
from browser import figure, open_page, picture, settled_picture, wait_for_frames
from studio import free_port

pytestmark = pytest.mark.browser

PATIENCE = 600.0  # [s] for a machine that compiles the solver's kernels for the first time, shared with others
BODY_COMMAND = "python scripts/make_body.py"


@pytest.fixture
def demo(tmp_path):
    """Address of `tryon serve` on a free port, with a data folder of its own. The page must have been built."""
    from tryon_server.api.page import WEB_FOLDER
    from tryon_solver.body.model import default_body_path

    for made, command in ((WEB_FOLDER / "index.html", "npm ci && npm run build"), (default_body_path(), BODY_COMMAND)):
        if not made.is_file():
            pytest.skip(f"{made.name} is not there: run `{command}`, as `make test` does")
    port = free_port()
    log = tmp_path / "server.log"
    command = [
        sys.executable,
        "-m",
        "tryon_server.cli",
        "serve",
        "--port",
        str(port),
        "--data-dir",
        str(tmp_path / "data"),
    ]
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


def wait_until_it_answers(url: str, server: subprocess.Popen, log: Path) -> None:
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        assert server.poll() is None, f"the server ended:\n{log.read_text()}"
        try:
            with urlopen(f"{url}api/health", timeout=5):
                return
        except OSError:
            time.sleep(0.2)
    raise AssertionError(f"the server does not answer:\n{log.read_text()}")


def wait_until_dressed(page) -> None:
    """Until the garment moves; a garment that can't be worn is told with the server's own words."""
    page.wait_for_function(
        "['running', 'failed'].includes(document.getElementById('status').dataset.state)", timeout=1000 * PATIENCE
    )
    assert page.get_attribute("#status", "data-state") == "running", page.inner_text("#status-text")


@pytest.mark.timeout(2 * PATIENCE)
def test_the_demo_shows_a_dressed_walking_body(demo, chromium):
    page = open_page(chromium, demo)
    page.set_default_timeout(1000 * PATIENCE)
    wait_until_dressed(page)
    wait_for_frames(page, 3)
    assert page.locator("#garments label", has_text="T-shirt").locator("input").is_checked()
    assert page.locator("#motions label", has_text="Walk").locator("input").is_checked()
    assert figure(page, "vertices") > 500
    before = {name: figure(page, name) for name in ("simulated-s", "frames", "root-x", "root-z")}
    wait_for_frames(page, 5)
    after = {name: figure(page, name) for name in before}
    assert after["frames"] > before["frames"]
    assert after["simulated-s"] > before["simulated-s"]
    assert (after["root-x"], after["root-z"]) != (before["root-x"], before["root-z"]), "the body stands still"
    page.wait_for_selector("#readout:not([data-solver-ms=''])", state="attached")
    assert figure(page, "solver-ms") > 0
    assert figure(page, "body-lag-mm") >= 0
    assert figure(page, "max-stretch-percent") > -100
    moving = picture(page)

    page.click("#play")
    page.wait_for_selector('#status[data-state="paused"]')
    dressed = settled_picture(page)
    page.locator("#colours label[title='Ink']").click()
    dyed = settled_picture(page)
    garment = np.abs(dressed.astype(int) - dyed.astype(int)).max(axis=-1) > 40  # what took the colour is cloth
    share = garment.mean()
    assert 0.01 < share < 0.5, f"the garment covers {share:.1%} of the picture"
    rows = np.flatnonzero(garment.any(axis=1)) / len(garment)
    background = dressed[2, 2].astype(int)
    body = (np.abs(dressed.astype(int) - background).max(axis=-1) > 60) & ~garment
    body_rows = np.flatnonzero(body.any(axis=1)) / len(body)
    assert body_rows.min() < rows.min(), "no head above the garment"
    assert body_rows.max() > rows.max(), "no legs below the garment"
    assert not np.array_equal(moving, dressed)
    assert page.faults == []
    page.context.close()
