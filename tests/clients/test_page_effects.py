"""The section of effects on the page, in a real Chromium."""

from __future__ import annotations

import json
from collections.abc import Callable
from urllib.request import Request, urlopen

import pytest
from browser import PATIENCE, open_page, wait_for_frames, wait_for_state

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def shared(unseen, studio):
    page = open_page(unseen, studio.url)
    wait_for_state(page, "running")
    page.wait_for_selector("#effects", state="visible")
    page.click("#effects > summary")
    yield page
    page.context.close()


@pytest.fixture
def page(shared, studio):
    """The page with its section open, nothing asked for. It must run without an uncaught error."""
    for name in ("wind", "pressure", "adhesion", "elastic", "auto"):
        call(studio, shared, f"/{name}", "DELETE")
    for name in ("wind", "pressure", "adhesion", "elastic"):
        wait_for_effect(shared, name, "absent")
    yield shared
    assert shared.faults == []


def call(studio, page, path="", method="GET", **body) -> dict:
    session = page.evaluate("new URL(location.href).searchParams.get('session')")
    data = json.dumps(body).encode() if method == "PUT" else None
    request = Request(
        f"{studio.url}api/sessions/{session}/effects{path}", data, {"Content-Type": "application/json"}, method=method
    )
    with urlopen(request) as reply:
        return json.load(reply)


def effect(studio, page, name) -> dict:
    return call(studio, page, f"/{name}")


def item(page, name):
    return page.locator(f"#effects-list [data-name={name}]")


def unfold(page, name):
    if not item(page, name).evaluate("item => item.open"):
        item(page, name).locator("summary").click()
    return item(page, name)


def wait_for_effect(page, name, state) -> None:
    page.wait_for_selector(f"#effects-list [data-name={name}][data-state={state}][data-pending='']", state="attached")


def wait_for(page, true: Callable[[], bool]) -> None:
    for _ in range(PATIENCE // 50):
        if true():
            return
        page.wait_for_timeout(50)
    raise AssertionError("it does not come about")


def test_all_effects_are_listed_with_their_states(page):
    titles = page.locator("#effects-list summary b").all_inner_texts()
    assert len(titles) == 17
    assert {"Wind", "Elastic", "Gravity"} <= set(titles)
    assert item(page, "gravity").get_attribute("data-state") == "active"
    assert item(page, "wind").get_attribute("data-state") == "absent"
    assert page.text_content("#effects-short") == "8 act"


def test_an_effect_is_armed_turned_on_and_off_and_says_why(page, studio):
    wind = unfold(page, "wind")
    assert wind.locator(".why").is_hidden()
    wind.locator("button[data-state=armed]").click()
    wait_for_effect(page, "wind", "armed")
    assert effect(studio, page, "wind")["state"] == "armed"
    wind.locator("button[data-state=active]").click()
    wait_for_effect(page, "wind", "active")
    assert wind.locator(".why").inner_text() == "Asked for"
    assert wind.locator("button[aria-pressed=true]").inner_text() == "On"
    wait_for_effect(page, "air_drag", "armed")
    assert unfold(page, "air_drag").locator(".why").inner_text() == "Wind takes its place"
    assert effect(studio, page, "wind")["state"] == "active"
    wait_for_frames(page, 5)
    wind.locator("button[data-state=absent]").click()
    wait_for_effect(page, "wind", "absent")
    wait_for_effect(page, "air_drag", "active")


def test_sliders_say_what_they_set_and_it_is_set(page, studio):
    wind = unfold(page, "wind")
    wind.locator("button[data-state=active]").click()
    wait_for_effect(page, "wind", "active")
    towards = wind.get_by_label("towards", exact=True)
    towards.focus()
    page.keyboard.press("Home")
    page.keyboard.press("ArrowRight")
    assert wind.locator(".slider", has_text="towards").locator("output").inner_text() == "5°"
    speed = wind.get_by_label("velocity", exact=True)
    speed.focus()
    page.keyboard.press("End")
    assert wind.locator(".slider", has_text="velocity").locator("output").inner_text() == "30 m/s"
    wait_for(page, lambda: sum(v * v for v in effect(studio, page, "wind")["parameters"]["velocity"]) > 899)
    x, y, z = effect(studio, page, "wind")["parameters"]["velocity"]
    assert (round(x, 2), y, round(z, 2)) == (2.61, 0.0, 29.89)
    assert page.evaluate("document.activeElement.ariaLabel") == "velocity", "the slider is still in the hand"
    assert towards.input_value() == "1"


def test_what_somebody_else_asks_for_is_shown(page, studio):
    wind = unfold(page, "wind")
    call(studio, page, "/wind", "PUT", parameters={"velocity": [0, 0, -3], "shelter": 0})
    wait_for_effect(page, "wind", "active")
    said = wind.locator(".slider", has_text="towards").locator("output")
    wait_for(page, lambda: said.inner_text() == "180°")
    assert wind.locator(".slider", has_text="velocity").locator("output").inner_text() == "3 m/s"


def test_what_is_usual_can_be_had_again(page, studio):
    adhesion = unfold(page, "adhesion")
    adhesion.locator("button[data-state=active]").click()
    wait_for_effect(page, "adhesion", "active")
    strength = adhesion.locator(".slider", has_text="strength")
    assert strength.locator("output").inner_text() == "the usual"
    strength.locator("input").focus()
    page.keyboard.press("End")
    wait_for(page, lambda: effect(studio, page, "adhesion")["parameters"]["strength"] == 1e5)
    strength.locator("button").click()
    wait_for(page, lambda: effect(studio, page, "adhesion")["parameters"]["strength"] is None)
    adhesion.locator("select").select_option("tape")
    wait_for(page, lambda: effect(studio, page, "adhesion")["parameters"]["kind"] == "tape")


def test_friction_of_two_materials_is_added_and_taken_away(page, studio):
    friction = unfold(page, "friction")

    def materials():
        return effect(studio, page, "friction")["parameters"]["materials"]

    friction.get_by_role("button", name="Add a material").click()
    wait_for(page, lambda: len(materials()) == 1)
    friction.locator(".row select").first.select_option("denim")
    wait_for(page, lambda: materials()[0] == {"first": "denim", "second": "skin", "static": 0.3, "kinetic": None})
    friction.locator(".row").get_by_label("static", exact=True).focus()
    page.keyboard.press("End")
    wait_for(page, lambda: materials()[0]["static"] == 2.0)
    friction.get_by_role("button", name="Take away").click()
    wait_for(page, lambda: materials() == [])


def test_lists_show_the_lines_of_the_garment_that_is_edited_and_forget_those_of_one_that_is_taken_off(page, studio):
    """Of the other one's lines is told how many there are, and they stay what they are."""
    page.click("#wardrobe-put-on")
    names = "[...document.querySelectorAll('#wardrobe-worn li')].map(row => row.dataset.worn)"
    page.wait_for_function(f"{names}.length === 2 && !document.getElementById('wardrobe').disabled")
    outer, inner = page.evaluate(names)
    rows = [{"along": [{"panel": f"{name}/front", "edge": 0}]} for name in (inner, inner, outer)]
    call(studio, page, "/elastic", "PUT", parameters={"lines": rows})
    wait_for_effect(page, "elastic", "active")
    elastic = unfold(page, "elastic")
    wait_for(page, lambda: elastic.locator(".row").count() == 1)
    assert elastic.locator(".row .fixed").inner_text() == f"{outer}/front, edge 0"
    assert elastic.locator(".others").inner_text() == "2 of other garments"
    elastic.get_by_label("ratio", exact=True).focus()
    page.keyboard.press("End")

    def ratios():
        return [row["ratio"] for row in effect(studio, page, "elastic")["parameters"]["lines"]]

    wait_for(page, lambda: ratios() == [0.8, 0.8, 1.5])
    page.locator(f"#wardrobe-worn li[data-worn='{outer}'] button").last.click()
    page.wait_for_function(f"{names}.length === 1 && !document.getElementById('wardrobe').disabled")
    wait_for(page, lambda: elastic.locator(".row").count() == 2)
    assert ratios() == [0.8, 0.8]
    assert elastic.locator(".others").count() == 0
    call(studio, page, "/elastic", "DELETE")


def test_what_is_refused_is_told_where_it_was_asked_for_and_stands_as_it_was(page, studio):
    fasteners = unfold(page, "fasteners")
    fasteners.locator("button[data-state=active]").click()
    fault = fasteners.locator(".rows-of .fault")
    fault.wait_for()
    assert fault.inner_text() == "There is none. Give at least one, with first."
    wait_for_effect(page, "fasteners", "absent")
    assert effect(studio, page, "fasteners")["state"] == "absent"
    assert page.locator("#notice").is_hidden()
    assert fasteners.get_by_role("button", name="Add a row").is_disabled()
    assert "has no pattern" in fasteners.locator(".barred").inner_text()


def test_what_keeps_the_garment_from_penetrating_has_no_switch(page):
    contact = unfold(page, "self_contact")
    assert contact.locator("button:visible").count() == 0
    assert "nothing penetrates" in contact.locator(".why").inner_text()


def test_times_are_shown_once_they_are_measured(page):
    page.click("#effects-measure")
    shown = item(page, "gravity").locator(".ms")
    wait_for(page, lambda: shown.inner_text() == "2.6 ms")
    assert "add gradient: 0.25 ms a call" in shown.get_attribute("title")
    assert item(page, "pressure").locator(".ms").inner_text() == ""


def test_by_itself_is_a_box_to_tick(page, studio):
    page.check("#effects-auto")
    wait_for(page, lambda: call(studio, page)["auto"])
    page.uncheck("#effects-auto")
    wait_for(page, lambda: not call(studio, page)["auto"])


@pytest.mark.parametrize("width", [1280, 860, 360])
def test_the_section_fits_the_page(page, width):
    wind = unfold(page, "wind")
    wind.locator("button[data-state=active]").click()
    wait_for_effect(page, "wind", "active")
    page.set_viewport_size({"width": width, "height": 740})
    box = page.locator("#effects").bounding_box()
    assert box["x"] >= 0
    assert box["x"] + box["width"] <= width
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    over = """() => [...document.querySelectorAll("#effects-list [open] *")]
        .filter(part => part.scrollWidth > part.clientWidth + 1 && part.clientWidth > 0).map(part => part.className)"""
    assert page.evaluate(over) == []


ASKS_AT_ONCE = """
new MutationObserver(() => {
  const item = document.querySelector("#effects:not([hidden]) [data-name=wind]");
  if (!item) return;
  if (!window.askedWhile) {
    window.askedWhile = document.querySelector("#status").dataset.state;
    document.querySelector("#effects").open = true;
    item.querySelector("button[data-state=active]").click();
  }
  const said = item.querySelector(".said-state").textContent;
  if (said && window.said?.at(-1) !== said) (window.said ??= []).push(said);
}).observe(document, { subtree: true, childList: true, attributes: true, characterData: true });
"""


def test_what_is_asked_while_the_garment_is_put_on_acts_once_it_is_worn(unseen, studio):
    """A script asks as soon as the section is there, before which nothing is worn."""
    studio.held.touch()
    try:
        page = open_page(unseen, studio.url, scripts=[ASKS_AT_ONCE])
        page.wait_for_function("window.said?.length")
    finally:
        studio.held.unlink()
    wait_for_state(page, "running")
    wait_for_effect(page, "wind", "active")
    assert page.evaluate("window.askedWhile") in ("preparing", "dressing")
    assert page.evaluate("window.said[0]") == "on once it is worn"
    assert page.locator("#notice:visible").count() == 0
    assert page.faults == []
    page.context.close()
