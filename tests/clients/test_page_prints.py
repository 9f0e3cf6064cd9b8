"""Looks on the page, in a real Chromium: the fabric's weave, a print over it, and the file of what is seen."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from browser import open_page, picture, wait_for_frames, wait_for_state

from tryon_server.looks.png import png

pytestmark = pytest.mark.browser

YELLOW, GREEN = (250, 210, 0), (0, 120, 20)
STRIPES = png(np.array([YELLOW, GREEN], np.uint8)[np.indices((16, 16))[0] // 8 % 2])


@pytest.fixture(scope="module")
def page(chromium, studio):
    page = open_page(chromium, studio.url)
    wait_for_state(page, "running")
    wait_for_frames(page)
    yield page
    assert page.faults == []
    page.context.close()


def choose(page, name: str, content: bytes, width: str = "12") -> None:
    page.fill("#print-width", width)
    page.set_input_files("#print-file", files=[{"name": name, "mimeType": "image/png", "buffer": content}])


def yellowish(image: np.ndarray) -> int:
    red, green, blue = (image[..., i].astype(int) for i in range(3))
    return int(((red > 120) & (green > 90) & (blue < 0.5 * green) & (red > green)).sum())


def greenish(image: np.ndarray) -> int:
    red, green, blue = (image[..., i].astype(int) for i in range(3))
    return int(((green > 40) & (green > 1.6 * red) & (green > 1.6 * blue)).sum())


def until(page, seen, least: int) -> None:
    """Until so many pixels are seen: a picture takes a while to come."""
    for _ in range(60):
        if seen(picture(page)) >= least:
            return
        page.wait_for_timeout(250)
    raise AssertionError(f"{seen.__name__}: {seen(picture(page))} pixels, {least} were to be seen")


def test_a_print_is_worn_listed_saved_and_taken_off(page):
    assert (yellowish(picture(page)), greenish(picture(page))) == (0, 0)
    choose(page, "stripes.png", STRIPES)
    until(page, yellowish, 500)
    until(page, greenish, 500)
    assert page.locator("#prints label", has_text="stripes").locator("input").is_checked()
    with page.expect_download() as download:
        page.click("#save-glb")
    content = Path(download.value.path()).read_bytes()
    assert content[:4] == b"glTF"
    assert STRIPES in content
    other = open_page(page.context.browser, page.url)
    until(other, yellowish, 500)  # who joins the session sees it, too
    assert other.locator("#prints label", has_text="stripes").locator("input").is_checked()
    other.context.close()
    page.locator("#prints label", has_text="None").click()
    for _ in range(60):
        if yellowish(picture(page)) == 0:
            break
        page.wait_for_timeout(250)
    assert (yellowish(picture(page)), greenish(picture(page))) == (0, 0)


def test_a_picture_that_can_not_be_read_is_refused_with_what_to_do(page):
    choose(page, "broken.png", STRIPES[:-30])
    page.wait_for_selector("#notice:not([hidden])")
    said = page.inner_text("#notice")
    assert "broken.png can't be printed" in said
    assert "Save it again as PNG" in said
    page.click("#notice-close")


def test_a_width_that_is_none_is_asked_for(page):
    choose(page, "stripes.png", STRIPES, width="")
    page.wait_for_selector("#notice:not([hidden])")
    assert "0.5 to 500" in page.inner_text("#notice")
    page.click("#notice-close")


def test_swatches_show_each_fabric_s_own_weave(page):
    textures = page.eval_on_selector_all(
        "#fabrics .cloth", "all => all.map(one => getComputedStyle(one).backgroundImage)"
    )
    assert len(textures) == len(set(textures)) == 3
    assert all("/colour.png" in texture for texture in textures)
