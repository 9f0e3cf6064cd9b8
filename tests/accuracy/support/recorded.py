"""What has been measured, as it comes: a file of one JSON object a line, so that a run that is cut off can go on.

The first line says of what the rows are; then the rows follow, in order of the states or methods that they are of.
"""

from __future__ import annotations

import fcntl
import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass
class Recorded:
    """A file's first line and its rows."""

    path: Path
    head: Mapping[str, Any]
    rows: list[dict[str, Any]]

    @property
    def key(self) -> str:
        """Of the file."""
        return self.path.stem


class TwiceError(ValueError):
    """A file is written by another process, or was by two at once: some rows of it are there twice."""


def read(path: Path) -> Recorded | None:
    """None where there is no whole first line; a last line that was cut off is left out. Raises TwiceError."""
    if not path.exists():
        return None
    lines = path.read_text().split("\n")[:-1]  # what follows the last line's end was cut off
    if not lines:
        return None
    rows = [json.loads(line) for line in lines[1:]]
    counts = Counter((row["state"], row["method"]) for row in rows if "state" in row)
    twice = [of for of, count in counts.items() if count > 1]
    if twice:
        state, method = twice[0]
        raise TwiceError(f"{path} has {len(twice)} rows twice, the first {method!r} of state {state}: measure it anew")
    return Recorded(path, json.loads(lines[0]), rows)


def read_all(folder: Path) -> list[Recorded]:
    """All files of a folder, by name."""
    found = [read(path) for path in sorted(folder.glob("*.jsonl"))]
    return [recorded for recorded in found if recorded is not None]


class Writer:
    """Goes on with a file whose first line is the same, but for `about`; begins it anew otherwise."""

    def __init__(self, path: Path, head: Mapping[str, Any]) -> None:
        """Raises TwiceError while another process writes the same file."""
        self.path = path
        self.rows: list[dict[str, Any]] = []
        path.parent.mkdir(parents=True, exist_ok=True)
        self._held = path.with_suffix(".lock").open("w")
        try:
            fcntl.flock(self._held, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            what = f"{path} is being written by another process: wait for it, or name another --out"
            raise TwiceError(what) from None
        old = read(path)
        if old is not None and without_about(old.head) == without_about(json.loads(json.dumps(head))):
            head, self.rows = old.head, old.rows
        unfinished = path.with_suffix(".tmp")
        unfinished.write_text("".join(f"{json.dumps(line)}\n" for line in (head, *self.rows)))
        unfinished.replace(path)

    def add(self, rows: Sequence[Mapping[str, Any]]) -> None:
        """Written at once, together."""
        self.rows += map(dict, rows)
        with self.path.open("a") as out:
            out.write("".join(f"{json.dumps(row)}\n" for row in rows))

    def drop(self, state: int) -> None:
        """Forget rows of this state: not all of them were written."""
        kept = [row for row in self.rows if row.get("state") != state]
        if len(kept) < len(self.rows):
            self.rows = kept
            head = self.path.read_text().split("\n", 1)[0]
            self.path.write_text("".join([f"{head}\n", *(f"{json.dumps(row)}\n" for row in kept)]))


def without_about(head: Mapping[str, Any]) -> dict[str, Any]:
    """All that has to be the same for rows to belong together."""
    return {name: value for name, value in head.items() if name != "about"}
