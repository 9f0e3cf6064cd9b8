"""Memory that was freed, handed back to the system: what a process has taken is what it needs."""

from __future__ import annotations

import ctypes

TRIM = getattr(ctypes.CDLL(None), "malloc_trim", None)


def give_back_freed() -> None:
    """Hand back to the system what this process has freed, where its C library is GNU's (malloc_trim(3)).

    That keeps what lies below anything still in use: a simulation built while another one stands leaves a hole of its
    own size behind, and what a thread has freed stays with the thread. A process that builds many would take more and
    more. Other threads go on meanwhile; it takes a few milliseconds.
    """
    if TRIM is not None:
        TRIM(ctypes.c_size_t(0))
