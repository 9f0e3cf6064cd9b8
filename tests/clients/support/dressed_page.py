"""A page of which a module's tests change nothing for good, and what its server tells of its session."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from urllib.request import urlopen

from browser import open_page, wait_for_frames, wait_for_state
from playwright.sync_api import Browser, Page
from studio import Studio


@contextmanager
def opened(browser: Browser, url: str) -> Iterator[Page]:
    page = open_page(browser, url)
    yield page
    page.context.close()


@contextmanager
def as_it_began(page: Page) -> Iterator[None]:
    """With the garment worn in cotton, in the fabric's own colour, and moving. No error of it may be uncaught."""
    page.wait_for_selector("#play:enabled")
    if page.inner_text("#play-text") == "Play":
        page.click("#play")
    page.locator("#fabrics label", has_text="Cotton").click()
    page.locator("#colours label").first.click()
    wait_for_state(page, "running")
    wait_for_frames(page)
    yield
    assert page.faults == []


def session_of(page: Page) -> str:
    return page.evaluate("new URL(location.href).searchParams.get('session')")


def ask(studio: Studio, path: str):
    with urlopen(studio.url + path) as reply:
        return json.load(reply)
