"""Memory that a process has freed goes back to the system."""

import os
import platform

import numpy as np
import pytest

from tryon_server.runtime.memory import own_bytes
from tryon_solver.linalg.freed import give_back_freed


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only GNU's C library can be told to")
def test_what_was_freed_below_what_is_in_use_goes_back():
    """Pieces too small to be mapped by themselves, and one above them that is kept."""
    pieces = [np.ones(8000) for _ in range(800)]  # 64 kB each
    kept = [np.ones(8000) for _ in range(8)]
    full = own_bytes(os.getpid())
    del pieces
    give_back_freed()
    assert own_bytes(os.getpid()) < full - 40e6
    assert all(piece.sum() == 8000 for piece in kept)
