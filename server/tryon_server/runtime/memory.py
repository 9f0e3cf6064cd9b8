"""How much memory a process has taken.

A limit that the system enforces (RLIMIT_AS, RLIMIT_DATA) is no use to a simulation: drivers of GPUs reserve address
space by the terabyte, and an allocation that fails inside a kernel is told by no message. So it is looked at instead.
"""

from __future__ import annotations

import os
from pathlib import Path


def own_bytes(pid: int) -> int:
    """Resident memory that a process shares with no file [bytes]; 0 where the system does not tell, as after its end.

    From /proc/PID/statm of Linux (proc_pid_statm(5)): size, resident, shared, ... in pages.
    """
    try:
        fields = Path(f"/proc/{pid}/statm").read_text().split()
    except OSError:
        return 0
    return (int(fields[1]) - int(fields[2])) * os.sysconf("SC_PAGE_SIZE")
