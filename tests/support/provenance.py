"""What figures were made with: the commit and the machine, as tables say it.

Where no repository is, MEASURED_COMMIT in the environment names the commit; MEASURED_BESIDE says what else the machine
did meanwhile, in words.
"""

from __future__ import annotations

import os
import platform
import subprocess
from pathlib import Path


def commit_of(root: Path) -> str:
    """The commit that is checked out there, short, and whether tracked files differ from it; else what we were told."""

    def git(*words: str) -> str:
        answer = subprocess.run(["git", "-C", str(root), *words], capture_output=True, text=True, check=False)
        return answer.stdout.strip()

    changed = " with changes" if git("status", "--porcelain", "--untracked-files=no") else ""
    return (git("rev-parse", "--short=12", "HEAD") or os.environ.get("MEASURED_COMMIT", "unknown")) + changed


def machine_of(device: str) -> str:
    """This machine, the device that Warp runs on there, and what else it does if we were told."""
    if "cuda" in device:
        import warp as wp

        device += f", {wp.get_device(device).name}"
    beside = os.environ.get("MEASURED_BESIDE")
    return f"{platform.machine()}, {os.cpu_count()} processors, device {device}" + f", {beside}" * bool(beside)
