"""Three garments over each other and a line made in the page: the real server and solver, a real Chromium. What is
streamed meanwhile is judged by ipctk."""

from __future__ import annotations

import json
from itertools import pairwise
from urllib.request import urlopen

import numpy as np
import pytest
from browser import figure, open_page, settled_picture, wait_for_frames
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


def told(url: str, session: str, path: str):
    with urlopen(f"{url}api/sessions/{session}/{path}") as reply:
        return json.load(reply)


@pytest.mark.timeout(3 * PATIENCE)
def test_shirt_skirt_and_overshirt_are_worn_reordered_and_taken_off(tmp_path, chromium):
    with serving(tmp_path) as url:
        page = open_page(chromium, url, 1280, 800)
        page.set_default_timeout(1000 * PATIENCE)
        wait_until_dressed(page)
        session = page.evaluate("new URL(location.href).searchParams.get('session')")
        viewer = Viewer(f"{url.replace('http', 'ws', 1)}api/sessions/{session}/stream")
        try:
            wears(page, "tshirt")
            make_a_hem_of_elastic(page)
            page.wait_for_selector("#effects-list [data-name=elastic][data-state=active][data-pending='']")
            [hem] = told(url, session, "effects/elastic")["parameters"]["lines"]
            assert hem["along"] == [{"panel": "front", "edge": 0}]
            counts = [figure(page, "vertices")]
            pictures = [still(page)]
            for garment, worn in (("skirt", "skirt,tshirt"), ("overshirt", "overshirt,skirt,tshirt")):
                put_on(page, garment)
                wears(page, worn)
                viewer.wait(FRAMES)
                counts.append(figure(page, "vertices"))
                pictures.append(still(page))
            assert counts == sorted(set(counts)), "each has vertices of its own"
            for before, after in pairwise(pictures):
                assert differing(before, after) > 0.005, "what is put on over it is seen"

            page.get_by_label("Wear Skirt further in").click()
            wears(page, "overshirt,tshirt,skirt")
            viewer.wait(FRAMES)
            assert figure(page, "vertices") == counts[-1]
            lines = told(url, session, "effects/elastic")["parameters"]["lines"]
            assert {edge["panel"].partition("/")[0] for line in lines for edge in line["along"]} == {"tshirt", "skirt"}

            page.get_by_label("Take Overshirt off").click()
            wears(page, "tshirt,skirt")
            viewer.wait(FRAMES)
            assert figure(page, "vertices") == counts[1]
        finally:
            viewer.close()
        assert [one["name"] for one in told(url, session, "garments")] == ["skirt", "tshirt"]
        assert viewer.errors == []
        judged = {len(frame.cloth) for _, frame in viewer.seen}
        assert judged >= set(counts), "frames of every outfit were judged"
        assert crossing(viewer.seen) == 0
        assert page.faults == []
        page.context.close()


def make_a_hem_of_elastic(page) -> None:
    page.click("#effects > summary")
    elastic = page.locator("#effects-list [data-name=elastic]")
    elastic.locator("summary").click()
    elastic.get_by_role("button", name="Add a line").click()
    edge = page.locator(".piece").first.locator(".edge .reach").first
    box = edge.bounding_box()
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.click("#pattern-close")


def still(page) -> np.ndarray:
    """The picture of what is worn, held still for it."""
    page.click("#play")
    page.wait_for_selector('#status[data-state="paused"]')
    shown = settled_picture(page)
    page.click("#play")
    wait_for_frames(page, 2)
    return shown


def differing(one: np.ndarray, other: np.ndarray) -> float:
    """The share of two pictures that is of another colour."""
    return float((np.abs(one.astype(int) - other).max(axis=-1) > 40).mean())
