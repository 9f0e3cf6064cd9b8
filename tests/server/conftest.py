"""The helpers of the server's tests are importable by name, also in the processes that the server spawns."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent / "support"))


@pytest.fixture(scope="session")
def live(tmp_path_factory):
    """One server for all tests that leave it as they found it."""
    from live_server import LiveServer

    server = LiveServer(tmp_path_factory.mktemp("live"))
    yield server
    server.stop()


@pytest.fixture
def held_server(tmp_path):
    """A server of its own, and the file that holds whatever is dressed there until it is removed."""
    import held_dressing
    from live_server import LiveServer

    held = tmp_path / "held"
    held.touch()
    server = LiveServer(tmp_path, held_dressing.make_app(tmp_path))
    yield server, held
    held.unlink(missing_ok=True)
    server.stop()
