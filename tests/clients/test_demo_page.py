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
    """Until its first pose is behind the body: its clock is at 0 where the body stands dressed, below on the way."""
    page.wait_for_function("Number(document.getElementById('readout').dataset.simulatedS) > 0")


def covered(page: Page) -> tuple[np.ndarray, np.ndarray]:
    """The picture of a paused page (H, W, 3), and of it (H, W) what takes another colour: that is cloth."""
    page.locator("#colours label[title=\"The fabric's own colour\"]").click()
    plain = settled_picture(page)
    page.locator("#colours label[title='Ink']").click()
    dyed = settled_picture(page)
    return plain, np.abs(plain.astype(int) - dyed.astype(int)).max(axis=-1) > 40


def lowest(garment: np.ndarray) -> float:
    """How far down the picture it reaches, 0 to 1."""
    return float(np.flatnonzero(garment.any(axis=1)).max()) / len(garment)


def pause(page: Page) -> None:
    page.click("#play")
    page.wait_for_selector('#status[data-state="paused"]')


def shorten_by_dragging(page: Page, pixels: int) -> None:
    """Drag the front's hem up in the pattern, while the garment is worn, and wait until the edit is made. (Down, it
    would soon be at the sheet's border, and the sheet go on for as long as it is held there.)"""
    hem = page.locator(".piece").first.locator(".edge").first.locator(".reach")
    box = hem.bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    for step in range(1, 11):
        page.mouse.move(x, y - pixels * step / 10)
        page.wait_for_timeout(50)
    page.mouse.up()
    page.wait_for_selector("#pattern-made summary:has-text('1 edit made')")
    page.wait_for_selector('#pattern[aria-busy="false"]')


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

    pause(page)
    dressed, garment = covered(page)
    share = garment.mean()
    assert 0.01 < share < 0.5, f"the garment covers {share:.1%} of the picture"
    rows = np.flatnonzero(garment.any(axis=1)) / len(garment)
    background = dressed[2, 2].astype(int)
    body = (np.abs(dressed.astype(int) - background).max(axis=-1) > 60) & ~garment
    body_rows = np.flatnonzero(body.any(axis=1)) / len(body)
    assert body_rows.min() < rows.min(), "no head above the garment"
    assert body_rows.max() > rows.max(), "no legs below the garment"
    assert not np.array_equal(moving, dressed)

    page.click("#pattern-toggle")
    page.wait_for_selector("#pattern-sheet .piece >> nth=1")
    before_edit = lowest(covered(page)[1])
    page.click("#play")
    frames = figure(page, "frames")
    shorten_by_dragging(page, pixels=20)
    wait_for_frames(page, 15)
    assert figure(page, "frames") > frames
    pause(page)
    assert lowest(covered(page)[1]) < before_edit - 0.02, "the hem is where it was"
    assert page.faults == []
    page.context.close()
