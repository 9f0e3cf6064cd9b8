"""Motions, bodies and sizes on the page, in a real Chromium."""

from __future__ import annotations

import io
import json
import time
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import numpy as np
import pytest
from browser import another_session, open_page, wait_for_frames, wait_for_state
from dress_form import FITTING_SIZE
from studio import pattern

from tryon_solver.body import default_body

pytestmark = pytest.mark.browser

WALK = Path(__file__).resolve().parents[2] / "server" / "tryon_server" / "demo" / "motions" / "walk.bvh"


@pytest.fixture(scope="module")
def page(unseen, studio):
    page = open_page(unseen, studio.url)
    wait_for_state(page, "running")
    yield page
    assert page.faults == []
    page.context.close()


def session(page, studio) -> dict:
    number = page.evaluate("new URL(location.href).searchParams.get('session')")
    with urlopen(f"{studio.url}api/sessions/{number}") as reply:
        return json.load(reply)


def removed_elsewhere(resource: str) -> None:
    """Delete it as somebody else would; refused (409) for as long as the session that the page just left wears it."""
    for _ in range(300):
        try:
            urlopen(Request(resource, method="DELETE")).close()
            return
        except HTTPError as error:
            if error.code != 409:
                raise
            time.sleep(0.1)
    pytest.fail(f"{resource} is still worn half a minute after the page left it")


def choose(page, picker: str, name: str, content: bytes) -> None:
    page.set_input_files(picker, files=[{"name": name, "mimeType": "application/octet-stream", "buffer": content}])


def moving_body() -> bytes:
    body, held = default_body(), io.BytesIO()
    there = body.rest_vertices + np.array([0.0, 0.0, 0.05])
    np.savez_compressed(held, vertices=np.stack([body.rest_vertices, there]), faces=body.faces, fps=2.0)
    return held.getvalue()


def test_a_motion_is_played_and_the_page_says_how_it_was_read(page, studio):
    before = session(page, studio)["id"]
    choose(page, "#motion-file", "my_dance.bvh", WALK.read_bytes())
    page.wait_for_selector("#notice-title:has-text('How my_dance.bvh was read')")
    told = page.inner_text("#notice-message")
    for word in ("centimetres", "up: Y", "frames", "a second", "joints move the body"):
        assert word in told
    page.click("#notice-close")
    assert page.locator("#motions label", has_text="My dance").locator("input").is_checked()
    wait_for_frames(page)
    now = session(page, studio)
    assert now["motion"].startswith("my_dance-")
    assert now["id"] == before, "another motion needs no other session"
    choose(page, "#motion-file", "my_show.bvh", WALK.read_bytes())
    page.wait_for_selector("#notice-title:has-text('How my_show.bvh was read')")
    assert page.inner_text("#notice-message").startswith("It is here already and keeps its name, my_dance")
    page.click("#notice-close")
    page.locator("#motions label", has_text="Walk").click()
    page.wait_for_function("() => document.querySelector('#motions input:checked').value === 'walk'")


@pytest.mark.long
def test_a_motion_that_is_cut_off_is_refused_with_its_line_and_can_be_told_its_unit(page, studio):
    text = WALK.read_text()
    choose(page, "#motion-file", "half.bvh", text[: len(text) * 2 // 3].encode())
    page.wait_for_selector("#notice-title:has-text(\"half.bvh can't be played\")")
    assert page.inner_text("#notice-place").startswith("line ")
    assert "values, expected" in page.inner_text("#notice-message")
    page.click("#notice-close")
    assert session(page, studio)["motion"] == "walk"
    page.click("#motion-reading summary")
    page.select_option("#motion-units", "mm")
    choose(page, "#motion-file", "small.bvh", text.encode())
    page.wait_for_selector("#notice-title:has-text(\"small.bvh can't be played\")")
    assert "not a human's" in page.inner_text("#notice-message")
    page.click("#notice-close")
    page.select_option("#motion-units", "")


def test_a_body_moves_by_itself_and_the_page_says_what_was_found(page, studio):
    assert page.locator("#bodies").is_hidden(), "there is nothing to choose yet"
    with another_session(page):
        choose(page, "#body-file", "actor.npz", moving_body())
        page.wait_for_selector("#notice-title:has-text('How actor.npz was read')", timeout=120_000)
        assert "nits and axes: m, Y up" in page.inner_text("#notice-message")
        page.click("#notice-close")
    now = session(page, studio)
    assert now["body"].startswith("actor-")
    assert now["motion"] == "own"
    assert page.locator("#bodies label", has_text="Actor").locator("input").is_checked()
    page.wait_for_selector("#notes:visible")
    page.click("#notes summary")
    assert "2 holes are filled" in page.inner_text("#notes-list")
    with another_session(page):
        page.locator("#motions label", has_text="Walk").click()
    page.wait_for_selector("#notes", state="hidden")
    assert session(page, studio)["body"] is None, "the motions are the default body's"
    assert page.locator("#bodies label", has_text="Default").locator("input").is_checked()


def test_a_body_that_can_not_be_read_leaves_everything_as_it_was(page, studio):
    before = session(page, studio)["id"]
    choose(page, "#body-file", "actor.zip", b"PK\x03\x04 and then nothing")
    page.wait_for_selector("#notice-title:has-text(\"actor.zip can't wear anything\")")
    assert page.inner_text("#notice-remedy")
    page.click("#notice-close")
    assert session(page, studio)["id"] == before
    wait_for_state(page, "running")
    page.wait_for_selector("#status-text:has-text('Live')")


def test_another_size_is_sewn_and_what_does_not_fit_is_said_with_the_size_that_does(page, studio):
    assert page.locator("#fit").is_hidden()
    page.fill("#size", "120")
    page.wait_for_selector("#fit:visible")
    assert "The waist is 9.1 cm too wide" in page.inner_text("#fit-text")
    now = session(page, studio)
    assert (now["size"], now["fitting_size"], now["fit"]) == (1.2, 0.8, "the waist is 9.1 cm too wide")
    with another_session(page):
        page.click("#fit-wear")
        page.wait_for_selector("#fit", state="hidden")
    assert session(page, studio)["size"] == 0.8
    assert page.input_value("#size") == "80"
    page.fill("#size", "300")
    page.wait_for_timeout(1200)
    assert session(page, studio)["size"] == 0.8, "300 % is no size"
    assert page.inner_text("#sizes .hint") == "50 to 200"


def dressed(page, studio) -> dict:
    """The session once its garment is worn: the page may still show the state of the one before."""
    page.wait_for_timeout(100)
    for _ in range(300):
        if session(page, studio)["worn_size"] is not None:
            break
        page.wait_for_timeout(100)
    return session(page, studio)


def fit_to_be_found(studio, fabric: str) -> str:
    """The session of a T-shirt of a fabric, in the size that fits, if there is one."""
    wish = json.dumps({"garment": "tshirt", "motion": "walk", "fabric": fabric, "size": "fit"}).encode()
    with urlopen(Request(f"{studio.url}api/sessions", wish, {"Content-Type": "application/json"})) as reply:
        return json.load(reply)["id"]


def test_the_size_that_fits_is_looked_for_and_shown(page, studio):
    with another_session(page):
        page.click("#size-fit:has-text('Find the size that fits')")
    page.wait_for_function(f"() => document.querySelector('#size').value === '{round(100 * FITTING_SIZE)}'")
    now = dressed(page, studio)
    assert (now["size"], now["worn_size"]) == ("fit", FITTING_SIZE)
    page.wait_for_selector("#size-fit[aria-pressed='true']:has-text('Worn in the size that fits')")
    page.locator("#fabrics label", has_text="Tight").click()
    page.wait_for_selector("#notice:visible")
    assert "stayed open" in page.inner_text("#notice")
    page.wait_for_selector("#fabrics label:has-text('Cotton') input:checked", state="attached")
    assert "Worn in the size that fits" in page.inner_text("#size-fit"), "it is worn on as it was"
    page.click("#notice-close")
    page.goto(f"{studio.url}?session={fit_to_be_found(studio, 'tight')}")
    page.wait_for_selector("#size-fit:has-text('No size that fits was found')")
    page.locator("#fabrics label", has_text="Cotton").click()
    page.wait_for_selector("#size-fit:has-text('Worn in the size that fits')")
    with another_session(page):
        page.fill("#size", "100")
        page.wait_for_selector("#size-fit[aria-pressed='false']")
    assert dressed(page, studio)["worn_size"] == 1.0


def remove(page, group: str, name: str, sure: bool = True) -> None:
    """Press the button that removes a choice, and say whether one is sure."""
    asked = []

    def answer(dialog) -> None:
        asked.append(dialog.message)
        dialog.accept() if sure else dialog.dismiss()

    page.once("dialog", answer)
    page.locator(f"#{group} label", has_text=name).locator("button.remove").click()
    page.wait_for_timeout(300)
    assert len(asked) == 1
    assert name in asked[0]


def names(page, group: str) -> str:
    return page.inner_text(f"#{group}")


def test_a_garment_that_was_added_can_be_removed_after_one_is_asked(page, studio):
    came_with_the_server = page.locator("#garments label:has(input[value='tshirt'])")
    assert came_with_the_server.count() == 1
    assert came_with_the_server.locator("button.remove").count() == 0, "what came with the server stays"
    with another_session(page):
        choose(page, "#pattern-file", "old_rag.json", json.dumps(pattern(63.0)).encode())
        page.wait_for_selector("#garments label:has-text('Old rag') input:checked", state="attached")
    remove(page, "garments", "Old rag", sure=False)
    assert "Old rag" in names(page, "garments")
    with another_session(page):
        remove(page, "garments", "Old rag")
        page.wait_for_selector("#notice-title:has-text('Old rag is removed')")
        assert "Old rag" not in names(page, "garments")
        page.wait_for_selector("#garments input[value='tshirt']:checked", state="attached")
    assert session(page, studio)["garment"] == "tshirt", "something else is worn instead"


@pytest.mark.long
def test_a_motion_and_a_body_that_were_added_can_be_removed(page, studio):
    choose(page, "#motion-file", "long_gone.bvh", WALK.read_bytes() + b"\n")
    page.wait_for_selector("#notice-title:has-text('How long_gone.bvh was read')")
    assert page.locator("#motions label", has_text="Long gone").locator("input").is_checked()
    remove(page, "motions", "Long gone")
    page.wait_for_function("() => document.querySelector('#motions input:checked')?.value === 'walk'")
    assert "Long gone" not in names(page, "motions")
    with another_session(page):
        choose(page, "#body-file", "ghost.npz", moving_body())
        page.wait_for_selector("#notice-title:has-text('How ghost.npz was read')", timeout=120_000)
        page.click("#notice-close")
    label = page.locator("#bodies label:has(:checked)")
    called = label.locator("b").inner_text()
    with another_session(page):
        remove(page, "bodies", called)
        page.wait_for_function("() => !document.querySelector('#bodies input:checked[value*=\"-\"]')")
    now = session(page, studio)
    assert (now["body"], now["motion"]) == (None, "walk")


@pytest.mark.long
def test_what_somebody_else_removed_is_not_offered_for_long(page, studio):
    with another_session(page):
        choose(page, "#pattern-file", "shared.json", json.dumps(pattern(64.0)).encode())
    garment = session(page, studio)["garment"]
    with another_session(page):
        page.locator("#garments label", has_text="T-shirt").click()
    removed_elsewhere(f"{studio.url}api/garments/{garment}")
    choosing_it_until_it_is_refused = """() => {
        if (document.querySelector("#notice-title").innerText.includes("could not be started")) return true;
        [...document.querySelectorAll("#garments label")].find(l => l.innerText.includes("Shared"))?.click();
        return false;
    }"""  # the list may be drawn anew under a click
    page.wait_for_function(choosing_it_until_it_is_refused, polling=1000)
    page.wait_for_function("() => !document.querySelector('#garments').innerText.includes('Shared')")
    page.click("#notice-close")
    assert session(page, studio)["garment"] == "tshirt"


@pytest.mark.long
def test_what_is_dropped_is_told_apart_by_its_ending(page):
    drop = """([name, content]) => {
        const data = new DataTransfer();
        data.items.add(new File([content], name));
        for (const type of ["dragenter", "dragover", "drop"])
            document.querySelector("#stage").dispatchEvent(new DragEvent(type, { dataTransfer: data, bubbles: true }));
    }"""
    for name, says in (("a.bvh", "can't be played"), ("b.npz", "can't wear anything"), ("c.json", "can't be worn")):
        page.evaluate(drop, [name, "nothing of the kind"])
        page.wait_for_selector(f'#notice-title:has-text("{name} {says}")', timeout=60_000)
        page.click("#notice-close")
