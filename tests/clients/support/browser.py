"""Chromium for tests: found, started, and its pictures read."""

from __future__ import annotations

import base64
import os
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
import numpy.typing as npt
from playwright.sync_api import Browser, Page, Playwright

FLAGS = ("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
WITHOUT_PICTURES = "--disable-gpu-compositing"  # a page is put together faster so, but for one with pictures of WebGL
UNSEEN = """for (const draw of ["clear", "drawArrays", "drawElements", "drawArraysInstanced", "drawElementsInstanced"])
    WebGL2RenderingContext.prototype[draw] = () => {};"""  # in software a picture takes as long as a frame's simulation
PATIENCE = 60_000  # [ms] for anything that must happen sooner or later, on a machine that others use too

DECODE = """async png => {
    const bytes = Uint8Array.from(atob(png), letter => letter.charCodeAt(0));
    const image = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
    const canvas = new OffscreenCanvas(image.width, image.height).getContext("2d");
    canvas.drawImage(image, 0, 0);
    const { data } = canvas.getImageData(0, 0, image.width, image.height);
    let text = "";
    for (let at = 0; at < data.length; at += 32768) text += String.fromCharCode(...data.subarray(at, at + 32768));
    return [image.width, image.height, btoa(text)];
}"""


def find_chromium() -> str | None:
    """The first of $CHROMIUM, chromium, chromium-browser, google-chrome that can be run."""
    names = [os.environ.get("CHROMIUM", ""), "chromium", "chromium-browser", "google-chrome"]
    return next((path for name in names if name and (path := shutil.which(name))), None)


@contextmanager
def launch(playwright: Playwright, path: str, seen: bool = True) -> Iterator[Browser]:
    """A browser. Where no picture that its pages have of the wearer is ``seen``, all goes its way but the drawing."""
    browser = playwright.chromium.launch(executable_path=path, args=[*FLAGS, *([] if seen else [WITHOUT_PICTURES])])
    browser.seen = seen
    yield browser
    browser.close()


def open_page(
    browser: Browser, url: str, width: int = 860, height: int = 620, scripts: Sequence[str] = ()
) -> Page:
    """A page in a profile of its own, whose uncaught errors are collected in ``page.faults``; ``scripts`` run in it
    before its own."""
    page = browser.new_context(viewport={"width": width, "height": height}).new_page()
    for script in (*scripts, *([] if browser.seen else [UNSEEN])):
        page.add_init_script(script)
    page.set_default_timeout(PATIENCE)
    page.faults = []
    page.on("pageerror", lambda error: page.faults.append(str(error)))
    page.goto(url)
    return page


def figure(page: Page, name: str) -> float:
    """A figure of the readout, from its data attribute; NaN when it is not known."""
    text = page.locator("#readout").get_attribute(f"data-{name}") or ""
    return float(text) if text else float("nan")


def wait_for_state(page: Page, state: str) -> None:
    """Until the server says that the session is in this state."""
    page.wait_for_selector(f'#status[data-link="open"][data-state="{state}"]')


@contextmanager
def another_session(page: Page) -> Iterator[None]:
    """What is done here starts another session; ends when the page is in it and it runs. The choice that the page
    shows, and the state of the session before, say nothing of it: both are there while the new one is asked for."""
    before = page.url
    yield
    page.wait_for_function("before => location.href !== before", arg=before)
    wait_for_state(page, "running")


def wait_for_frames(page: Page, count: int = 5) -> None:
    """Until so many frames more have been drawn or at least received."""
    target = figure(page, "frames") + count
    page.wait_for_function("least => Number(document.getElementById('readout').dataset.frames) >= least", arg=target)


def picture(page: Page) -> npt.NDArray[np.uint8]:
    """(height, width, 3) what the canvas shows, as a person would see it, without what stands over it."""
    png = page.locator("#stage").screenshot(style=".top, .bar, .readout, .notice, .advice { visibility: hidden }")
    return decode(page, png)


def settled_picture(page: Page) -> npt.NDArray[np.uint8]:
    """The picture once it has come to rest: the last frames have arrived and the camera has caught up."""
    before = picture(page)
    for _ in range(40):
        page.wait_for_timeout(400)
        now = picture(page)
        if np.array_equal(before, now):
            return now
        before = now
    raise AssertionError("the picture does not come to rest")


def decode(page: Page, png: bytes) -> npt.NDArray[np.uint8]:
    """(height, width, 3) of a PNG, decoded by the browser."""
    width, height, pixels = page.evaluate(DECODE, base64.b64encode(png).decode())
    image = np.frombuffer(base64.b64decode(pixels), np.uint8).reshape(height, width, 4)
    return image[..., :3]
