"""The sewing pattern in the page, edited in a real Chromium; what arrives at the server's end is read."""

from __future__ import annotations

import msgspec
import pytest
from browser import open_page
from tailor import Tailor, design, piece, status, welcome

import tryon_protocol as wire
from tryon_protocol.messages import DesignEdit, DesignMessage, DesignPatch

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def tailor(web):
    server = Tailor(web, None)
    yield server
    server.stop()


@pytest.fixture(scope="module")
def shared(unseen, tailor):
    """The page for all tests in a window of this size."""
    tailor.pattern = design()
    page = open_page(unseen, tailor.url, 1280, 800)
    page.click("#pattern-toggle")
    page.wait_for_selector("#pattern-sheet .piece >> nth=1")
    yield page
    page.context.close()


@pytest.fixture
def page(shared, tailor):
    """The page with the pattern beside the picture, as if just come. It must run without an uncaught error."""
    tailor.say(welcome())
    shared.wait_for_selector("#pattern", state="hidden")
    tailor.say(design())
    shared.wait_for_selector("#pattern-sheet .piece >> nth=1")
    shared.uncheck("#pattern-mirror")
    tailor.heard.clear()
    yield shared
    assert shared.faults == []


def middle(locator) -> tuple[float, float]:
    box = locator.bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def corner(page, number: int, of: int = 0):
    """A corner of a piece, by their numbers."""
    return page.locator(".piece").nth(of).locator(".corner").nth(number)


def edge(page, number: int, of: int = 0):
    return page.locator(".piece").nth(of).locator(".edge").nth(number)


def comes_to(locator, place: tuple[float, float]) -> None:
    """Waits until something is drawn there."""
    for _ in range(100):
        if middle(locator) == pytest.approx(place, abs=1.5):
            return
        locator.page.wait_for_timeout(50)
    assert middle(locator) == pytest.approx(place, abs=1.5)


def scale_of(page) -> float:
    """Pixels per metre."""
    (left, _), (right, _) = middle(corner(page, 0)), middle(corner(page, 1))
    return (right - left) / 0.5


def is_edit(message, hold: bool) -> bool:
    return isinstance(message, wire.EditMessage) and message.hold is hold


def kept(message) -> bool:
    return is_edit(message, hold=False)


def refuse(tailor, request: int) -> None:
    tailor.say(
        wire.ErrorMessage(
            code="edit_refused", place="by", message="the edges would cross", remedy="Move it less far", request=request
        )
    )


def test_a_corner_is_dragged_and_what_comes_back_is_drawn(page, tailor):
    scale = scale_of(page)
    x, y = middle(corner(page, 2))
    page.check("#pattern-mirror")
    page.mouse.move(x, y)
    page.mouse.down()
    for step in range(1, 11):
        page.mouse.move(x + 4 * step, y - step)
        page.wait_for_timeout(20)
    held = tailor.hears(lambda message: is_edit(message, hold=True))
    assert [held.edit[field] for field in ("kind", "panel", "vertex")] == ["move_vertex", "front", 2]
    assert held.mirror
    comes_to(corner(page, 2), (x + 40, y - 10))
    assert "cm right" in page.inner_text("#pattern-chosen")
    page.mouse.up()
    edit = tailor.hears(kept)
    assert edit.edit["by"] == pytest.approx([40 / scale, 10 / scale], rel=0.02)
    assert edit.mirror
    edits = [message for message in tailor.heard if isinstance(message, wire.EditMessage)]
    assert [message.hold for message in edits] == [True] * (len(edits) - 1) + [False]
    assert len({message.request for message in edits}) == len(edits)

    before = corner(page, 1).bounding_box()["x"]
    done = (DesignEdit(id=1, kind="move_vertex", panel="front"),)
    tailor.say(design(0.9, done=done, notes=("edge 3 of 'back' follows",)))
    tailor.say(wire.EditedMessage(id=1, change="value", request=edit.request))
    page.wait_for_selector('#pattern[aria-busy="false"]')
    page.wait_for_selector("#pattern-made summary:has-text('1 edit made')")
    x_now = "document.querySelectorAll('.corner')[1].getBoundingClientRect().x"
    page.wait_for_function(f"x => Math.abs({x_now} - x) > 20", arg=before)
    assert "follows" in page.inner_text("#pattern-notice-message")


def test_an_edge_is_dragged_and_follows_what_the_server_draws(page, tailor):
    scale = scale_of(page)
    hem = page.locator(".piece").first.locator(".edge .reach").first
    x, y = middle(hem)
    page.mouse.move(x, y)
    page.mouse.down()
    for step in range(1, 9):
        page.mouse.move(x + step, y + 3 * step)
        page.wait_for_timeout(20)
    held = tailor.hears(lambda message: is_edit(message, hold=True))
    assert [held.edit[field] for field in ("kind", "panel", "edge")] == ["lengthen", "front", 0]
    assert hem.get_attribute("aria-pressed") == "true"
    assert middle(hem) == pytest.approx((x, y), abs=1.5)
    page.mouse.up()
    assert tailor.hears(kept).edit["by"] == pytest.approx(24 / scale, rel=0.02)


def test_an_edge_that_is_clicked_is_chosen_and_nothing_is_moved(page, tailor):
    hem = page.locator(".piece").first.locator(".edge .reach").first
    x, y = middle(hem)
    page.mouse.click(x, y)
    assert hem.get_attribute("aria-pressed") == "true"
    assert not [message for message in tailor.heard if isinstance(message, wire.EditMessage)]


def test_pictures_bound_what_a_drag_sends(page, tailor):
    x, y = middle(corner(page, 1))
    page.mouse.move(x, y)
    page.mouse.down()
    page.evaluate(
        """([x, y]) => {
            const sheet = document.querySelector('#pattern-sheet');
            window.pictures = 0;
            const count = () => { window.pictures += 1; window.counting = requestAnimationFrame(count); };
            count();
            const more = { pointerId: 1, pointerType: 'mouse', bubbles: true };
            for (let i = 1; i <= 500; i += 1)
                sheet.dispatchEvent(new PointerEvent('pointermove', { ...more, clientX: x + i / 10, clientY: y }));
        }""",
        [x, y],
    )
    page.mouse.move(x + 50, y)
    page.mouse.up()
    tailor.hears(kept)
    assert sum(is_edit(message, hold=True) for message in tailor.heard) <= page.evaluate("window.pictures")


def test_what_is_dragged_out_of_the_sheet_is_held_at_its_border_and_the_sheet_goes_on(page, tailor):
    """The pointer is held 200 px beside the sheet; let go there, all of the pattern is in sight again."""
    sheet = page.locator("#pattern-sheet").bounding_box()
    x, y = middle(corner(page, 2))
    scale = scale_of(page)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x - 20, y - 2)
    page.mouse.move(sheet["x"] - 200, y + 10, steps=4)

    def far(message):
        return is_edit(message, hold=True) and message.edit["by"][0] < -1.5 * (x - sheet["x"]) / scale

    tailor.hears(far)
    left, top = middle(corner(page, 2))
    assert sheet["x"] <= left <= sheet["x"] + 40
    assert sheet["y"] <= top <= sheet["y"] + sheet["height"]
    page.mouse.move(x, y)
    told: list[int] = [-1]
    for _ in range(20):  # the last that was on its way may still come
        told.append(sum(is_edit(message, hold=True) for message in tailor.heard))
        if told[-1] == told[-2]:
            break
        page.wait_for_timeout(300)
    assert told[-1] == told[-2], "it stands"
    page.keyboard.press("Escape")
    comes_to(corner(page, 2), (x, y))
    page.mouse.up()


def test_escape_drops_a_drag(page, tailor):
    x, y = middle(corner(page, 0))
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x - 30, y + 10)
    tailor.hears(lambda message: is_edit(message, hold=True))
    page.keyboard.press("Escape")
    dropped = tailor.hears(lambda message: isinstance(message, wire.EditMessage) and message.edit is None)
    assert dropped.hold
    page.mouse.move(x - 60, y)
    page.mouse.up()
    comes_to(corner(page, 0), (x, y))
    assert not any(map(kept, tailor.heard))


def test_a_finger_drags_a_corner_that_it_nearly_meets(page, tailor):
    touch = page.context.new_cdp_session(page)
    x, y = middle(corner(page, 2))

    def finger(kind: str, *places: float) -> None:
        points = [{"x": place, "y": y} for place in places]
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    finger("touchStart", x + 14)
    finger("touchMove", x + 34)
    finger("touchMove", x + 54)
    finger("touchEnd")
    edit = tailor.hears(kept)
    assert edit.edit["vertex"] == 2
    assert edit.edit["by"] == pytest.approx([40 / scale_of(page), 0], rel=0.02)
    refuse(tailor, edit.request)
    comes_to(corner(page, 2), (x, y))
    tailor.heard.clear()
    finger("touchStart", x)
    finger("touchMove", x + 40)
    tailor.hears(lambda message: is_edit(message, hold=True))
    finger("touchCancel")
    tailor.hears(lambda message: isinstance(message, wire.EditMessage) and message.edit is None)
    comes_to(corner(page, 2), (x, y))
    assert not any(map(kept, tailor.heard))


def test_a_refused_edit_says_why_and_the_piece_is_as_it_was(page, tailor):
    x, y = middle(corner(page, 3))
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 90, y)
    page.mouse.up()
    refuse(tailor, tailor.hears(kept).request)
    page.wait_for_selector("#pattern-notice:visible")
    assert page.inner_text("#pattern-notice-message") == "The edges would cross"
    assert page.inner_text("#pattern-notice-remedy") == "Move it less far"
    comes_to(corner(page, 3), (x, y))
    assert page.locator("#notice").is_hidden()


def test_a_drag_that_can_not_be_shown_is_told_beside_the_pattern_and_goes_on(page, tailor):
    x, y = middle(corner(page, 3))
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 90, y)
    refuse(tailor, tailor.hears(lambda message: is_edit(message, hold=True)).request)
    page.wait_for_selector("#pattern-notice:visible")
    assert page.inner_text("#pattern-notice-message") == "The edges would cross"
    assert page.locator("#notice").is_hidden()
    page.mouse.move(x + 40, y)
    page.mouse.up()
    assert tailor.hears(kept).edit["vertex"] == 3


def test_a_curve_is_bent_by_its_handle_and_a_straight_edge_has_one_when_chosen(page, tailor):
    x, y = middle(edge(page, 2).locator(".handle"))
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x, y + 25)
    page.mouse.up()
    edit = tailor.hears(kept).edit
    assert (edit["kind"], edit["edge"], edit["handle"]) == ("move_handle", 2, 0)
    assert edit["by"] == pytest.approx([0, -25 / scale_of(page)], abs=1e-6, rel=0.02)
    straight = edge(page, 0, of=1).locator(".handle").first
    assert straight.is_hidden()
    page.mouse.click(*middle(edge(page, 0, of=1).locator(".reach")))
    assert straight.is_visible()


@pytest.mark.parametrize("pointer", ["mouse", "touch"])
def test_a_straight_edge_that_is_pressed_at_a_third_is_dragged_itself(page, tailor, pointer):
    """Where a handle would be if it were chosen: nobody has seen that. Chosen, it is seen and dragged."""
    (left, y), (right, _) = middle(corner(page, 0)), middle(corner(page, 1))
    third = left + (right - left) / 3
    handle = edge(page, 0).locator(".handle").first
    page.mouse.click(*middle(page.locator(".piece").nth(1).locator(".cloth")))
    page.mouse.move(third, y)
    assert handle.is_hidden()
    drag_by(page, (third, y), (0, 20), pointer)
    edit = tailor.hears(kept).edit
    assert (edit["kind"], edit["edge"]) == ("lengthen", 0)
    tailor.heard.clear()
    tailor.say(design())
    comes_to(corner(page, 0), (left, y))
    assert handle.is_visible()
    drag_by(page, (third, y), (0, 20), pointer)
    edit = tailor.hears(kept).edit
    assert (edit["kind"], edit["edge"], edit["handle"]) == ("move_handle", 0, 0)


def drag_by(page, start, by, pointer):
    """Drag with a mouse, or a finger, from `start` by so many pixels."""
    (x, y), end = start, (start[0] + by[0], start[1] + by[1])
    if pointer == "mouse":
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(*end)
        page.mouse.up()
        return
    touch = page.context.new_cdp_session(page)
    for kind, places in (("touchStart", [(x, y)]), ("touchMove", [end]), ("touchEnd", [])):
        touch.send(
            "Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": left, "y": top} for left, top in places]}
        )


def test_a_seam_keeps_its_number_when_another_one_goes(page, tailor):
    numbers = page.locator(".piece").first.locator(".number")
    assert numbers.all_text_contents() == ["1", "2"]
    told = design()
    left = msgspec.structs.replace(told.seams[1], number=2)
    tailor.say(msgspec.structs.replace(told, seams=(left,)))
    page.wait_for_function("document.querySelectorAll('.piece:first-child .number').length === 1")
    assert numbers.all_text_contents() == ["2"]
    assert "seam 2 to" in edge(page, 3).locator(".reach").get_attribute("aria-label")


def test_keys_move_a_corner_by_a_millimetre_or_a_centimetre(page, tailor):
    page.mouse.click(*middle(corner(page, 2)))
    for key, by in (("ArrowRight", [0.001, 0]), ("Shift+ArrowUp", [0, 0.01])):
        tailor.heard.clear()
        page.keyboard.press(key)
        edit = tailor.hears(kept)
        assert edit.edit == {"kind": "move_vertex", "panel": "front", "vertex": 2, "by": pytest.approx(by, abs=1e-9)}
        tailor.say(wire.EditedMessage(id=1, change="value", request=edit.request))
        tailor.say(design())
    assert not any(is_edit(message, hold=True) for message in tailor.heard)


def test_edges_and_pieces_are_changed_by_numbers(page, tailor):
    def next_edit():
        edit = tailor.hears(kept)
        tailor.heard.clear()
        return edit.edit

    page.mouse.click(*middle(edge(page, 0).locator(".reach")))
    assert "50.0 cm, open" in page.inner_text("#pattern-chosen")
    page.fill("#pattern-hem input", "2.5")
    page.click("text=Shorten")
    assert next_edit() == {"kind": "lengthen", "panel": "front", "edge": 0, "by": pytest.approx(-0.025)}
    page.mouse.click(*middle(edge(page, 1).locator(".reach")))
    assert "seam 1 to back" in page.inner_text("#pattern-chosen")
    page.fill("#pattern-seam input", "1.5")
    page.keyboard.press("Enter")
    assert next_edit() == {"kind": "take_in", "panel": "front", "edge": 1, "by": pytest.approx(0.015)}
    page.click("text=Let out")
    assert next_edit()["by"] == pytest.approx(-0.015)
    page.fill("#pattern-seam input", "")
    page.click("text=Open seam")
    assert next_edit() == {"kind": "open_seam", "panel": "front", "edge": 1}
    page.mouse.click(*middle(page.locator(".cloth").nth(1)))
    page.fill("#pattern-piece input[name=width]", "110")
    page.click("#pattern-piece button")
    assert next_edit() == {"kind": "scale_piece", "panel": "back", "factors": [pytest.approx(1.1), 1]}
    page.keyboard.press("Escape")


def test_darts_gathers_removals_and_the_whole_garment_by_numbers(page, tailor):
    def next_edit():
        edit = tailor.hears(kept)
        tailor.heard.clear()
        return edit.edit

    page.click("#pattern-sheet", position={"x": 3, "y": 3})  # where no piece is
    page.fill("#pattern-garment input[name=height]", "95")
    page.click("text=Scale all")
    assert next_edit() == {"kind": "scale_garment", "factors": [1, pytest.approx(0.95)]}
    for label, value in (("chest, made for", "88"), ("chest, wanted", "96"), ("height, made for", "170")):
        page.get_by_label(f"{label}, cm").fill(value)
    page.click("text=Scale to it")
    made_for = {"chest": pytest.approx(0.88), "height": pytest.approx(1.7)}
    assert next_edit() == {"kind": "scale_garment", "made_for": made_for, "wanted": {"chest": pytest.approx(0.96)}}
    page.mouse.click(*middle(edge(page, 0).locator(".reach")))
    assert page.locator("#pattern-garment").is_hidden()
    page.fill("#pattern-dart input[name=width]", "4")
    page.fill("#pattern-dart input[name=position]", "30")
    page.click("text=Add dart")
    dart = {"kind": "dart", "panel": "front", "edge": 0, "position": 0.3, "width": 0.04, "depth": 0.08}
    assert next_edit() == dart | {key: pytest.approx(dart[key]) for key in ("position", "width", "depth")}
    page.mouse.click(*middle(edge(page, 1).locator(".reach")))
    for kind in ("Gather", "Ease"):
        page.click(f"#pattern-{kind.lower()} button")
        assert next_edit() == {"kind": kind.lower(), "panel": "front", "edge": 1}
    page.fill("#pattern-gather input", "60")
    page.click("#pattern-gather button")
    assert next_edit() == {"kind": "gather", "panel": "front", "edge": 1, "to": 0.6}
    page.fill("#pattern-ease input", "8")
    page.click("#pattern-ease button")
    assert next_edit() == {"kind": "ease", "panel": "front", "edge": 1, "by": pytest.approx(0.008)}
    page.mouse.click(*middle(page.locator(".cloth").nth(1)))
    page.click("text=Remove piece")
    assert next_edit() == {"kind": "remove_piece", "panel": "back"}


def test_a_fabric_that_is_refused_is_not_chosen_any_more(page, tailor):
    """One that is worn is an edit among those that can be taken back."""
    chosen = page.locator("#fabrics label:has(input:checked)")
    page.locator("#fabrics label", has_text="Denim").click()
    assert tailor.hears(lambda message: isinstance(message, wire.SetFabricMessage)).fabric == "denim"
    assert "Denim" in chosen.inner_text()
    tailor.say(wire.ErrorMessage(code="edit_refused", place="panels", message="It is too tight.", remedy="Enlarge it."))
    page.wait_for_function("() => document.querySelector('#fabrics input:checked').value === 'cotton'")
    assert "It is too tight." in page.inner_text("body")
    tailor.say(design(done=(DesignEdit(id=1, kind="change_fabric", panel=""),)))
    page.wait_for_selector("#pattern-made:has-text('Fabric changed')", state="attached")


def test_an_edge_is_sewn_to_the_one_that_is_chosen_next(page, tailor):
    page.mouse.click(*middle(edge(page, 0).locator(".reach")))
    page.click("text=Sew to…")
    assert "Choose the edge" in page.inner_text("#pattern-chosen")
    page.keyboard.press("Escape")
    assert "open" in page.inner_text("#pattern-chosen")
    page.mouse.click(*middle(edge(page, 0, of=1).locator(".reach")))
    page.click("text=Sew to…")
    page.mouse.click(*middle(edge(page, 0).locator(".reach")))
    edit = tailor.hears(kept)
    assert edit.edit == {"kind": "close_seam", "panel": "back", "edge": 0, "to_panel": "front", "to_edge": 0}
    assert "Edge 0 of front" in page.inner_text("#pattern-chosen")
    assert len([message for message in tailor.heard if kept(message)]) == 1


def test_a_piece_is_cut_along_a_line_that_is_drawn(page, tailor):
    (left, low), (right, high) = middle(corner(page, 0)), middle(corner(page, 2))
    scale, y = scale_of(page), 0.5 * (low + high)
    page.mouse.click(*middle(page.locator(".cloth").nth(0)))
    page.click("text=Cut…")
    page.mouse.move(left - 10, y)
    page.mouse.down()
    page.mouse.move(right + 5, y - 4)
    assert page.locator(".scissors").count() == 1
    page.keyboard.press("Escape")
    page.mouse.up()
    assert page.locator(".scissors").count() == 0
    page.click("text=Cut…")
    page.check("#pattern-cut input")
    page.mouse.move(left - 10, y)
    page.mouse.down()
    page.mouse.move(right, y)
    page.mouse.move(right + 10, y)
    page.mouse.up()
    edit = tailor.hears(kept).edit
    assert (edit["kind"], edit["panel"], edit["sewn"]) == ("cut", "front", True)
    ends = [[-10 / scale, 0.3], [0.5 + 10 / scale, 0.3]]
    assert edit["line"] == [pytest.approx(end, abs=1.5 / scale) for end in ends]
    assert "Piece front" in page.inner_text("#pattern-chosen")
    page.mouse.click(*middle(page.locator(".cloth").nth(1)))  # and no longer draws
    assert "Piece back" in page.inner_text("#pattern-chosen")
    assert len([message for message in tailor.heard if kept(message)]) == 1


def test_a_pocket_is_sewn_on_where_one_chooses_and_drawn_where_it_lies(page, tailor):
    (left, low), (right, high) = middle(corner(page, 0)), middle(corner(page, 2))
    page.mouse.click(*middle(page.locator(".cloth").nth(0)))
    page.fill("#pattern-patch input[name=width]", "10")
    page.click("text=Pocket…")
    assert "pocket's middle" in page.inner_text("#pattern-chosen")
    page.mouse.click(left + 0.25 * (right - left), low + 0.5 * (high - low))
    edit = tailor.hears(kept).edit
    assert edit["at"] == pytest.approx([0.125, 0.3], abs=1.5 / scale_of(page))
    rest = {key: value for key, value in edit.items() if key != "at"}
    assert rest == {"kind": "pocket", "panel": "front", "width": pytest.approx(0.1), "height": pytest.approx(0.13)}
    page.click("text=Patch…")
    page.keyboard.press("Escape")
    page.mouse.click(left + 0.25 * (right - left), low + 0.5 * (high - low))
    assert len([message for message in tailor.heard if kept(message)]) == 1
    corners = ((-0.05, -0.065), (0.05, -0.065), (0.05, 0.065), (-0.05, 0.065))
    points = tuple((0.125 + x, 0.3 + y) for x, y in corners)
    patches = (DesignPatch(panel=2, host=0, points=points),)
    tailor.say(design(panels=(*design().panels, piece("pocket", corners)), patches=patches))
    page.wait_for_selector(".piece >> nth=2")
    (left, low), (right, high) = middle(corner(page, 0)), middle(corner(page, 2))
    comes_to(page.locator(".patch"), (left + 0.25 * (right - left), low + 0.5 * (high - low)))
    tailor.say(design(patches=(DesignPatch(panel=7, host=0, points=points),)))
    page.wait_for_selector("#pattern-toggle", state="hidden")


def test_undo_and_redo_by_button_and_key(page, tailor):
    undo, redo = page.locator("#pattern-undo"), page.locator("#pattern-redo")
    assert undo.is_disabled()
    assert redo.is_disabled()
    tailor.say(design(done=(DesignEdit(id=3, kind="take_in", panel="front"),), undone=2))
    page.wait_for_selector("#pattern-redo:enabled")
    undo.click()
    redo.click()
    page.keyboard.press("Control+z")
    page.keyboard.press("Control+Shift+z")
    tailor.hears(lambda _: len(tailor.heard) == 4)
    assert [type(message).__name__ for message in tailor.heard] == ["UndoMessage", "RedoMessage"] * 2


def test_an_edit_that_takes_long_says_what_is_done_for_it_and_can_be_taken_back(page, tailor):
    """Nothing is made yet, so that there is nothing else to take back."""
    tailor.say(design(done=(), undone=0))
    page.wait_for_selector("#pattern-undo:disabled")
    dart = wire.ChangeStatus(
        step="edit",
        kind="dart",
        panel="front",
        garment="",
        since=1000.0,
        doing="dressing",
        detail="Sewing the seams",
        progress=0.4,
    )
    behind = msgspec.structs.replace(dart, kind="lengthen", since=1001.0, doing="waiting", detail="", progress=None)
    tailor.say(msgspec.structs.replace(status(), changes=(dart, behind)))
    line = page.locator("#pattern-status")
    line.wait_for(state="visible")
    told = line.inner_text()
    assert told.startswith("Dart added, front: dressing anew: Sewing the seams (40 %), ")
    assert told.endswith(" s; 1 more behind it")
    page.click("#pattern-undo")
    tailor.hears(lambda message: isinstance(message, wire.UndoMessage))
    tailor.say(msgspec.structs.replace(status(), changes=()))
    line.wait_for(state="hidden")
    page.wait_for_selector("#pattern-undo:disabled")
    no = msgspec.structs.replace(dart, doing="refused", detail="It does not fit. Make it smaller.", progress=None)
    tailor.say(msgspec.structs.replace(status(), changes=(no,)))
    line.wait_for(state="visible")
    assert line.inner_text() == "Dart added, front: refused: It does not fit. Make it smaller."


def test_nothing_that_a_server_says_breaks_the_page(page, tailor):
    x, y = middle(corner(page, 2))
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 20, y)
    tailor.say(design(panels=(piece("other", ((0.0, 0.0), (0.2, 0.0), (0.1, 0.2))),), seams=()))
    page.wait_for_selector(".piece[aria-label=other]")
    page.mouse.move(x + 40, y)
    page.mouse.up()
    tailor.say(wire.EditedMessage(id=9, change="topology", request=4000))
    refuse(tailor, 4000)
    page.wait_for_selector("#notice:visible")
    nan = float("nan")
    for bad in (
        design(panels=(piece("a", ((0.0, 0.0), (nan, 0.0), (0.1, 0.2))),), seams=()),
        design(panels=()),
        DesignMessage(held=True, panels=design().panels[:1], seams=design().seams, done=(), undone=0),
    ):
        tailor.say(bad)
        page.wait_for_selector("#pattern-toggle", state="hidden")
        tailor.say(design())
        page.wait_for_selector("#pattern-sheet .piece >> nth=1")


@pytest.mark.long
def test_a_garment_that_is_a_mesh_has_no_pattern(unseen, tailor):
    tailor.pattern = None
    page = open_page(unseen, tailor.url, 1280, 800)
    page.wait_for_selector('#status[data-state="running"]')
    assert page.locator("#pattern-toggle").is_hidden()
    assert page.locator("#pattern").is_hidden()
    assert page.faults == []
    page.context.close()


@pytest.mark.parametrize(
    ("width", "height"),
    [*(pytest.param(*size, marks=pytest.mark.long) for size in ((1280, 800), (1000, 700))), (360, 740)],
)
def test_the_pattern_finds_room_in_any_window(unseen, tailor, width, height):
    tailor.pattern = design()
    page = open_page(unseen, tailor.url, width, height)
    page.click("#pattern-toggle")
    page.wait_for_selector("#pattern-sheet .piece >> nth=1")
    page.mouse.click(*middle(edge(page, 1).locator(".reach")))
    assert page.evaluate("document.documentElement.scrollWidth") == width
    sheet = page.locator("#pattern-sheet").bounding_box()
    for i in range(2):
        box = page.locator(".cloth").nth(i).bounding_box()
        assert box["width"] > 50
        assert sheet["x"] <= box["x"]
        assert box["x"] + box["width"] <= sheet["x"] + sheet["width"]
        assert sheet["y"] <= box["y"]
        assert box["y"] + box["height"] <= sheet["y"] + sheet["height"]
    page.click("#pattern-close")
    assert page.locator("#pattern").is_hidden()
    assert page.faults == []
    page.context.close()
