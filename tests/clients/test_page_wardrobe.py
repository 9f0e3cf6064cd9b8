"""The page's wardrobe in a real Chromium: garments put on over what is worn, moved, taken off; a refusal changes
nothing."""

from __future__ import annotations

import json
from contextlib import contextmanager
from urllib.request import urlopen

import numpy as np
import pytest
from browser import open_page, picture, settled_picture, wait_for_frames, wait_for_state

pytestmark = pytest.mark.browser

WORN = "[...document.querySelectorAll('#wardrobe-worn li')].map(row => row.dataset.worn).join()"


@pytest.fixture
def page(unseen, studio):
    with a_page(unseen, studio) as page:
        yield page


@contextmanager
def a_page(browser, studio):
    page = open_page(browser, studio.url)
    wait_for_state(page, "running")
    wait_for_frames(page)
    yield page
    assert page.faults == []
    page.context.close()


def wears(page, names: str) -> None:
    """Until the page shows these, the outermost first, and has nothing under way."""
    page.wait_for_function(f"names => {WORN} === names && !document.getElementById('wardrobe').disabled", arg=names)


def put_on(page, garment: str) -> None:
    page.select_option("#wardrobe-add", garment)
    page.click("#wardrobe-put-on")


def test_garments_are_put_on_moved_and_taken_off(chromium, studio):
    with a_page(chromium, studio) as page:
        wears(page, "tshirt")
        page.click("#play")
        alone = settled_picture(page)
        put_on(page, "cape")
        wears(page, "cape,tshirt")
        page.wait_for_function("document.querySelector('#wardrobe-worn input:checked').value === 'cape'")
        page.get_by_label("Wear Cape further in").click()
        wears(page, "tshirt,cape")
        rows = page.locator("#wardrobe-worn li")
        assert "taken off and put on again" in rows.nth(0).inner_text()
        assert "put on again" not in rows.nth(1).inner_text()
        session = page.evaluate("new URL(location.href).searchParams.get('session')")
        with urlopen(f"{studio.url}api/sessions/{session}/garments") as reply:
            assert [one["name"] for one in json.load(reply)] == ["cape", "tshirt"]
        both = settled_picture(page)
        assert (np.abs(both.astype(int) - alone).max(axis=2) > 40).mean() > 0.005  # the outer one is wider
        page.get_by_label("Take T-shirt off").click()
        wears(page, "cape")
        assert page.get_by_label("Take Cape off").is_disabled()


def test_what_takes_longer_is_told_in_a_line_and_can_be_cancelled(page):
    """The server is made to answer 202 at once, as it does where dressing takes long."""

    def at_once(route):
        route.continue_(headers={**route.request.headers, "prefer": "respond-async"})

    page.route("**/api/sessions/*/garments", at_once)
    wears(page, "tshirt")
    put_on(page, "cape")
    page.wait_for_selector("#wardrobe-doing:not([hidden])")
    assert page.inner_text("#wardrobe-doing span")
    assert page.locator("#wardrobe-doing").get_by_role("button", name="Cancel").is_enabled()
    wears(page, "cape,tshirt")
    page.wait_for_selector("#wardrobe-doing", state="hidden")
    cancelled = {"code": "job.cancelled", "place": "job", "message": "it was cancelled", "remedy": "Ask again"}
    asked = []

    def answered(route):
        asked.append(route.request.method)
        status = 204 if route.request.method == "DELETE" else 409
        route.fulfill(status=status, json=None if status == 204 else cancelled)

    job = {"state": "running", "detail": "Sewing", "progress": 0.5, "location": "/api/sessions/s/jobs/j"}
    page.route("**/jobs/j", answered)
    page.route("**/api/sessions/*/garments", lambda route: route.fulfill(status=202, json=job))
    put_on(page, "cape")
    page.locator("#wardrobe-doing").get_by_role("button", name="Cancel").click()
    page.wait_for_selector("#wardrobe-doing", state="hidden")
    assert asked == ["DELETE", "GET"]
    assert page.is_hidden("#notice"), "whoever cancels it needs not be told"
    wears(page, "cape,tshirt")


def test_what_can_t_be_put_on_is_told_and_what_is_worn_stays(page):
    wears(page, "tshirt")
    put_on(page, "cape")
    wears(page, "cape,tshirt")
    put_on(page, "cape")
    wears(page, "cape-3,cape,tshirt")
    before = picture(page).shape
    put_on(page, "cape")
    page.wait_for_selector("#notice:not([hidden])")
    assert page.inner_text("#notice-title") == "That can't be worn"
    assert "too tight over the others" in page.inner_text("#notice-message")
    wears(page, "cape-3,cape,tshirt")
    wait_for_frames(page)
    assert picture(page).shape == before
