"""The page in a real Chromium, against a real server whose sessions simulate the dress form."""

from __future__ import annotations

import json
import runpy
from pathlib import Path
from urllib.request import Request, urlopen

import pytest
from browser import another_session, open_page, wait_for_frames, wait_for_state
from dressed_page import as_it_began, ask, opened, session_of
from studio import pattern

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def shared(unseen, studio):
    """The page on one session, for all tests that change nothing for good."""
    with opened(unseen, studio.url) as page:
        yield page


@pytest.fixture
def page(shared):
    with as_it_began(shared):
        yield shared


def broken_pattern() -> bytes:
    """A stitch to a piece that is not there."""
    spec = pattern()
    spec["pattern"]["stitches"] = [[{"panel": "front", "edge": 1}, {"panel": "sleeve", "edge": 0}]]
    return json.dumps(spec).encode()


def as_file(name: str, content: bytes) -> dict[str, object]:
    return {"name": name, "mimeType": "application/json", "buffer": content}


def test_a_bad_pattern_is_refused_with_place_and_remedy_while_the_session_goes_on(page):
    session = session_of(page)
    page.set_input_files("#pattern-file", files=[as_file("coat.json", broken_pattern())])
    page.wait_for_selector("#notice:visible")
    assert "coat.json" in page.inner_text("#notice-title")
    assert "stitches[0]" in page.inner_text("#notice-place")
    assert page.inner_text("#notice-remedy")
    wait_for_frames(page)
    assert session_of(page) == session
    assert page.locator('#status[data-state="running"]').count() == 1
    page.click("#notice-close")
    assert page.locator("#notice").is_hidden()


def test_another_garment_is_another_session(page, studio):
    for wear, name in ((upload_wide_shirt, "Wide shirt"), (choose_cape, "Cape")):
        session = session_of(page)
        with another_session(page):
            wear(page)
        wait_for_frames(page)
        assert page.locator("#garments label", has_text=name).locator("input").is_checked()
        left = ask(studio, f"api/sessions/{session}")
        assert left["state"] == "closed", "the session that was left should have ended"


def upload_wide_shirt(page) -> None:
    page.set_input_files("#pattern-file", files=[as_file("wide shirt.json", json.dumps(pattern(75.0)).encode())])


def choose_cape(page) -> None:
    page.locator("#garments label", has_text="Cape").click()


def skirt_of_centimetres(folder) -> bytes:
    """The mesh that scripts/make_strangers.py writes: centimetres, Z up."""
    script = runpy.run_path(str(Path(__file__).resolve().parents[2] / "scripts" / "make_strangers.py"))
    script["write_skirt"](folder / "skirt.obj")
    return (folder / "skirt.obj").read_bytes()


def test_a_mesh_is_worn_and_the_page_says_how_it_was_read(page, tmp_path):
    mesh = skirt_of_centimetres(tmp_path)
    session = session_of(page)
    page.click(".reading summary")
    page.select_option("#mesh-units", "m")
    page.set_input_files("#pattern-file", files=[as_file("skirt.obj", mesh)])
    page.wait_for_selector("#notice:visible")
    assert "not where the body is" in page.inner_text("#notice-message")
    assert "units and up" in page.inner_text("#notice-remedy")
    assert session_of(page) == session
    page.click("#notice-close")
    page.select_option("#mesh-units", "")
    with another_session(page):
        page.set_input_files("#pattern-file", files=[as_file("skirt.obj", mesh)])
        page.wait_for_selector("#notice-title:has-text('How skirt.obj was read')")
        assert "cm, Z up" in page.inner_text("#notice-message")
    page.click("#notice-close")


def test_a_pattern_can_be_dropped_on_the_page(page):
    drop = """content => {
        const data = new DataTransfer();
        data.items.add(new File([content], "dropped.json", { type: "application/json" }));
        for (const type of ["dragenter", "dragover", "drop"])
            document.querySelector("#stage").dispatchEvent(new DragEvent(type, { dataTransfer: data, bubbles: true }));
    }"""
    page.evaluate(drop, "this is no pattern")
    page.wait_for_selector("#notice:visible")
    assert "dropped.json" in page.inner_text("#notice-title")
    assert page.locator("#drop").is_hidden()


def test_advice_is_shown_as_long_as_it_is_given(page):
    page.wait_for_selector("#advice", state="hidden")
    page.locator("#fabrics label", has_text="Denim").click()
    page.wait_for_selector("#advice:visible")
    assert page.inner_text("#advice") == "The fabric is stretched by up to 35 %; try a larger size"
    page.locator("#fabrics label", has_text="Cotton").click()
    page.wait_for_selector("#advice", state="hidden")


@pytest.mark.long
def test_open_figures_leave_the_middle_of_the_picture_free(unseen, studio):
    page = open_page(unseen, studio.url, 1280, 800)
    wait_for_state(page, "running")
    assert not page.evaluate("document.getElementById('readout').open")
    page.click("#readout > summary")
    card, view = page.locator("#readout").bounding_box(), page.locator("#stage").bounding_box()
    assert card["x"] - view["x"] > 0.74 * view["width"], "a hand reaches that far with the arms held off the body"
    assert card["x"] + card["width"] <= view["x"] + view["width"]
    assert page.locator("#readout").evaluate("card => card.scrollWidth <= card.clientWidth")
    page.context.close()


def test_a_fabric_that_does_not_fit_is_refused_and_the_garment_worn_on(page):
    page.locator("#fabrics label", has_text="Tight").click()
    page.locator("#notice:visible", has_text="stayed open").wait_for()
    wait_for_state(page, "running")
    wait_for_frames(page)
    page.locator("#fabrics label", has_text="Denim").click()
    wait_for_state(page, "running")
    wait_for_frames(page)


def test_a_second_page_joins_the_session_and_sees_it_paused(page, unseen):
    other = open_page(unseen, page.url)
    wait_for_state(other, "running")
    wait_for_frames(other)
    assert session_of(other) == session_of(page)
    page.click("#play")
    wait_for_state(other, "paused")
    assert other.inner_text("#play-text") == "Play"
    other.context.close()


def test_a_session_that_is_not_there_is_replaced_and_said_so(unseen, studio):
    page = open_page(unseen, f"{studio.url}?session=nowhere")
    wait_for_state(page, "running")
    assert "isn't there" in page.inner_text("#notice-title")
    assert session_of(page) != "nowhere"
    page.context.close()


@pytest.mark.long
def test_an_ended_session_says_so_and_can_be_started_again(unseen, studio):
    page = open_page(unseen, studio.url)
    wait_for_state(page, "running")
    session = session_of(page)
    with urlopen(Request(f"{studio.url}api/sessions/{session}", method="DELETE")):
        page.wait_for_selector('#status[data-link="closed"]')
    assert "ended" in page.inner_text("#status-text")
    page.click("text=Start again")
    wait_for_state(page, "running")
    assert session_of(page) != session
    assert page.faults == []
    page.context.close()


def test_the_page_works_by_keyboard(page):
    page.locator("#play").focus()
    page.keyboard.press("Space")
    wait_for_state(page, "paused")
    page.keyboard.press("Enter")
    wait_for_state(page, "running")
    page.locator("#motions input:checked").focus()
    before = page.locator("#motions input:checked").get_attribute("value")
    page.keyboard.press("ArrowRight")
    assert page.locator("#motions input:checked").get_attribute("value") != before
    focusable = page.evaluate("""() => [...document.querySelectorAll('button, summary, input, canvas')]
        .filter(e => e.checkVisibility() && !e.disabled && e.tabIndex < 0).length""")
    assert focusable == 0


def test_the_page_fits_a_phone(page, unseen):
    phone = open_page(unseen, page.url, 360, 740)
    wait_for_state(phone, "running")
    wait_for_frames(phone)
    assert phone.evaluate("document.documentElement.scrollWidth") == 360
    phone.locator("#fabrics label", has_text="Denim").click()
    phone.click("#play")
    wait_for_state(phone, "paused")
    for selector in ("#play", "#follow", "#reset-view", "#readout"):
        box = phone.locator(selector).bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= 360
        assert box["y"] + box["height"] <= 740
    assert phone.faults == []
    phone.context.close()


def test_a_killed_server_is_waited_for_and_the_page_recovers(unseen, web, tmp_path):
    from studio import Studio

    server = Studio(tmp_path, web)
    try:
        page = open_page(unseen, server.url)
        wait_for_state(page, "running")
        page.locator("#motions label", has_text="Turn").click()
        wait_for_frames(page)
        session = session_of(page)
        server.kill()
        page.wait_for_selector('#status[data-link="reconnecting"]')
        assert "reconnecting" in page.inner_text("#status-text")
        assert page.locator("#play").is_disabled()
        server.start()
        wait_for_state(page, "running")
        wait_for_frames(page)
        assert session_of(page) != session, "the restarted server knows no old session"
        assert ask(server, f"api/sessions/{session_of(page)}")["motion"] == "turn", "what was chosen is kept"
        assert page.faults == []
        page.context.close()
    finally:
        server.kill()
