"""The dial of accuracy, the deadline, the preset and their plot on the page, in a real Chromium."""

from __future__ import annotations

import asyncio
import json
import re
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any
from urllib.request import Request, urlopen

import pytest
from browser import PATIENCE, another_session, open_page, wait_for_frames, wait_for_state
from dress_form import QUICKEST

from tryon_client import connect
from tryon_protocol import DecodedFrame, ReportMessage, StatusMessage, Topology

pytestmark = pytest.mark.browser

RESTED = 400  # ms, longer than the dial waits for another key
KEYS = """dial => {
    for (const position of [3, 8, 12, 20, 25]) {
        dial.value = position;
        for (const told of ["input", "change"]) dial.dispatchEvent(new Event(told, { bubbles: true }));
    }
}"""
"""as fast as they repeat; each changes the dial's value"""


@pytest.fixture(scope="module")
def shared(unseen, studio):
    page = open_page(unseen, studio.url)
    wait_for_state(page, "running")
    yield page
    page.context.close()


@pytest.fixture
def page(shared):
    """The page with its section open, nothing chosen. It must run without an uncaught error."""
    if not shared.evaluate("document.getElementById('accuracy').open"):
        shared.click("#accuracy > summary")
    shared.click("#accuracy-default")
    shared.locator("#deadlines button", has_text="none").click()
    shared.select_option("#solved-as", "")
    wait_for_in_force(shared, "Draft")
    wait_for_state(shared, "running")
    yield shared
    assert shared.faults == []


def session_of(page) -> str:
    return page.evaluate("new URL(location.href).searchParams.get('session')")


def ask(studio, page) -> dict:
    with urlopen(f"{studio.url}api/sessions/{session_of(page)}") as reply:
        return json.load(reply)


def choose_elsewhere(studio, page, **choice) -> None:
    """As somebody else would."""
    path = f"{studio.url}api/sessions/{session_of(page)}/accuracy"
    urlopen(Request(path, json.dumps(choice).encode(), {"Content-Type": "application/json"}, method="PUT")).close()


def dial_to(page, accuracy: str) -> None:
    """By its keys, as one who sees what it says."""
    page.locator("#accuracy-dial").focus()
    page.keyboard.press("Home")
    for _ in range(26):
        if page.inner_text("#accuracy-told") == f"about {accuracy}":
            return
        page.keyboard.press("ArrowRight")
    raise AssertionError(f"the dial has no {accuracy}")


def wait_for_in_force(page, name: str) -> None:
    told = f"frames are solved as {name}"
    page.wait_for_function(f"document.getElementById('solved-as-told').textContent === '{told}'")


def wait_for_plot(page, selector: str) -> None:
    page.wait_for_selector(f"#price-plot {selector}", state="attached")


@contextmanager
def another_client(studio, page) -> Iterator[list[Any]]:
    """What another client of the page's session receives: frames, topologies, messages; it grows meanwhile."""
    stream = f"{studio.url}api/sessions/{session_of(page)}/stream".replace("http", "ws", 1)
    received: list[Any] = []
    over = threading.Event()

    async def listen() -> None:
        async with connect(stream) as client:
            async for event in client:
                received.append(event)
                if over.is_set():
                    return

    with ThreadPoolExecutor(1) as thread:  # the browser's driver has an event loop running in this one
        done = thread.submit(asyncio.run, listen())
        wait_for(page, lambda: any(isinstance(event, DecodedFrame) for event in received))
        yield received
        over.set()
        done.result(30)


def wait_for(page, true: Callable[[], bool]) -> None:
    for _ in range(PATIENCE // 50):
        if true():
            return
        page.wait_for_timeout(50)
    raise AssertionError("it does not come about")


def test_choices_reach_another_client_and_nothing_is_dressed_anew(page, studio):
    session = session_of(page)
    with another_client(studio, page) as received:
        dial_to(page, "0.05 mm")
        page.locator("#deadlines button", has_text="33").click()
        wait_for(page, lambda: told(received)[-1] == (5e-5, 33.0))
        seen = len(received)
        wait_for(page, lambda: sum(isinstance(event, DecodedFrame) for event in received[seen:]) > 5)
        page.click("#accuracy-default")
        wait_for(page, lambda: told(received)[-1] == (None, 33.0))
    frames = [event for event in received if isinstance(event, DecodedFrame)]
    assert len({frame.topology_id for frame in frames}) == 1
    assert sum(isinstance(event, Topology) for event in received) == 1
    numbers = [frame.seq for frame in frames]
    assert numbers == sorted(numbers)
    assert {event.state for event in received if isinstance(event, StatusMessage)} == {"running"}
    reported = [event for event in received if isinstance(event, ReportMessage)]
    assert any(report.error == pytest.approx(5e-5) for report in reported), "the solver has not heard of it"
    assert session_of(page) == session


def told(received: list[Any]) -> list[tuple[float | None, float | None]]:
    return [(event.accuracy, event.deadline_ms) for event in received if isinstance(event, StatusMessage)]


def test_a_preset_reaches_another_client_and_comes_in_force_while_frames_go_on(page, studio):
    session = session_of(page)
    with another_client(studio, page) as received:
        page.select_option("#solved-as", "fit")
        wait_for_in_force(page, "Fit")
        wait_for(page, lambda: any(isinstance(event, ReportMessage) and event.iterations == 8 for event in received))
    presets = [
        (event.preset, event.preset_in_force, event.preset_pending)
        for event in received
        if isinstance(event, StatusMessage)
    ]
    assert list(dict.fromkeys(presets)) == [(None, "draft", False), ("fit", "draft", True), ("fit", "fit", False)]
    frames = [event for event in received if isinstance(event, DecodedFrame)]
    assert len({frame.topology_id for frame in frames}) == 1
    numbers = [frame.seq for frame in frames]
    assert numbers == sorted(numbers)
    assert session_of(page) == session, "nothing is dressed anew"
    assert page.text_content("#accuracy-short").startswith("Fit, ")
    page.select_option("#solved-as", "")
    wait_for_in_force(page, "Draft")
    assert ask(studio, page)["chosen_preset"] is None


def test_a_preset_that_another_client_chooses_is_shown_and_what_fails_is_told(page, studio):
    choose_elsewhere(studio, page, preset="live")
    wait_for_in_force(page, "Live")
    assert page.input_value("#solved-as") == "live"
    page.select_option("#solved-as", "reference")  # which breaks
    page.wait_for_function("document.getElementById('solved-as').value === 'live'")
    wait_for_in_force(page, "Live")
    notice = page.locator("#notice")
    assert "reference could not be built" in notice.inner_text()
    assert "open a session with it" in notice.inner_text()
    page.keyboard.press("Escape")


def test_another_session_of_the_page_is_solved_by_the_preset_again(page, studio):
    page.select_option("#solved-as", "live")
    wait_for_in_force(page, "Live")
    session = session_of(page)
    with another_session(page):
        page.locator("#presets label", has_text="Fit").click()
    assert session_of(page) != session
    wait_for(page, lambda: ask(studio, page)["preset_in_force"] == "live")
    told = ask(studio, page)
    assert (told["preset"], told["chosen_preset"]) == ("fit", "live"), "its mesh is as fine as it was opened"
    with another_session(page):
        page.locator("#presets label", has_text="Auto").click()


def test_a_drag_of_the_dial_is_sent_once_where_it_is_let_go(page, studio):
    dial = page.locator("#accuracy-dial")
    dial.scroll_into_view_if_needed()
    box = dial.bounding_box()
    y = box["y"] + box["height"] / 2
    with another_client(studio, page) as received:
        before, said = len(told(received)), []
        page.mouse.move(box["x"] + 0.1 * box["width"], y)
        page.mouse.down()
        for share in (0.3, 0.7, 0.4, 1.0):
            page.mouse.move(box["x"] + share * box["width"] - 1, y, steps=4)
            page.wait_for_timeout(RESTED)
            said.append(page.inner_text("#accuracy-told"))
        assert len(set(said)) == 4, "what is dialled is said at once"
        assert told(received)[before:] == [], "nothing is sent before it is let go"
        page.mouse.up()
        wait_for(page, lambda: told(received)[-1] == (3e-3, None))
        page.wait_for_timeout(RESTED)
        assert told(received)[before:] == [(3e-3, None)]


def test_keys_at_the_dial_are_sent_once_they_rest(page, studio):
    with another_client(studio, page) as received:
        before = len(told(received))
        page.locator("#accuracy-dial").evaluate(KEYS)
        wait_for(page, lambda: told(received)[-1] == (3e-3, None))
        page.wait_for_timeout(RESTED)
        assert told(received)[before:] == [(3e-3, None)]


def test_what_another_client_chooses_is_shown(page, studio):
    choose_elsewhere(studio, page, accuracy=2e-4, deadline_ms=66)
    page.wait_for_function("document.getElementById('accuracy-told').textContent === 'about 0.2 mm'")
    assert page.input_value("#deadline") == "66"
    assert page.locator("#deadlines button[aria-pressed='true']").inner_text() == "66"
    assert page.locator("#accuracy-dial").get_attribute("aria-valuetext") == "about 0.2 mm"
    assert page.locator("#accuracy-default[aria-pressed='false']").count() == 1
    choose_elsewhere(studio, page, accuracy=0.05)  # further than the dial goes
    page.wait_for_function("document.getElementById('accuracy-told').textContent === 'about 50 mm'")
    assert page.input_value("#accuracy-dial") == page.locator("#accuracy-dial").get_attribute("max")
    assert page.input_value("#deadline") == ""
    choose_elsewhere(studio, page)
    page.wait_for_selector("#accuracy-default[aria-pressed='true']")
    assert page.inner_text("#accuracy-told") == "as the detail has it"


def test_a_bad_deadline_is_told_beside_the_field_and_not_sent(page, studio):
    page.fill("#deadline", "50")
    page.keyboard.press("Enter")
    wait_for(page, lambda: ask(studio, page)["deadline_ms"] == 50)
    for bad in ("0.5", "20000", "-3"):
        page.fill("#deadline", bad)
        page.keyboard.press("Enter")
        assert page.inner_text("#deadline-hint") == "A deadline is 1 to 10 000 ms; leave it empty for none"
        page.wait_for_timeout(800)  # longer than anything waits to be sent
        assert ask(studio, page)["deadline_ms"] == 50
        assert page.input_value("#deadline") == bad
    page.fill("#deadline", "")
    assert page.locator("#deadline-hint").is_hidden()
    wait_for(page, lambda: ask(studio, page)["deadline_ms"] is None)


def test_the_plot_has_lines_at_what_is_asked_for_and_a_dot_for_each_frame(page):
    assert page.locator("#price-plot .deadline, #price-plot .asked").count() == 0
    dial_to(page, "0.1 mm")
    page.locator("#deadlines button", has_text="100").click()
    wait_for_plot(page, ".deadline")
    wait_for_plot(page, ".asked")
    assert page.locator("#price-plot .deadline-label").text_content() == "deadline 100 ms"
    # the dial has come by others, and what a report is held to is what was asked of its frame
    wait_for(page, lambda: page.locator("#price-plot .asked-label").text_content() == "about 0.1 mm")
    assert [text.text_content() for text in page.locator("#price-plot .title").all()] == [
        "time of solving a frame, ms",
        "estimated error, mm",
    ]
    dots = page.locator("#price-plot .dot").count()
    wait_for(page, lambda: page.locator("#price-plot .dot").count() > dots)
    assert page.locator("#price-plot .newest").count() == 1
    # nor need a frame of this deadline be one of this accuracy: the two are sent as they are chosen
    told = re.compile("0.1 mm in .* ms; deadline 100 ms, met")
    wait_for(page, lambda: told.fullmatch(page.locator("#price-plot").get_attribute("aria-label")))
    at = page.evaluate(
        """() => {
            const read = (kind, name) => Number(document.querySelector(`#price-plot .${kind}`).getAttribute(name));
            const left = read("asked", "x1"); // where 0 ms is
            return {
                error: read("newest", "cy"), asked: read("asked", "y1"),
                share: (read("newest", "cx") - left) / (read("deadline", "x1") - left),
                ms: tryon.readout.solverMs,
            };
        }"""
    )
    assert at["error"] == pytest.approx(at["asked"], abs=0.02), "its error is what was asked for"
    assert at["share"] == pytest.approx(at["ms"] / 100, abs=1e-3)
    assert page.locator("#price-plot .newest.late").count() == 0


def test_late_frames_are_marked_and_advised_of(page):
    page.fill("#deadline", "5")
    page.keyboard.press("Enter")
    wait_for_plot(page, ".dot.newest.late")
    assert page.locator("#price-plot").get_attribute("aria-label").endswith("; deadline 5 ms, missed by 15.0 ms")
    assert "came late" in page.inner_text("#price-late")
    page.wait_for_selector("#advice:visible")
    late = 1e3 * QUICKEST - 5
    assert page.inner_text("#advice").startswith(f"The deadline was missed by {late:.1f} ms")


def test_the_plot_is_drawn_only_while_its_section_is_open(page):
    wait_for_plot(page, ".dot")
    page.click("#accuracy > summary")
    drawn = "document.getElementById('price-plot').innerHTML"
    before = page.evaluate(drawn)
    wait_for_frames(page, 20)
    assert page.evaluate(drawn) == before
    page.click("#accuracy > summary")
    wait_for(page, lambda: page.evaluate(drawn) != before)


def test_another_session_of_the_page_has_the_choice_again(page, studio):
    dial_to(page, "0.02 mm")
    page.locator("#deadlines button", has_text="100").click()
    session = session_of(page)
    with another_session(page):
        page.locator("#presets label", has_text="Draft").click()
    assert session_of(page) != session
    wait_for(page, lambda: (ask(studio, page)["accuracy"], ask(studio, page)["deadline_ms"]) == (2e-5, 100))
    assert page.inner_text("#accuracy-told") == "about 0.02 mm"


def test_a_page_that_joins_shows_what_the_session_has(page, studio):
    page.locator("#deadlines button", has_text="66").click()
    wait_for(page, lambda: ask(studio, page)["deadline_ms"] == 66)
    page.set_viewport_size({"width": 360, "height": 740})
    page.reload()
    wait_for(page, lambda: page.text_content("#accuracy-short") == "in 66 ms")
    page.click("#accuracy > summary")
    wait_for_plot(page, ".deadline")
    box = page.locator("#price-plot").bounding_box()
    assert box["x"] >= 0
    assert box["x"] + box["width"] <= 360
    assert page.evaluate("document.documentElement.scrollWidth") == 360
    assert ask(studio, page)["deadline_ms"] == 66
