"""The built page over HTTP: what a browser may keep, and what is shown before there is a page."""

from __future__ import annotations

import asyncio
from pathlib import Path

import httpx
import pytest
from fastapi import FastAPI

from tryon_server.api import page

ROOT = Path(__file__).parents[2]
FILES = {"index.html": "<p>page</p>", "licences.txt": "MIT", "assets/main-ABCD1234.js": "run()"}


@pytest.fixture
def folder(tmp_path):
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


def get(folder: Path, address: str, **headers: str) -> httpx.Response:
    app = FastAPI()
    page.install(app, folder)

    async def ask() -> httpx.Response:
        async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://page") as client:
            return await client.get(address, headers=headers)

    return asyncio.run(ask())


@pytest.mark.parametrize(
    ("address", "file"), [("/", "index.html"), ("/index.html", "index.html"), ("/licences.txt", "licences.txt")]
)
def test_what_keeps_its_name_is_asked_for_each_time(folder, address, file):
    reply = get(folder, address)
    assert reply.text == FILES[file]
    assert reply.headers["cache-control"] == "no-cache"


def test_what_carries_a_hash_in_its_name_is_kept(folder):
    reply = get(folder, "/assets/main-ABCD1234.js")
    assert reply.text == "run()"
    assert reply.headers["cache-control"] == "public, max-age=31536000, immutable"


def test_an_unchanged_page_is_not_sent_again_but_a_new_build_is(folder):
    known = {"If-None-Match": get(folder, "/").headers["etag"]}
    again = get(folder, "/", **known)
    assert (again.status_code, again.text) == (304, "")
    assert again.headers["cache-control"] == "no-cache"
    (folder / "index.html").write_text("<p>a new build</p>")
    assert get(folder, "/", **known).text == "<p>a new build</p>"


def test_without_a_build_the_page_names_a_command_that_makes_one(tmp_path):
    reply = get(tmp_path, "/")
    assert reply.status_code == 503
    assert reply.headers["cache-control"] == "no-store"
    assert "<code>make demo</code>" in reply.text
    assert "\ndemo: " in (ROOT / "Makefile").read_text()
