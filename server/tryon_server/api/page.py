"""The web page, as built into the folder ``web`` beside the server's code, or a page that says how to build it."""

from __future__ import annotations

from pathlib import Path

from fastapi import FastAPI
from fastapi.responses import HTMLResponse
from fastapi.staticfiles import StaticFiles

WEB_FOLDER = Path(__file__).parent.parent / "web"

NOT_BUILT = """<!doctype html>
<html lang="en"><meta charset="utf-8"><title>tryon</title>
<body style="font: 16px/1.5 system-ui, sans-serif; max-width: 40rem; margin: 4rem auto; padding: 0 1rem">
<h1>The server runs, the page is not built</h1>
<p>Build it with <code>make web</code> in the folder of the source code (it needs Node 20 or newer), then reload.</p>
<p>Programs need no page: the addresses are listed at <a href="/openapi.json">/openapi.json</a>.</p>
</body></html>
"""


def install(app: FastAPI, folder: Path = WEB_FOLDER) -> None:
    """Serve the page at ``/``. To be called after every other route, because it answers every address left."""
    if (folder / "index.html").is_file():
        app.mount("/", StaticFiles(directory=folder, html=True), name="page")
    else:
        app.add_api_route("/", _not_built, include_in_schema=False)


async def _not_built() -> HTMLResponse:
    return HTMLResponse(NOT_BUILT, status_code=503)
