"""The page in AR: a real Chromium with an emulated headset (IWER), whose wearer's body is a clip."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np
import pytest
from browser import another_session, decode, figure, open_page, wait_for_frames, wait_for_state
from studio import ROOT, Studio

from tryon_solver.body import default_body

pytestmark = pytest.mark.browser

HEADSET = Path(__file__).parent / "support" / "headset.js"
IWER = ROOT / "node_modules" / "iwer" / "build" / "iwer.min.js"


# The frame on show was solved for a pose of a moment ago: the body has caught up with the wearer.
CAUGHT_UP = "() => performance.timeOrigin + performance.now() - 1000 * tryon.readout.simulatedS < 600"
ROOT_AND_HIPS = """() => {
    const { rootX, rootY, rootZ, simulatedS } = tryon.readout;
    return [[rootX, rootY, rootZ], headset.hipsAt(1000 * simulatedS)];
}"""


@pytest.fixture(scope="module")
def mannequin(web, tmp_path_factory):
    """A server whose sessions dress the default body, which can follow trackers."""
    from tryon_solver.body.model import default_body_path

    if not IWER.is_file():
        pytest.skip("the emulated headset is not installed: run `npm ci`")
    if not default_body_path().is_file():
        pytest.skip("the default body is not there: run `python scripts/make_body.py`")
    server = Studio(tmp_path_factory.mktemp("mannequin"), web, "mannequin")
    yield server
    server.kill()


def enter(chromium, server, clip: dict[str, object] | None):
    """The page of a browser with a headset, in AR."""
    told = f"window.headsetClip = {json.dumps(clip)};"
    page = open_page(chromium, server.url, scripts=[IWER.read_text(), told + HEADSET.read_text()])
    wait_for_state(page, "running")
    wait_for_frames(page)
    page.wait_for_selector("#ar:visible")
    page.click("#ar")
    page.wait_for_selector("#ar[aria-pressed='true']")
    return page


def wait_for_tracking(page, tracking: str, poses: int = 20) -> None:
    page.wait_for_function(
        "([tracking, poses]) => { const { dataset } = document.getElementById('view');"
        " return dataset.tracking === tracking && Number(dataset.poses) >= poses }",
        arg=[tracking, poses],
    )


def share_of_red(page) -> float:
    """Of the stage's picture; nothing on it is red but the garment."""
    png = page.locator("#stage").screenshot(style=".top, .bar, .readout, .notice { visibility: hidden }")
    image = decode(page, png).astype(int)
    red = (image[..., 0] > 60) & (image[..., 0] > 1.8 * image[..., 1]) & (image[..., 0] > 1.8 * image[..., 2])
    return float(red.mean())


@pytest.mark.long
def test_the_clips_body_drives_the_garment_in_ar_and_the_page_takes_over_again(chromium, mannequin):
    from mannequin import tracked_clip

    page = enter(chromium, mannequin, tracked_clip("squat"))
    wait_for_tracking(page, "body")
    wait_for_state(page, "running")
    wait_for_frames(page, 10)

    # The body is where the clip's is: at the frame's own time, on the clock of the poses.
    page.wait_for_function(CAUGHT_UP)
    roots, hips = [], []
    for _ in range(24):
        wait_for_frames(page, 3)
        root, hip = page.evaluate(ROOT_AND_HIPS)
        roots.append(root)
        hips.append(hip)
    apart = np.linalg.norm(np.array(roots) - hips, axis=1)
    assert np.median(apart) < 0.08, f"the body is {apart} m from the wearer"
    assert np.ptp(np.array(hips)[:, 1]) > 0.2, "the wearer squats"
    assert np.ptp(np.array(roots)[:, 1]) > 0.15, "the body does not"

    # The body hides and is not seen: it writes depth and no colour, before the garment writes both.
    page.evaluate("headset.watching = true")
    page.wait_for_function("headset.draws.length > 60")
    page.evaluate("headset.watching = false")
    draws = page.evaluate("headset.draws")
    faces = {draw["count"] for draw in draws if not draw["colour"]}
    assert len(faces) == 1, f"one mesh is invisible, not {faces}"
    hidden = [k for k, draw in enumerate(draws) if not draw["colour"]]
    assert all(draws[k]["depth"] for k in hidden)
    assert draws[hidden[0] + 1]["colour"]
    assert draws[hidden[0] + 1]["depth"]

    # How much of it is to be seen changes with the squat: at its most over a two-hundredth of the picture.
    shares = []
    for _ in range(12):
        wait_for_frames(page, 3)
        shares.append(share_of_red(page))
        if shares[-1] > 0.005:
            break
    assert max(shares) > 0.005, f"the garment is not to be seen: {shares}"

    before = figure(page, "frames")
    page.dispatch_event("#ar", "click")  # IWER puts the headset's picture over the page
    page.wait_for_selector("#ar[aria-pressed='false']")
    assert page.inner_text("#ar") == "Enter AR"
    page.wait_for_function("() => document.getElementById('view').dataset.tracking === undefined")
    wait_for_state(page, "running")
    wait_for_frames(page, 10)
    assert figure(page, "frames") > before
    assert page.locator("#motions label", has_text="Walk").locator("input").is_checked()
    assert page.faults == []
    page.context.close()


def test_without_body_tracking_head_and_hands_are_followed(chromium, mannequin):
    page = enter(chromium, mannequin, None)
    wait_for_tracking(page, "head and hands")
    wait_for_state(page, "running")
    page.evaluate("headset.device.position.set(0.7, 1.6, -0.4)")
    page.wait_for_function(
        "() => Math.abs(tryon.readout.rootX - 0.7) < 0.15 && Math.abs(tryon.readout.rootZ + 0.3) < 0.25"
    )
    page.wait_for_function("() => Math.abs(tryon.readout.rootY - 0.9) < 0.1")  # it stands under the head
    assert page.faults == []
    page.context.close()


@pytest.mark.long
def test_a_body_that_moves_by_itself_is_no_body_for_ar_and_the_page_says_so(chromium, mannequin):
    """Its poses would be refused for ever."""
    headset = "window.headsetClip = null;" + HEADSET.read_text()
    page = open_page(chromium, mannequin.url, scripts=[IWER.read_text(), headset])
    wait_for_state(page, "running")
    body, held = default_body(), io.BytesIO()
    np.savez_compressed(held, vertices=np.stack([body.rest_vertices] * 2), faces=body.faces, fps=2.0)
    actor = {"name": "actor.npz", "mimeType": "application/octet-stream", "buffer": held.getvalue()}
    page.set_input_files("#body-file", files=[actor])
    page.wait_for_selector("#notice-title:has-text('How actor.npz was read')", timeout=120_000)
    page.click("#notice-close")
    page.click("#ar")
    page.wait_for_selector("#notice-title:has-text('AR needs a body that can be posed')")
    assert "default body" in page.inner_text("#notice-remedy")
    page.click("#notice-close")
    assert page.get_attribute("#ar", "aria-pressed") != "true"
    assert page.evaluate("document.getElementById('view').dataset.poses") is None
    with another_session(page):
        page.locator("#bodies label", has_text="Default").click()
    page.click("#ar")
    page.wait_for_selector("#ar[aria-pressed='true']")
    wait_for_tracking(page, "head and hands")
    assert page.locator("#notice").is_hidden()
    assert page.faults == []
    page.context.close()


def test_a_browser_without_ar_offers_none(chromium, mannequin):
    page = open_page(chromium, mannequin.url)
    wait_for_state(page, "running")
    assert page.locator("#ar").is_hidden()
    page.context.close()
