"""Where the process of a simulation begins. Light to import: the server starts it without the solver."""

from __future__ import annotations

from importlib import import_module
from multiprocessing.connection import Connection
from typing import Any

from tryon_server.runtime.order import WorkOrder, Workshop


def run(connection: Connection, order: WorkOrder, workshop: Workshop) -> None:
    """Simulate ``order`` until the other end of ``connection`` closes."""
    from tryon_server.runtime.worker import run_worker

    run_worker(connection, order, find(workshop.build), find(workshop.load_motion))


def find(name: str) -> Any:
    """The function ``"module:function"``."""
    module, _, function = name.partition(":")
    return getattr(import_module(module), function)
