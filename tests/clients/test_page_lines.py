"""Lines and spots of effects, made in the page: chosen in the pattern, in a real Chromium, for a real server."""

from __future__ import annotations

import json
from collections.abc import Callable
from urllib.request import Request, urlopen

import pytest
from browser import PATIENCE, open_page, wait_for_state

pytestmark = pytest.mark.browser


@pytest.fixture
def page(unseen, patterned):
    """A page of its own, in a session of its own. It must run without an uncaught error."""
    page = open_page(unseen, patterned.url, 1280, 800)
    wait_for_state(page, "running")
    page.wait_for_selector("#pattern-toggle:visible")
    page.click("#effects > summary")
    yield page
    assert page.faults == []
    page.context.close()


def effect(patterned, page, name: str) -> dict:
    session = page.evaluate("new URL(location.href).searchParams.get('session')")
    with urlopen(f"{patterned.url}api/sessions/{session}/effects/{name}") as reply:
        return json.load(reply)


def ask(patterned, page, name: str, **body) -> None:
    session = page.evaluate("new URL(location.href).searchParams.get('session')")
    url = f"{patterned.url}api/sessions/{session}/effects/{name}"
    with urlopen(Request(url, json.dumps(body).encode(), {"Content-Type": "application/json"}, method="PUT")):
        pass


def comes(page, true: Callable[[], bool]) -> None:
    for _ in range(PATIENCE // 50):
        if true():
            return
        page.wait_for_timeout(50)
    raise AssertionError("it does not come about")


def unfold(page, name: str):
    item = page.locator(f"#effects-list [data-name={name}]")
    if not item.evaluate("item => item.open"):
        item.locator("summary").click()
    return item


def edge(page, number: int, of: int = 0):
    return page.locator(".piece").nth(of).locator(".edge .reach").nth(number)


def middle(locator) -> tuple[float, float]:
    box = locator.bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def click_edge(page, number: int, of: int = 0) -> None:
    page.mouse.click(*middle(edge(page, number, of)))


def add(item, what: str) -> None:
    item.get_by_role("button", name=f"Add a {what}", exact=True).click()


def lines(patterned, page, name: str, rows: str = "lines") -> list:
    told = effect(patterned, page, name)
    return told["parameters"].get(rows, []) if told["state"] == "active" else []


def test_elastic_is_sewn_along_an_edge_that_is_clicked(page, patterned):
    elastic = unfold(page, "elastic")
    add(elastic, "line")
    page.wait_for_selector("#pattern:visible")
    assert page.inner_text("#pattern-chosen") == "Elastic, along: Choose an edge; Escape takes none"
    page.mouse.move(*middle(edge(page, 0)))
    page.wait_for_function("document.getElementById('pattern-chosen').textContent.includes('Edge 0 of front, open')")
    click_edge(page, 0)
    comes(page, lambda: lines(patterned, page, "elastic") != [])
    [row] = lines(patterned, page, "elastic")
    assert row == {"along": [{"panel": "front", "edge": 0}], "ratio": 0.8, "stiffness": 30.0}
    assert elastic.locator(".row .fixed").inner_text() == "front, edge 0"
    assert elastic.get_by_role("button", name="Take away").is_disabled(), "the last one goes by turning the effect off"

    elastic.get_by_role("button", name="Choose another one").click()
    click_edge(page, 0, of=1)
    comes(page, lambda: len(lines(patterned, page, "elastic")[0]["along"]) == 2)
    assert lines(patterned, page, "elastic")[0]["along"][1] == {"panel": "back", "edge": 0}
    elastic.get_by_label("ratio", exact=True).focus()
    page.keyboard.press("Home")
    comes(page, lambda: lines(patterned, page, "elastic")[0]["ratio"] == 0.2)

    add(elastic, "line")
    click_edge(page, 2)
    comes(page, lambda: len(lines(patterned, page, "elastic")) == 2)
    assert [row["ratio"] for row in lines(patterned, page, "elastic")] == [0.2, 0.8]
    elastic.get_by_role("button", name="Take away").first.click()
    comes(page, lambda: len(lines(patterned, page, "elastic")) == 1)
    assert lines(patterned, page, "elastic")[0]["along"] == [{"panel": "front", "edge": 2}]


def test_a_crease_along_an_open_edge_is_refused_at_its_row_and_chosen_anew(page, patterned):
    creases = unfold(page, "creases")
    add(creases, "line")
    click_edge(page, 1)
    comes(page, lambda: len(lines(patterned, page, "creases")) == 1)
    add(creases, "line")
    click_edge(page, 2)
    fault = creases.locator(".row.draft .fault")
    fault.wait_for()
    assert fault.inner_text() == "It is no seam along all its length. Press an edge that is sewn."
    assert page.locator("#notice").is_hidden()
    assert len(lines(patterned, page, "creases")) == 1, "what is worn stands"
    creases.locator(".row.draft").get_by_role("button", name="Choose an edge").click()
    click_edge(page, 3)
    comes(page, lambda: len(lines(patterned, page, "creases")) == 2)
    assert [row["along"][0]["edge"] for row in lines(patterned, page, "creases")] == [1, 3]
    assert creases.locator(".draft, .fault").count() == 0


def test_buttons_are_asked_for_once_both_sides_are_chosen(page, patterned):
    fasteners = unfold(page, "fasteners")
    add(fasteners, "row")
    click_edge(page, 0)
    page.wait_for_function("document.getElementById('pattern-chosen').textContent.includes('second')")
    assert fasteners.locator(".row.draft .fixed").all_inner_texts() == ["front, edge 0", "not chosen yet"]
    page.keyboard.press("Escape")
    assert fasteners.locator(".row.draft").count() == 1, "half a row is kept"
    assert effect(patterned, page, "fasteners")["state"] == "absent"
    fasteners.get_by_role("button", name="in the pattern: second").click()
    click_edge(page, 0, of=1)
    comes(page, lambda: lines(patterned, page, "fasteners", "rows") != [])
    [row] = lines(patterned, page, "fasteners", "rows")
    assert [row[side] for side in ("first", "second")] == [[{"panel": name, "edge": 0}] for name in ("front", "back")]
    assert row["closed"] == 1.0


def test_a_pin_is_where_the_pattern_was_clicked_in_the_size_that_is_worn(page, patterned):
    page.fill("#size", "200")
    page.keyboard.press("Enter")
    page.wait_for_selector('#status[data-link="open"][data-state="running"]')
    comes(page, lambda: worn_size(patterned, page) == 2.0)
    page.wait_for_selector("#pattern-toggle:visible")
    pins = unfold(page, "pins")
    add(pins, "point")
    left, right = (page.locator(".piece").nth(0).locator(".corner").nth(k) for k in (0, 1))
    (x, y), (far, _) = middle(left), middle(right)
    scale = (far - x) / 0.6  # px per m
    page.mouse.click(x + 0.15 * scale, y - 0.2 * scale)
    comes(page, lambda: lines(patterned, page, "pins", "points") != [])
    [spot] = lines(patterned, page, "pins", "points")
    assert spot == {"panel": "front", "x": pytest.approx(0.3, abs=0.01), "y": pytest.approx(0.4, abs=0.01)}
    assert pins.locator(".row .fixed").inner_text().startswith("front, at 3")
    add(pins, "line")
    click_edge(page, 3)
    comes(page, lambda: lines(patterned, page, "pins") == [{"along": [{"panel": "front", "edge": 3}]}])


def worn_size(patterned, page) -> float:
    session = page.evaluate("new URL(location.href).searchParams.get('session')")
    with urlopen(f"{patterned.url}api/sessions/{session}") as reply:
        return json.load(reply)["worn_size"]


def test_pieces_are_chosen_where_an_effect_names_pieces(page, patterned):
    pressure = unfold(page, "adhesion")
    pressure.get_by_role("button", name="Choose a piece in the pattern").click()
    page.mouse.click(*middle(page.locator(".piece").nth(1).locator(".cloth")))
    comes(page, lambda: effect(patterned, page, "adhesion")["parameters"]["panels"] == ["back"])
    pressure.get_by_role("button", name="All of them").click()
    comes(page, lambda: effect(patterned, page, "adhesion")["parameters"]["panels"] == [])

    friction = unfold(page, "friction")
    add(friction, "pair")
    page.mouse.click(*middle(page.locator(".piece").nth(0).locator(".cloth")))
    page.keyboard.press("Escape")
    friction.get_by_role("button", name="second: body").click()
    comes(page, lambda: lines(patterned, page, "friction", "pairs") != [])
    [pair] = lines(patterned, page, "friction", "pairs")
    assert (pair["first"], pair["second"]) == ("front", "body")


def test_escape_leaves_no_line_behind_and_the_keys_where_they_were(page, patterned):
    elastic = unfold(page, "elastic")
    add(elastic, "line")
    page.keyboard.press("Escape")
    assert elastic.locator(".row").count() == 0
    assert page.evaluate("document.activeElement.textContent") == "Add a line"
    assert page.locator("#pattern").is_visible()
    click_edge(page, 0)
    assert effect(patterned, page, "elastic")["state"] == "absent"
    assert page.inner_text("#pattern-chosen").startswith("Edge 0 of front"), "an edge is chosen for edits again"


def test_lines_and_spots_are_made_by_keys_alone(page, patterned):
    unfold(page, "elastic").get_by_role("button", name="Add a line").focus()
    page.keyboard.press("Enter")
    page.keyboard.press("Enter")  # the first piece: its edges are reached now
    assert page.evaluate("document.activeElement.ariaLabel") == "Piece front"
    page.keyboard.press("Tab")
    page.keyboard.press("Tab")
    page.wait_for_function("document.getElementById('pattern-chosen').textContent.includes('Edge 1 of front')")
    page.keyboard.press("Enter")
    comes(page, lambda: lines(patterned, page, "elastic") != [])
    assert lines(patterned, page, "elastic")[0]["along"] == [{"panel": "front", "edge": 1}]
    assert page.evaluate("document.activeElement.dataset.key") == "lines.0.along.choose"

    unfold(page, "pins").get_by_role("button", name="Add a point").focus()
    for key in ("Enter", "Enter", "ArrowRight", "Shift+ArrowUp", "Enter"):
        page.keyboard.press(key)
    comes(page, lambda: lines(patterned, page, "pins", "points") != [])
    assert lines(patterned, page, "pins", "points") == [{"panel": "front", "x": 0.31, "y": 0.3}]


def test_lines_are_of_the_garment_that_is_edited(page, patterned):
    page.click("#wardrobe-put-on")
    names = "[...document.querySelectorAll('#wardrobe-worn li')].map(row => row.dataset.worn)"
    page.wait_for_function(f"{names}.length === 2 && !document.getElementById('wardrobe').disabled")
    outer, inner = page.evaluate(names)
    elastic = unfold(page, "elastic")
    add(elastic, "line")
    click_edge(page, 0)
    comes(page, lambda: lines(patterned, page, "elastic") != [])
    page.locator(f"#wardrobe-worn li[data-worn='{inner}'] input").check()
    page.wait_for_function("!document.getElementById('wardrobe').disabled")
    comes(page, lambda: elastic.locator(".others").count() == 1)
    add(elastic, "line")
    click_edge(page, 2)
    comes(page, lambda: len(lines(patterned, page, "elastic")) == 2)
    on = [row["along"][0]["panel"] for row in lines(patterned, page, "elastic")]
    assert on == [f"{outer}/front", f"{inner}/front"]


def test_a_line_that_somebody_else_took_away_while_it_was_chosen_stays_away(page, patterned):
    ask(patterned, page, "elastic", parameters={"lines": [{"along": [{"panel": "front", "edge": k}]} for k in (0, 2)]})
    elastic = unfold(page, "elastic")
    comes(page, lambda: elastic.locator(".row").count() == 2)
    elastic.get_by_role("button", name="Choose an edge").first.click()
    ask(patterned, page, "elastic", parameters={"lines": [{"along": [{"panel": "front", "edge": 2}]}]})
    comes(page, lambda: elastic.locator(".row").count() == 1)
    click_edge(page, 1)
    page.wait_for_selector("#notice:visible")
    assert page.inner_text("#notice-title") == "What you were choosing for is gone"
    assert [row["along"][0]["edge"] for row in lines(patterned, page, "elastic")] == [2]


def test_on_a_phone_nothing_is_cut_off_and_a_choice_is_left_without_a_key(page, patterned):
    page.click("#wardrobe-put-on")
    page.wait_for_function("document.querySelectorAll('#wardrobe-worn li').length === 2")
    front = page.evaluate("document.querySelector('#wardrobe-worn li').dataset.worn")
    both = [{"panel": f"{front}/{side}", "edge": 0} for side in ("front", "back")]
    ask(patterned, page, "elastic", parameters={"lines": [{"along": both}, {"along": both[:1]}]})
    ask(patterned, page, "fasteners", parameters={"rows": [{"first": both[:1], "second": both[1:]}]})
    ask(patterned, page, "pins", parameters={"points": [{"panel": f"{front}/front", "x": 0.3, "y": 0.2}]})
    page.set_viewport_size({"width": 360, "height": 740})
    for name, rows in (("elastic", 2), ("fasteners", 1), ("pins", 1), ("friction", 0)):
        item = unfold(page, name)
        comes(page, lambda item=item, rows=rows: item.locator(".row").count() == rows)
        item.evaluate("item => item.scrollIntoView({ block: 'start' })")
    assert page.evaluate("[document.documentElement.scrollTop, document.documentElement.scrollWidth]") == [0, 360]
    tall = """() => [...document.querySelectorAll(".effect[open] .field > span:first-child")]
        .filter(name => name.getBoundingClientRect().height > 44).map(name => name.textContent)"""
    assert page.evaluate(tall) == [], "no name is broken into letters"
    low = """() => [...document.querySelectorAll(".effect[open] button, #wardrobe button")]
        .filter(button => button.checkVisibility() && button.getBoundingClientRect().height < 24).length"""
    assert page.evaluate(low) == 0, "fingers meet all buttons"

    add(page.locator("[data-name=elastic]"), "line")
    assert page.locator("#choices").is_hidden(), "the pattern takes its room"
    page.get_by_role("button", name="Take none").click()
    assert page.locator("#choices").is_visible()
    assert page.locator("#pattern").is_hidden()
    assert page.evaluate("document.activeElement.dataset.key") == "lines.add"
    add(page.locator("[data-name=elastic]"), "line")
    click_edge(page, 2)
    comes(page, lambda: len(lines(patterned, page, "elastic")) == 3)
    assert page.locator("#choices").is_visible()
