"""Simulations are forked from a process that has imported what they need, and neither threads of ours nor a GPU."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from killable_server import KillableServer

from tryon_server.runtime.fork_server import PRELOADED

ENDS = 20.0  # s

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="processes are looked up in /proc")


def members(group):
    """Processes of that group: their numbers, each with its command and its parent's number."""
    found = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            after = (folder / "stat").read_text().rpartition(")")[2].split()  # state, parent, group, ...
            if after[0] != "Z" and int(after[2]) == group:
                found[int(folder.name)] = (folder / "cmdline").read_text(), int(after[1])
        except OSError:  # it has ended meanwhile
            continue
    return found


@pytest.fixture
def server(tmp_path):
    with KillableServer(tmp_path, "live_server:make_app") as server:
        yield server


def test_what_is_imported_beforehand_begins_nothing():
    """A library of Warp's or of a GPU's driver that were loaded would be shared by all that are forked."""
    asked = f"import {PRELOADED}; import sys, threading; maps = open('/proc/self/maps').read()"
    told = "print('warp' in sys.modules, threading.active_count(), 'libcuda' in maps, 'warp.so' in maps)"
    ran = subprocess.run([sys.executable, "-c", f"{asked}; {told}"], capture_output=True, text=True, check=True)
    assert ran.stdout.split() == ["True", "1", "False", "False"]


def test_sessions_are_forked_from_one_process_which_is_the_server_s(server):
    for _ in range(2):
        server.dressed(server.open(garment="tube", motion="sway"))
    running = members(server.pid)
    begun = [pid for pid, (_, parent) in running.items() if parent == server.pid and "forkserver" in running[pid][0]]
    assert len(begun) == 1
    assert sum(parent == begun[0] for _, parent in running.values()) == 2
    assert "scipy" in Path(f"/proc/{begun[0]}/maps").read_text()  # it has imported what it was to


def test_nothing_outlives_a_server_that_was_killed(server):
    server.dressed(server.open(garment="tube", motion="sway"))
    assert len(members(server.pid)) > 2
    os.kill(server.pid, signal.SIGKILL)
    end = time.monotonic() + ENDS
    while left := members(server.pid):
        assert time.monotonic() < end, left
        time.sleep(0.05)
