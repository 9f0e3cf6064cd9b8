"""How much memory a process has taken, with those that it has started.

A limit that the system enforces (RLIMIT_AS, RLIMIT_DATA) is no use to a simulation: drivers of GPUs reserve address
space by the terabyte, and an allocation that fails inside a kernel is told by no message. So it is looked at instead.
"""

from __future__ import annotations

import os
from pathlib import Path


def own_bytes(pid: int) -> int:
    """Resident memory that a process and its children share with no file [bytes]; 0 where the system does not tell, as
    after its end.

    From /proc/PID/statm of Linux (proc_pid_statm(5)): size, resident, shared, ... in pages; children by
    proc_tid_children(5).
    """
    try:
        fields = Path(f"/proc/{pid}/statm").read_text().split()
        lists = [thread.read_text() for thread in Path(f"/proc/{pid}/task").glob("*/children")]
    except OSError:
        return 0
    own = (int(fields[1]) - int(fields[2])) * os.sysconf("SC_PAGE_SIZE")
    return own + sum(own_bytes(int(child)) for child in " ".join(lists).split())
