"""The process from which those of simulations are forked: multiprocessing's fork server, light to import.

A process that begins anew takes one or two seconds for its imports, and one forked from the server itself would
inherit its threads and whatever it has of a GPU. This one has neither; it has imported `preloaded.py`, and ends with
the server.
"""

from __future__ import annotations

import multiprocessing
from multiprocessing import forkserver
from multiprocessing.context import ForkServerContext

PRELOADED = "tryon_server.runtime.preloaded"


def started() -> ForkServerContext:
    """What begins processes so; it is begun itself, unless it runs, and imports beside who asks."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([PRELOADED])
    forkserver.ensure_running()
    return context
