"""What figures were made with: the commit and the machine, as tables say it."""

from __future__ import annotations

import os
import platform
import subprocess
from pathlib import Path


def commit_of(root: Path) -> str:
    """The commit that is checked out there, short, and whether tracked files differ from it."""

    def git(*words: str) -> str:
        answer = subprocess.run(["git", "-C", str(root), *words], capture_output=True, text=True, check=False)
        return answer.stdout.strip()

    changed = " with changes" if git("status", "--porcelain", "--untracked-files=no") else ""
    return (git("rev-parse", "--short=12", "HEAD") or "unknown") + changed


def machine_of(device: str) -> str:
    """This machine, and the device that Warp runs on there."""
    if "cuda" in device:
        import warp as wp

        device += f", {wp.get_device(device).name}"
    return f"{platform.machine()}, {os.cpu_count()} processors, device {device}"
