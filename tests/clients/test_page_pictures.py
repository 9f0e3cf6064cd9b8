"""The wearer as the page shows it in a real Chromium, for a real server whose sessions simulate the dress form."""

from __future__ import annotations

import asyncio
import json
import time
from concurrent.futures import ThreadPoolExecutor
from urllib.request import Request, urlopen

import numpy as np
import pytest
from browser import figure, open_page, picture, settled_picture, wait_for_frames, wait_for_state
from dressed_page import as_it_began, ask, opened, session_of

from tryon_client import connect

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def shared(chromium, studio):
    """The page on one session, for all tests that change nothing for good."""
    with opened(chromium, studio.url) as page:
        yield page


@pytest.fixture
def page(shared):
    with as_it_began(shared):
        yield shared


def reddish(image: np.ndarray) -> int:
    """How many pixels show the red fabric."""
    red, green, blue = (image[..., i].astype(int) for i in range(3))
    return int(((red > 90) & (red > 1.8 * green) & (red > 1.8 * blue)).sum())


def bluish(image: np.ndarray) -> int:
    """How many pixels show the blue fabric."""
    red, green, blue = (image[..., i].astype(int) for i in range(3))
    return int(((blue > 70) & (blue > 1.3 * red) & (blue > 1.15 * green)).sum())


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
