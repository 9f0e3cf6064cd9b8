"""Starts as a table in Markdown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any


def section(starts: Sequence[Mapping[str, Any]]) -> list[str]:
    """A table's lines."""
    columns = "| case | kernels | imported [s] | of kernels [s] | worn [s] | first frame [s] |"
    return [columns, "|---|---|---|---|---|---|", *(row(start) for start in starts)]


def row(start: Mapping[str, Any]) -> str:
    """One line."""
    if "failure" in start:
        return f"| {start['name']} | {start['kernels']} | – | – | – | FAILED: {start['failure']} |"
    times = (f"{start[key]:.1f}" for key in ("imported_s", "kernels_s", "worn_s", "first_frame_s"))
    return f"| {start['name']} | {start['kernels']} | {' | '.join(times)} |"
