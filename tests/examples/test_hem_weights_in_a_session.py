"""The worked example in a session: an installed package brings it by an entry point, and REST knows it by name."""

import json
import os
import socket
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
from watching import Viewer, crossing

from tryon_solver.body.model import default_body_path

EXAMPLES = Path(__file__).parent
PATIENCE = 300.0  # s, for a machine that compiles kernels for the first time
HEM = [{"panel": panel, "edge": 0} for panel in ("front", "back")]


def installed(folder, points):
    """The environment of a process that has a package with these entry points installed."""
    told = folder / "hem_weights-1.0.dist-info"
    told.mkdir(parents=True)
    (told / "METADATA").write_text("Metadata-Version: 2.1\nName: hem-weights\nVersion: 1.0\n")
    (told / "entry_points.txt").write_text("[tryon.effects]\n" + "\n".join(points) + "\n")
    places = (str(folder), str(EXAMPLES), os.environ.get("PYTHONPATH", ""))
    return os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, places)), "TRYON_SERVER_WARM": "false"}


@pytest.fixture
def server(tmp_path):
    """Address of a server beside which the example is installed."""
    if not default_body_path().is_file():
        pytest.skip("there is no body: run `python scripts/make_body.py`, as `make test` does")
    with closing(socket.socket()) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "tryon_server.cli", "serve", "--port", str(port), "--data-dir", str(tmp_path)]
    environment = installed(tmp_path / "package", ['hem_weights = hem_weights_word:WORD'])
    process = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield f"http://127.0.0.1:{port}/api/"
    finally:
        process.terminate()
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def asked(url, method="GET", body=None):
    data = None if body is None else json.dumps(body).encode()
    with urlopen(Request(url, data, {"Content-Type": "application/json"}, method=method), timeout=PATIENCE) as reply:
        return json.load(reply)


def until(said):
    """What it says, once it is something."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        try:
            found = said()
        except OSError:
            found = None
        if found:
            return found
        time.sleep(0.2)
    raise AssertionError("it did not come")


@pytest.mark.timeout(2 * PATIENCE)
@pytest.mark.long
def test_a_session_wears_an_effect_that_an_installed_package_brings(server):
    effects = until(lambda: asked(f"{server}effects"))
    told = next(one for one in effects if one["name"] == "hem_weights")
    assert [field["name"] for field in told["fields"][0]["fields"]] == ["along", "mass"]

    session = asked(f"{server}sessions", "POST", {"garment": "tshirt", "motion": "walk", "preset": "draft"})["id"]
    viewer = Viewer(f"{server.replace('http', 'ws', 1)}sessions/{session}/stream")
    try:
        until(lambda: viewer.frames)
        worn = f"{server}sessions/{session}/effects"
        with pytest.raises(HTTPError) as refused:
            asked(f"{worn}/hem_weights", "PUT", {"parameters": {"lines": [{"along": HEM, "mass": 5.0}]}})
        assert json.load(refused.value)["place"].endswith("lines[0].mass")
        asked(f"{worn}/hem_weights", "PUT", {"parameters": {"lines": [{"along": HEM, "mass": 0.2}]}})

        def active():
            states = asked(worn)["effects"]
            return next(one for one in states if one["name"] == "hem_weights")["state"] == "active"

        until(active)
        assert "hem_weights" in asked(f"{worn}?measure=true")["plan"]
        viewer.wait(6)
    finally:
        viewer.close()
    assert viewer.errors == []
    assert crossing(viewer.seen) == 0


@pytest.mark.parametrize(
    ("points", "said"),
    [
        (["wind = hem_weights_word:WORD", "hem_weights = hem_weights_word:WORD"], "there is an effect 'hem_weights'"),
        (["hem_weights = nowhere:WORD"], "can't be loaded"),
        (["hem_weights = hem_weights_word:LINE"], "is of type tuple, not EffectWord"),
    ],
)
def test_what_brings_none_is_told_by_its_entry_point(points, said, tmp_path):
    command = [sys.executable, "-c", "import tryon_solver.effect_words.table"]
    ended = subprocess.run(command, env=installed(tmp_path, points), capture_output=True, text=True, check=False)
    assert ended.returncode != 0
    last = ended.stderr.strip().splitlines()[-1]
    assert "entry point" in last
    assert said in last
