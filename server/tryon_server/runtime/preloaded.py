"""What the process of a simulation has from its beginning: imported once, in the one that all of them are forked from.

`fork_server.py` names this module, and nothing else imports it. What it holds is one copy in memory for all, as long as
nobody writes.
"""

from __future__ import annotations

import gc
import signal

import tryon_server.runtime.arming
import tryon_server.runtime.beside
import tryon_server.runtime.kernel_news
import tryon_server.runtime.motions
import tryon_server.runtime.production
import tryon_server.runtime.worker  # noqa: F401

signal.signal(signal.SIGTERM, signal.SIG_IGN)  # service managers tell all processes; it ends when the server has
gc.collect()
gc.freeze()  # a process that looks through it for garbage would have to copy it
