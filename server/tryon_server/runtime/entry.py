"""Where the process of a simulation begins. Light to import: the server starts it without the solver."""

from __future__ import annotations

import gc
import signal
import time
from contextlib import closing
from importlib import import_module
from multiprocessing.connection import Connection
from typing import Any

from tryon_server.runtime.order import WorkOrder, Workshop


def run(connection: Connection, order: WorkOrder, workshop: Workshop) -> None:
    """Simulate ``order`` until the other end of ``connection`` closes."""
    from tryon_server.runtime.arming import Armoury
    from tryon_server.runtime.beside import ProcessBeside
    from tryon_server.runtime.kernel_news import kernel_news
    from tryon_server.runtime.worker import Worker

    for number in (signal.SIGINT, signal.SIGTERM):  # Ctrl-C and service managers tell the server and all its processes;
        signal.signal(number, signal.SIG_IGN)  # the server says goodbye to its clients and then ends its simulations
    try:
        beside, compiler = ProcessBeside(), ProcessBeside()
        build, load_motion = find(workshop.build), find(workshop.load_motion)
        armoury = Armoury(compiler, order.drape.device, find(workshop.compile_effects))
        worker = Worker(connection, order, build, load_motion, time.monotonic, beside, armoury)
        gc.collect()
        gc.freeze()  # what is loaded stays: looking through it for garbage would hold up a frame by half a second
        with closing(beside), closing(compiler), kernel_news(worker.say):
            worker.run()
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return  # the server let go


def find(name: str) -> Any:
    """The function ``"module:function"``."""
    module, _, function = name.partition(":")
    return getattr(import_module(module), function)
