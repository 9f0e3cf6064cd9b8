"""Three garments over each other: the real server and solver, the page in a real Chromium. What is streamed meanwhile
is judged by ipctk, of all pairs of garments and the body."""

from __future__ import annotations

import json
from urllib.request import urlopen

import pytest
from browser import figure, open_page
from demo_server import PATIENCE, serving, wait_until_dressed
from watching import Viewer, crossing

pytestmark = [pytest.mark.browser, pytest.mark.long]
WORN = "[...document.querySelectorAll('#wardrobe-worn li')].map(row => row.dataset.worn).join()"
FRAMES = 15  # of each outfit, that are waited for


def wears(page, names: str) -> None:
    """Until the page shows these, the outermost first, and has nothing under way; or tells why not."""
    page.wait_for_function(
        f"""names => !document.getElementById('notice').hidden
            || ({WORN} === names && !document.getElementById('wardrobe').disabled)""",
        arg=names,
    )
    assert page.locator("#notice").is_hidden(), page.inner_text("#notice")
    assert page.evaluate(WORN) == names


def put_on(page, garment: str) -> None:
    page.select_option("#wardrobe-add", garment)
    page.click("#wardrobe-put-on")


@pytest.mark.timeout(6 * PATIENCE)
def test_shirt_skirt_and_overshirt_are_worn_reordered_and_taken_off(tmp_path, chromium):
    with serving(tmp_path) as url:
        page = open_page(chromium, url, 640, 480)
        page.set_default_timeout(2000 * PATIENCE)
        wait_until_dressed(page)
        session = page.evaluate("new URL(location.href).searchParams.get('session')")
        viewer = Viewer(f"{url.replace('http', 'ws', 1)}api/sessions/{session}/stream")
        try:
            wears(page, "tshirt")
            viewer.wait(FRAMES)
            counts = [figure(page, "vertices")]
            for garment, worn in (("skirt", "skirt,tshirt"), ("overshirt", "overshirt,skirt,tshirt")):
                put_on(page, garment)
                wears(page, worn)
                viewer.wait(FRAMES)
                counts.append(figure(page, "vertices"))
            assert counts == sorted(set(counts)), "each has vertices of its own"

            page.get_by_label("Wear Skirt further in").click()
            wears(page, "overshirt,tshirt,skirt")
            viewer.wait(FRAMES)
            assert figure(page, "vertices") == counts[-1]

            page.get_by_label("Take Overshirt off").click()
            wears(page, "tshirt,skirt")
            viewer.wait(FRAMES)
            assert figure(page, "vertices") == counts[1]
        finally:
            viewer.close()
        with urlopen(f"{url}api/sessions/{session}/garments") as reply:
            assert [one["name"] for one in json.load(reply)] == ["skirt", "tshirt"]
        assert viewer.errors == []
        assert {len(frame.cloth) for _, frame in viewer.seen} >= set(counts), "frames of every outfit were judged"
        assert crossing(viewer.seen) == 0
        assert page.faults == []
        page.context.close()
