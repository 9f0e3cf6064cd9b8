"""The helpers of the clients' tests are importable by name, also in the processes that the server spawns."""

import sys
from functools import partial
from pathlib import Path

import pytest

SUPPORT = Path(__file__).parent / "support"
sys.path.insert(0, str(SUPPORT))


@pytest.fixture(scope="session")
def browsers():
    """Starts headless Chromiums. They are the system's; none is ever downloaded."""
    from browser import find_chromium, launch
    from playwright.sync_api import sync_playwright

    path = find_chromium()
    if path is None:
        pytest.skip("no Chromium: install it, or name its executable in the environment variable CHROMIUM")
    with sync_playwright() as playwright:
        yield partial(launch, playwright, path)


@pytest.fixture(scope="session")
def chromium(browsers):
    """One that draws WebGL in software."""
    with browsers() as browser:
        yield browser


@pytest.fixture(scope="session")
def unseen(browsers):
    """One for tests that take no pictures of the wearer, none of which is drawn."""
    with browsers(seen=False) as browser:
        yield browser


@pytest.fixture(scope="session")
def web(tmp_path_factory):
    """The page, built from the sources as they are now."""
    from studio import build_page

    folder = tmp_path_factory.mktemp("web")
    problem = build_page(folder)
    if problem:
        pytest.skip(problem)
    return folder


@pytest.fixture(scope="session")
def studio(web, tmp_path_factory):
    """A server for all tests that leave it running."""
    from studio import Studio

    server = Studio(tmp_path_factory.mktemp("studio"), web)
    yield server
    server.kill()


@pytest.fixture(scope="module")
def patterned(web, tmp_path_factory):
    """A server whose garments have patterns: front and back, 60 cm by 50 cm, sewn along their edges 1 and 3."""
    from studio import Studio

    server = Studio(tmp_path_factory.mktemp("patterned"), web, "patterned_form")
    yield server
    server.kill()
