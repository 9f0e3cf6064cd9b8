"""The analytic drape, which is not dressed for as long as there is a file "held" beside the patterns of the demo."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import analytic_drape
import live_server
from fastapi import FastAPI

from tryon_server.runtime.interface import Runtime
from tryon_server.runtime.local_processes import LocalProcesses
from tryon_server.runtime.order import Workshop
from tryon_server.settings import Settings


def build(order, progress):
    held = Path(order.wardrobe).parents[1] / "held"
    while held.exists():
        progress("Sewing", 0.5)
        time.sleep(0.02)
    return analytic_drape.build(order, progress)


def runtime(settings: Settings) -> Runtime:
    workshop = Workshop("held_dressing:build", "analytic_drape:load_motion", "pretended_effects:Compiled")
    placement = LocalProcesses(workshop, settings.session_memory_bytes)
    return replace(live_server.analytic_runtime(settings), placement=placement)


def make_app(folder: Path) -> FastAPI:
    return live_server.make_app(folder, runtime)


def make_app_of_short_edits(folder: Path) -> FastAPI:
    return live_server.make_app(folder, runtime, edit_seconds=2.0)
