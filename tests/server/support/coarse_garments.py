"""The solver's drapes in a mesh of few triangles, whichever garments are ordered."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from fastapi import FastAPI

from tryon_server.app import create_app
from tryon_server.runtime import production
from tryon_server.runtime.interface import Runtime
from tryon_server.runtime.local import local_runtime
from tryon_server.runtime.local_processes import LocalProcesses
from tryon_server.runtime.order import Workshop
from tryon_server.settings import Settings

EDGE_LENGTH = 0.06  # m


def build(order, progress):
    return production.build_drape(replace(order, edge_length=EDGE_LENGTH), progress)


def runtime(settings: Settings) -> Runtime:
    workshop = replace(Workshop(), build="coarse_garments:build")
    return replace(local_runtime(settings), placement=LocalProcesses(workshop, settings.session_memory_bytes))


def make_app(folder: Path) -> FastAPI:
    """An application with the demo's garments, whose data lie in `folder`."""
    return create_app(Settings(data_dir=folder, warm=False, preset="draft", device="cpu"), runtime)
