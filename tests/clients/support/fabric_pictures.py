"""`python tests/clients/support/fabric_pictures.py`: one garment in each fabric, as the page shows it, side by side.

Starts a server of its own, dresses the garment in each fabric on the body as it stands, and takes two pictures of the
page in Chromium: of the whole, and of the cloth from nearby. The page has to be built (`make demo` does).
"""

from __future__ import annotations

import argparse
import base64
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from urllib.request import Request, urlopen

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / folder) for folder in ("tests/clients/support", "solver", "server", "protocol")]

from browser import find_chromium, launch, open_page  # noqa: E402
from playwright.sync_api import Browser, Page, sync_playwright  # noqa: E402
from studio import free_port  # noqa: E402

from tryon_solver.materials.fabric import FABRICS  # noqa: E402

VIEW = (1100, 900)  # px, of the page
WHOLE = (260, 620)  # px, of the picture of the garment, around the middle of the stage
NEAR = 150  # px, of the picture from nearby
WHEEL = 4  # turns of it towards the cloth, of a thousand pixels each
COLUMNS = 5
START_SECONDS, DRESS_SECONDS = 60.0, 240.0

MAPS_ARE_HERE = """() => ["colour", "normal", "roughness"].every(kind =>
    performance.getEntriesByType("resource").some(({ name }) => name.includes(`/${kind}.png`)))"""

COMPOSE = """async ({ tiles, whole, near, columns }) => {
    const [width, height] = whole;
    const rows = Math.ceil(tiles.length / columns), line = 26, gap = 4;
    const canvas = new OffscreenCanvas(columns * (width + gap) - gap, rows * (height + line + gap) - gap);
    const context = canvas.getContext("2d");
    context.fillStyle = "#f6f3ee";
    context.fillRect(0, 0, canvas.width, canvas.height);
    const read = async text => createImageBitmap(await (await fetch("data:image/png;base64," + text)).blob());
    for (const [k, { name, far, close }] of tiles.entries()) {
        const x = (k % columns) * (width + gap), y = Math.floor(k / columns) * (height + line + gap);
        context.drawImage(await read(far), x, y);
        context.drawImage(await read(close), x + width - near - 6, y + height - near - 6);
        context.strokeStyle = "#ffffff";
        context.lineWidth = 2;
        context.strokeRect(x + width - near - 6, y + height - near - 6, near, near);
        context.fillStyle = "#2b2926";
        context.font = "16px sans-serif";
        context.textAlign = "center";
        context.fillText(name.replaceAll("_", " "), x + width / 2, y + height + 19);
    }
    const blob = await canvas.convertToBlob({ type: "image/jpeg", quality: 0.84 });
    const bytes = new Uint8Array(await blob.arrayBuffer());
    let text = "";
    for (let at = 0; at < bytes.length; at += 32768) text += String.fromCharCode(...bytes.subarray(at, at + 32768));
    return btoa(text);
}"""


def main(arguments: list[str] | None = None) -> int:
    """The command line; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    add = parser.add_argument
    add("--fabrics", nargs="+", choices=FABRICS, default=list(FABRICS), metavar="NAME", help="which (default all)")
    add("--garment", default="dress", help="id of one of the demo's garments (default dress)")
    add("--out", type=Path, default=ROOT / "docs/fabrics/side_by_side.jpg", help="the picture to write")
    options = parser.parse_args(arguments)
    chromium = find_chromium()
    if chromium is None:
        parser.error("no Chromium was found: install it, or set CHROMIUM to its path")
    with tempfile.TemporaryDirectory() as folder:
        port = free_port()
        command = [sys.executable, "-m", "tryon_server.cli", "serve", "--port", str(port), "--data-dir", folder]
        server = subprocess.Popen(command)
        try:
            url = f"http://127.0.0.1:{port}/"
            wait_for_server(url)
            with sync_playwright() as playwright, launch(playwright, chromium) as browser:
                tiles = [pictures(browser, url, options.garment, fabric) for fabric in options.fabrics]
                page = browser.new_page()
                told = {"tiles": tiles, "whole": WHOLE, "near": NEAR, "columns": min(COLUMNS, len(tiles))}
                options.out.write_bytes(base64.b64decode(page.evaluate(COMPOSE, told)))
        finally:
            server.terminate()
            server.wait()
    print(f"wrote {options.out}, {options.out.stat().st_size / 1000:.0f} kB")
    return 0


def wait_for_server(url: str) -> None:
    """Until it answers."""
    deadline = time.monotonic() + START_SECONDS
    while True:
        try:
            urlopen(f"{url}api/health", timeout=5).close()
            return
        except OSError:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.2)


def ask(url: str, method: str = "GET", told: dict[str, object] | None = None) -> dict[str, str]:
    """The server's answer."""
    body = None if told is None else json.dumps(told).encode()
    with urlopen(Request(url, body, {"Content-Type": "application/json"}, method=method)) as reply:
        content = reply.read()
    return json.loads(content) if content else {}


def pictures(browser: Browser, url: str, garment: str, fabric: str) -> dict[str, str]:
    """`far` and `close`, PNG in base64, of the garment in that fabric on the body as it stands."""
    begun = time.monotonic()
    wish = {"garment": garment, "fabric": fabric, "motion": None, "preset": "draft"}
    session = ask(f"{url}api/sessions", "POST", wish)["id"]
    while (told := ask(f"{url}api/sessions/{session}"))["state"] in ("preparing", "dressing"):
        assert time.monotonic() < begun + DRESS_SECONDS, told["detail"]
        time.sleep(0.5)
    page = open_page(browser, f"{url}?session={session}", *VIEW)
    page.wait_for_selector('#view[data-shown="figure"]')
    page.wait_for_function(MAPS_ARE_HERE)
    page.wait_for_timeout(4000)
    far = clipped(page, *WHOLE)
    box = page.locator("#stage").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    for _ in range(WHEEL):
        page.mouse.wheel(0, -1000)
        page.wait_for_timeout(300)
    page.wait_for_timeout(4000)
    close = clipped(page, NEAR, NEAR)
    page.context.close()
    ask(f"{url}api/sessions/{session}", "DELETE")
    print(f"{fabric}: {time.monotonic() - begun:.0f} s", flush=True)
    return {"name": fabric, "far": far, "close": close}


def clipped(page: Page, width: int, height: int) -> str:
    """A piece of what the stage shows around its middle, without what stands over it."""
    box = page.locator("#stage").bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2 - width / 2, box["y"] + box["height"] / 2 - height / 2
    style = ".top, .bar, .readout, .notice, .advice { visibility: hidden }"
    clip = {"x": x, "y": y, "width": width, "height": height}
    return base64.b64encode(page.screenshot(clip=clip, style=style)).decode()


if __name__ == "__main__":
    raise SystemExit(main())
