"""The page in a real Chromium, against a real server whose sessions simulate the dress form."""

from __future__ import annotations

import asyncio
import json
import runpy
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from urllib.request import Request, urlopen

import numpy as np
import pytest
from browser import another_session, figure, open_page, picture, settled_picture, wait_for_frames, wait_for_state
from studio import pattern

from tryon_client import connect

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def shared(chromium, studio):
    """The page on one session, for all tests that change nothing for good."""
    page = open_page(chromium, studio.url)
    yield page
    page.context.close()


@pytest.fixture
def page(shared):
    """The page with the garment in cotton, dressed and moving. It must run without an uncaught error."""
    shared.wait_for_selector("#play:enabled")
    if shared.inner_text("#play-text") == "Play":
        shared.click("#play")
    shared.locator("#fabrics label", has_text="Cotton").click()
    shared.locator("#colours label").first.click()
    wait_for_state(shared, "running")
    wait_for_frames(shared)
    yield shared
    assert shared.faults == []


def broken_pattern() -> bytes:
    """A stitch to a piece that is not there."""
    spec = pattern()
    spec["pattern"]["stitches"] = [[{"panel": "front", "edge": 1}, {"panel": "sleeve", "edge": 0}]]
    return json.dumps(spec).encode()


def session_of(page) -> str:
    return page.evaluate("new URL(location.href).searchParams.get('session')")


def ask(studio, path: str):
    with urlopen(studio.url + path) as reply:
        return json.load(reply)


def reddish(image: np.ndarray) -> int:
    """How many pixels show the red fabric."""
    red, green, blue = (image[..., i].astype(int) for i in range(3))
    return int(((red > 90) & (red > 1.8 * green) & (red > 1.8 * blue)).sum())


def bluish(image: np.ndarray) -> int:
    """How many pixels show the blue fabric."""
    red, green, blue = (image[..., i].astype(int) for i in range(3))
    return int(((blue > 70) & (blue > 1.3 * red) & (blue > 1.15 * green)).sum())


def as_file(name: str, content: bytes) -> dict[str, object]:
    return {"name": name, "mimeType": "application/json", "buffer": content}


def test_a_dressed_body_is_shown_and_the_figures_move(page):
    assert figure(page, "vertices") == 48 * 24
    figures = {"clearance-mm": 3.0, "min-gap-mm": 1.2, "max-stretch-percent": 4.3, "body-lag-mm": 2.0, "pairs": 320.0}
    for name, expected in figures.items():
        page.wait_for_selector(f"#readout[data-{name}]:not([data-{name}=''])", state="attached")
        assert figure(page, name) == pytest.approx(expected)
    before = [figure(page, name) for name in ("frames", "seq", "simulated-s")]
    wait_for_frames(page, 10)
    after = [figure(page, name) for name in ("frames", "seq", "simulated-s")]
    assert all(new > old for old, new in zip(before, after, strict=True))
    assert figure(page, "fps") > 0
    assert figure(page, "age-ms") >= 0
    assert figure(page, "pace") > 0
    assert page.evaluate("tryon.readout.vertices") == 48 * 24
    image = picture(page)
    assert reddish(image) > 0.02 * image.shape[0] * image.shape[1], "the tunic is not to be seen"
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 500, "light and shadow are missing"


def test_pause_stops_the_motion_and_play_goes_on(page):
    page.click("#play")
    wait_for_state(page, "paused")
    assert page.inner_text("#play-text") == "Play"
    still = settled_picture(page)
    seq = figure(page, "seq")
    page.wait_for_timeout(700)
    assert figure(page, "seq") == seq
    assert np.array_equal(picture(page), still)
    page.click("#play")
    wait_for_state(page, "running")
    wait_for_frames(page)
    assert figure(page, "seq") > seq
    assert not np.array_equal(picture(page), still)


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


def test_motion_and_fabric_change_within_the_session(page, studio):
    session = session_of(page)
    page.locator("#motions label", has_text="Turn").click()
    page.wait_for_function("() => Math.abs(Number(document.getElementById('readout').dataset.rootX)) > 0.1")
    page.locator("#fabrics label", has_text="Denim").click()
    wait_for_frames(page, 15)
    wait_for_state(page, "running")
    told = ask(studio, f"api/sessions/{session}")
    assert (told["motion"], told["fabric"], session_of(page)) == ("turn", "denim", session)
    for _ in range(20):  # until its picture is there
        image = picture(page)
        if bluish(image):
            break
        wait_for_frames(page, 5)
    assert bluish(image) > 0.02 * image.shape[0] * image.shape[1]
    assert reddish(image) == 0
    page.locator("#motions label", has_text="Walk").click()


def test_advice_is_shown_as_long_as_it_is_given(page):
    page.wait_for_selector("#advice", state="hidden")
    page.locator("#fabrics label", has_text="Denim").click()
    page.wait_for_selector("#advice:visible")
    assert page.inner_text("#advice") == "The fabric is stretched by up to 35 %; try a larger size"
    page.locator("#fabrics label", has_text="Cotton").click()
    page.wait_for_selector("#advice", state="hidden")


@pytest.mark.long
def test_open_figures_leave_the_middle_of_the_picture_free(chromium, studio):
    page = open_page(chromium, studio.url, 1280, 800)
    wait_for_state(page, "running")
    assert not page.evaluate("document.getElementById('readout').open")
    page.click("#readout > summary")
    card, view = page.locator("#readout").bounding_box(), page.locator("#stage").bounding_box()
    assert card["x"] - view["x"] > 0.74 * view["width"], "a hand reaches that far with the arms held off the body"
    assert card["x"] + card["width"] <= view["x"] + view["width"]
    assert page.locator("#readout").evaluate("card => card.scrollWidth <= card.clientWidth")
    page.context.close()


def test_another_colour_is_worn_as_soon_as_its_picture_is_there(page):
    with page.expect_response(lambda response: "dye=" in response.url):
        page.locator("#colours label[title='Ink']").click()
    for _ in range(20):
        image = picture(page)
        if reddish(image) == 0:
            break
        page.wait_for_timeout(500)
    assert reddish(image) == 0
    assert bluish(image) > 0.01 * image.shape[0] * image.shape[1]


def test_a_fabric_that_does_not_fit_is_refused_and_the_garment_worn_on(page):
    page.locator("#fabrics label", has_text="Tight").click()
    page.locator("#notice:visible", has_text="stayed open").wait_for()
    wait_for_state(page, "running")
    wait_for_frames(page)
    page.locator("#fabrics label", has_text="Denim").click()
    wait_for_state(page, "running")
    wait_for_frames(page)


def test_a_second_page_joins_the_session_and_sees_it_paused(page, chromium):
    other = open_page(chromium, page.url)
    wait_for_state(other, "running")
    wait_for_frames(other)
    assert session_of(other) == session_of(page)
    page.click("#play")
    wait_for_state(other, "paused")
    assert other.inner_text("#play-text") == "Play"
    other.context.close()


def test_a_session_that_is_not_there_is_replaced_and_said_so(chromium, studio):
    page = open_page(chromium, f"{studio.url}?session=nowhere")
    wait_for_state(page, "running")
    assert "isn't there" in page.inner_text("#notice-title")
    assert session_of(page) != "nowhere"
    page.context.close()


def stand_at(url: str, place: list[float], seconds: float) -> None:
    """Stream the rest pose, standing there, for a while: a headset whose wearer does not move."""

    async def send() -> None:
        async with connect(url) as stream:
            listening = asyncio.create_task(listen(stream))
            while stream.topology is None:
                await asyncio.sleep(0.02)
            body = stream.topology.body
            rest = [[0.0, 0.0, 0.0, 1.0]] * len(body.joint_names)
            root = body.rest_joints[0] + place
            for _ in range(int(20 * seconds)):
                await stream.send_pose(root, rest, time.monotonic())
                await asyncio.sleep(0.05)
            listening.cancel()

    with ThreadPoolExecutor(1) as other_thread:  # the browser's driver has an event loop running in this one
        other_thread.submit(asyncio.run, send()).result()


async def listen(stream) -> None:
    async for _ in stream:
        pass


@pytest.mark.long
def test_a_wearer_ten_kilometres_away_is_shown_as_sharply_as_one_here(chromium, studio):
    """Nothing of the picture is lost to float32: the tunic is as smooth and as large there as here."""
    shown = []
    for place in ([0.0, 0.0, 0.0], [10_000.0, 0.0, -10_000.0]):
        wish = json.dumps({"garment": "tshirt", "motion": None, "fabric": "cotton"}).encode()
        asked = Request(f"{studio.url}api/sessions", wish, {"Content-Type": "application/json"})
        with urlopen(asked) as reply:
            session = json.load(reply)
        page = open_page(chromium, f"{studio.url}?session={session['id']}", 480, 420)
        page.wait_for_selector('#view[data-shown="figure"]')  # as dressed; frames go on when poses come
        stand_at(studio.url.replace("http", "ws", 1).rstrip("/") + session["stream"], place, 2.5)
        page.wait_for_function(
            "x => Math.abs(Number(document.getElementById('readout').dataset.rootX) - x) < 0.01", arg=place[0]
        )
        assert page.evaluate("tryon.readout.rootZ") == pytest.approx(place[2], abs=0.01)
        image = settled_picture(page)
        share = reddish(image) / (image.shape[0] * image.shape[1])
        shown.append((share, len(np.unique(image.reshape(-1, 3), axis=0))))
        assert page.faults == []
        page.context.close()
    (here, colours_here), (there, colours_there) = shown
    assert here > 0.02, "the tunic is not to be seen"
    print(f"share of the picture {here:.4f} and {there:.4f}, colours {colours_here} and {colours_there}")
    assert there == pytest.approx(here, rel=0.05)
    assert colours_there == pytest.approx(colours_here, rel=0.2)


@pytest.mark.long
def test_an_ended_session_says_so_and_can_be_started_again(chromium, studio):
    page = open_page(chromium, studio.url)
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


def test_the_page_fits_a_phone(page, chromium):
    phone = open_page(chromium, page.url, 360, 740)
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


def test_a_killed_server_is_waited_for_and_the_page_recovers(chromium, web, tmp_path):
    from studio import Studio

    server = Studio(tmp_path, web)
    try:
        page = open_page(chromium, server.url)
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
