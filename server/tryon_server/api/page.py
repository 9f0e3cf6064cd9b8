"""The web page, as built into the folder ``web`` beside the server's code, or a page that says how to build it."""

from __future__ import annotations

import os
from pathlib import Path

from fastapi import FastAPI
from fastapi.responses import HTMLResponse, Response
from fastapi.staticfiles import StaticFiles
from starlette.types import Scope

WEB_FOLDER = Path(__file__).parent.parent / "web"
HASHED_FOLDER = "assets"  # the names in it carry a hash of the content (clients/web/build.mjs)
ASK_EACH_TIME = "no-cache"
KEEP_FOR_EVER = "public, max-age=31536000, immutable"

NOT_BUILT = """<!doctype html>
<html lang="en"><meta charset="utf-8"><title>tryon</title>
<body style="font: 16px/1.5 system-ui, sans-serif; max-width: 40rem; margin: 4rem auto; padding: 0 1rem">
<h1>The server runs, the page is not built</h1>
<p>Stop the server and run <code>make demo</code> in the folder of the source code: it builds the page (with Node 20.19
or newer) and starts the server again.</p>
<p>Programs need no page: the addresses are listed at <a href="/openapi.json">/openapi.json</a>.</p>
</body></html>
"""


class BuiltPage(StaticFiles):
    """The built files, each with how long a browser may keep it: a new build must show at the next reload."""

    def __init__(self, folder: Path) -> None:
        super().__init__(directory=folder, html=True)
        self._hashed = (folder / HASHED_FOLDER).resolve()

    def file_response(
        self, full_path: str | os.PathLike[str], stat_result: os.stat_result, scope: Scope, status_code: int = 200
    ) -> Response:
        """The file, or 304 when the browser has it as it is."""
        response = super().file_response(full_path, stat_result, scope, status_code)
        hashed = Path(full_path).resolve().is_relative_to(self._hashed)
        response.headers["Cache-Control"] = KEEP_FOR_EVER if hashed else ASK_EACH_TIME
        return response


def install(app: FastAPI, folder: Path = WEB_FOLDER) -> None:
    """Serve the page at ``/``. To be called after every other route, because it answers every address left."""
    if (folder / "index.html").is_file():
        app.mount("/", BuiltPage(folder), name="page")
    else:
        app.add_api_route("/", _not_built, include_in_schema=False)


async def _not_built() -> HTMLResponse:
    return HTMLResponse(NOT_BUILT, status_code=503, headers={"Cache-Control": "no-store"})
