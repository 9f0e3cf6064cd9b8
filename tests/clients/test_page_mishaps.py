"""What goes wrong in the midst of something: in a real Chromium, for a real server. Nothing is lost, and it is told."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import contextmanager
from urllib.request import Request, urlopen

import pytest
from browser import PATIENCE, open_page, wait_for_frames, wait_for_state
from studio import Studio, pattern

pytestmark = pytest.mark.browser
WORN = "[...document.querySelectorAll('#wardrobe-worn li')].map(row => row.dataset.worn).join()"


@pytest.fixture
def page(unseen, patterned):
    """A page with the pattern beside the picture. It must run without an uncaught error."""
    with a_page(unseen, patterned.url) as page:
        yield page


@contextmanager
def a_page(browser, url: str):
    page = open_page(browser, url, 1280, 800)
    wait_for_state(page, "running")
    page.wait_for_selector("#pattern-toggle:visible")
    page.click("#pattern-toggle")
    page.wait_for_selector(".piece .corner >> nth=2")
    yield page
    assert page.faults == []
    page.context.close()


def ask(server, page, path: str = "", method: str = "GET", body: object = None):
    session = page.evaluate("new URL(location.href).searchParams.get('session')")
    data = None if body is None else json.dumps(body).encode()
    headers = {"Content-Type": "application/json"}
    request = Request(f"{server.url}api/sessions/{session}{path}", data, headers, method=method)
    with urlopen(request) as reply:
        return json.load(reply)


def comes(page, true: Callable[[], bool]) -> None:
    for _ in range(PATIENCE // 50):
        if true():
            return
        page.wait_for_timeout(50)
    raise AssertionError("it does not come about")


def kinds(server, page) -> list[str]:
    return [one["edit"]["kind"] for one in ask(server, page, "/edits") if "kind" in one["edit"]]


def middle(locator) -> tuple[float, float]:
    box = locator.bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def corner(page, number: int, of: int = 0):
    return page.locator(".piece").nth(of).locator(".corner").nth(number)


def grab(page, number: int = 2, by: float = 30) -> None:
    """Begin to drag a corner, and hold it."""
    x, y = middle(corner(page, number))
    page.mouse.move(x, y)
    page.mouse.down()
    for step in (0.3, 0.7, 1.0):
        page.mouse.move(x + by * step, y)
        page.wait_for_timeout(40)


def put_on_a_cape(page) -> None:
    page.select_option("#wardrobe-add", "cape")
    page.click("#wardrobe-put-on")
    page.wait_for_function(f"{WORN} === 'cape,tshirt' && !document.getElementById('wardrobe').disabled")
    page.wait_for_function("document.querySelector('#wardrobe-worn input:checked').value === 'cape'")
    page.wait_for_selector(".piece .edge .reach[aria-label='Edge 0 of front, open, 90.0 cm']", state="attached")


def test_a_fabric_that_is_chosen_during_a_drag_is_worn_and_the_drag_kept(page, patterned):
    grab(page)
    page.evaluate("document.querySelector('#fabrics input[value=denim]').click()")
    comes(page, lambda: "change_fabric" in kinds(patterned, page))
    page.mouse.up()
    comes(page, lambda: kinds(patterned, page) == ["change_fabric", "move_vertex"])
    assert ask(patterned, page)["fabric"] == "denim"
    assert page.locator("#notice").is_hidden()


def test_a_fabric_that_is_refused_during_a_drag_is_told_and_the_drag_kept(page, patterned):
    before = ask(patterned, page)["fabric"]
    grab(page)
    page.evaluate("document.querySelector('#fabrics input[value=tight]').click()")
    page.wait_for_selector("#notice:visible")
    assert "can't be worn" in page.inner_text("#notice-message")
    page.mouse.up()
    comes(page, lambda: kinds(patterned, page) == ["move_vertex"])
    assert ask(patterned, page)["fabric"] == before
    page.wait_for_function("before => document.querySelector('#fabrics input:checked').value === before", arg=before)


def test_a_garment_that_is_taken_off_during_a_drag_lets_go_and_no_other_is_edited(page, patterned):
    put_on_a_cape(page)
    grab(page)
    ask(patterned, page, "/garments/cape", "DELETE")
    page.wait_for_selector("#notice:visible")
    assert page.inner_text("#notice-title") == "What you were dragging was let go"
    page.mouse.move(*middle(corner(page, 0)))
    page.mouse.up()
    wait_for_frames(page)
    assert kinds(patterned, page) == [], "the T-shirt, which is edited now, is as it was"
    assert page.evaluate(WORN) == "tshirt"


def test_a_garment_that_is_taken_off_while_a_line_is_chosen_on_it_ends_the_choice(page, patterned):
    put_on_a_cape(page)
    page.click("#effects > summary")
    elastic = page.locator("[data-name=elastic]")
    elastic.locator("summary").click()
    elastic.get_by_role("button", name="Add a line").click()
    page.wait_for_selector(".pattern-sheet.choosing-edge")
    ask(patterned, page, "/garments/cape", "DELETE")
    page.wait_for_selector("#notice:visible")
    assert page.inner_text("#notice-title") == "Nothing was chosen"
    page.mouse.click(*middle(page.locator(".piece .edge .reach").first))
    page.wait_for_function("document.getElementById('pattern-chosen').textContent.startsWith('Edge 0 of front')")
    assert ask(patterned, page, "/effects/elastic")["state"] == "absent"
    assert elastic.locator(".row").count() == 0


def changed(change: Callable[[dict], None]) -> bytes:
    made = pattern()
    change(made["pattern"])
    return json.dumps(made).encode()


BAD = {
    "cut off": (b'{"pattern": {"panels": ', "Not a JSON file", "line 1 column 24"),
    "empty": (b"", "The file is empty", "garment"),
    "no text": (bytes(range(256)) * 100, "neither JSON nor OBJ nor GLB", "garment"),
    "no pattern": (b"[1, 2]", "not a sewing pattern", "specification"),
    "too large": (b'{"pattern": "' + b"x" * (100 << 20) + b'"}', "at most 16777216 bytes", "body"),
    "no such edge": (
        changed(lambda made: made["stitches"][0][1].update(edge=9)),
        "no edge 9",
        "stitches[0][1].edge",
    ),
    "sides that don't fit": (
        changed(lambda made: made["panels"]["back"].update(vertices=[[0, 0], [60, 0], [60, 150], [0, 150]])),
        "differ too much in length",
        "stitches[0]",
    ),
    "sewn twice": (changed(lambda made: made["stitches"].append(made["stitches"][0])), "sewn twice", "stitches[2][0]"),
}


def test_bad_files_are_refused_with_place_and_remedy_and_the_session_goes_on(page, tmp_path):
    session = page.url
    for name, (content, message, place) in BAD.items():
        file = tmp_path / f"{name.replace(' ', '_')}.json"
        file.write_bytes(content)
        page.set_input_files("#pattern-file", file)
        page.wait_for_selector("#notice:visible")
        assert page.inner_text("#notice-title") == f"{file.name} can't be worn"
        assert message in page.inner_text("#notice-message"), name
        assert page.inner_text("#notice-place") == place, name
        assert page.inner_text("#notice-remedy"), name
        page.click("#notice-close")
    assert page.url == session
    wait_for_frames(page)


def test_a_page_that_is_reloaded_while_it_dresses_comes_to_what_was_chosen(page):
    before = page.url
    page.locator("#garments label", has_text="Cape").click()
    page.wait_for_function("before => location.href !== before", arg=before)
    chosen = page.url
    page.reload()
    wait_for_state(page, "running")
    assert page.url == chosen
    assert page.locator("#garments label", has_text="Cape").locator("input").is_checked()


def test_of_two_pages_one_edits_and_one_changes_effects_and_what_one_that_goes_holds_is_let_go(
    page, unseen, patterned
):
    with a_page(unseen, page.url) as other:
        other.click("#effects > summary")
        wind = other.locator("[data-name=wind]")
        wind.locator("summary").click()
        grab(page)
        x = middle(corner(page, 2))[0]
        other.wait_for_function(
            "x => Math.abs(document.querySelectorAll('.corner')[2].getBoundingClientRect().x + 4.5 - x) < 4", arg=x
        )
        wind.locator("button[data-state=active]").click()
        comes(page, lambda: ask(patterned, page, "/effects/wind")["state"] == "active")
        page.mouse.up()
        comes(page, lambda: kinds(patterned, page) == ["move_vertex"])
        assert ask(patterned, page, "/effects/wind")["state"] == "active"
        page.wait_for_selector('#pattern[aria-busy="false"]')
        page.wait_for_timeout(300)
        kept = middle(corner(page, 1))[0]
        grab(other, 1, by=-40)
        left = "x => Math.abs(document.querySelectorAll('.corner')[1].getBoundingClientRect().x + 4.5 - x)"
        page.wait_for_function(f"at => ({left})(at) > 15", arg=kept)
    page.wait_for_function(f"at => ({left})(at) < 3", arg=kept)
    assert kinds(patterned, page) == ["move_vertex"], "what was held and not let go is not kept"


def test_after_the_server_was_killed_all_that_was_worn_goes_on(unseen, web, tmp_path):
    """The pattern as it was edited, effects, the cape over it, and the half of a row that was not whole yet."""
    server = Studio(tmp_path, web, "patterned_form")
    try:
        with a_page(unseen, server.url) as page:
            grab(page)
            page.mouse.up()
            comes(page, lambda: kinds(server, page) == ["move_vertex"])
            put_on_a_cape(page)
            lines = [{"along": [{"panel": "cape/front", "edge": 0}]}]
            ask(server, page, "/effects/elastic", "PUT", {"parameters": {"lines": lines}})
            comes(page, lambda: ask(server, page, "/effects/elastic")["state"] == "active")
            page.click("#effects > summary")
            fasteners = page.locator("[data-name=fasteners]")
            fasteners.locator("summary").click()
            fasteners.get_by_role("button", name="Add a row").click()
            page.mouse.click(*middle(page.locator(".piece .edge .reach").first))
            page.wait_for_function("document.getElementById('pattern-chosen').textContent.includes('second')")
            edited = ask(server, page, "/pattern?garment=tshirt")["pattern"]
            before = page.url
            server.kill()
            page.wait_for_selector('#status[data-link="reconnecting"]')
            server.start()
            page.wait_for_function("before => location.href !== before", arg=before)
            wait_for_state(page, "running")
            comes(page, lambda: ask(server, page, "/effects/elastic")["state"] == "active")
            assert ask(server, page, "/effects/elastic")["parameters"]["lines"][0]["along"] == lines[0]["along"]
            assert [one["name"] for one in ask(server, page, "/garments")] == ["tshirt", "cape"]
            assert ask(server, page, "/pattern?garment=tshirt")["pattern"] == edited
            comes(page, lambda: fasteners.locator(".row.draft .fixed").count() == 2)
            assert fasteners.locator(".row.draft .fixed").first.inner_text() == "cape/front, edge 0"
    finally:
        server.kill()


@pytest.mark.long
def test_a_session_that_ended_while_nobody_watched_is_gone_on_from(unseen, patterned):
    with a_page(unseen, patterned.url) as page:
        grab(page)
        page.mouse.up()
        comes(page, lambda: kinds(patterned, page) == ["move_vertex"])
        edited, address = ask(patterned, page, "/pattern")["pattern"], page.url
        page.goto("about:blank")
        session = address.rpartition("=")[2]
        with urlopen(Request(f"{patterned.url}api/sessions/{session}", method="DELETE")):
            pass
        page.goto(address)
        wait_for_state(page, "running")
        assert page.inner_text("#notice-title") == "That session has ended"
        assert page.url != address
        assert ask(patterned, page, "/pattern")["pattern"] == edited
