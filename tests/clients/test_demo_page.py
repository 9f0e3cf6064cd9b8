"""The demo as `make demo` starts it: the real server, the real solver, the page in a real Chromium."""

from __future__ import annotations

import numpy as np
import pytest
from browser import figure, open_page, picture, settled_picture, wait_for_frames
from demo_server import PATIENCE, serving, wait_until_dressed
from playwright.sync_api import Page

pytestmark = pytest.mark.browser


@pytest.fixture
def demo(tmp_path):
    """Address of `tryon serve` on a free port, with a data folder of its own."""
    with serving(tmp_path) as url:
        yield url


def wait_for_the_motion(page: Page) -> None:
    """Until its first pose is behind the body: the clock is at 0 in the dressing stance, below on the way there."""
    page.wait_for_function("Number(document.getElementById('readout').dataset.simulatedS) > 0")


@pytest.mark.timeout(2 * PATIENCE)
def test_the_demo_shows_a_dressed_walking_body(demo, chromium):
    page = open_page(chromium, demo)
    page.set_default_timeout(1000 * PATIENCE)
    wait_until_dressed(page)
    wait_for_frames(page, 3)
    assert page.locator("#garments label", has_text="T-shirt").locator("input").is_checked()
    assert page.locator("#motions label", has_text="Walk").locator("input").is_checked()
    assert figure(page, "vertices") > 500
    wait_for_the_motion(page)
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
