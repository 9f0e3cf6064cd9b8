"""Progress on a terminal: one bar per stage."""

from __future__ import annotations

import sys
from types import TracebackType

from tqdm import tqdm

FORMAT = "{desc:<48} {percentage:3.0f}% |{bar}| {elapsed}<{remaining}"

TERMINAL_SECONDS = 0.1  # between drawings of the bar
FILE_SECONDS = 2.0  # the same, when nobody looks and every drawing is a line of a log


class ProgressBar:
    """Shows what is being done and how much of it; stages of unknown length as a line of text."""

    def __init__(self) -> None:
        self._stage = ""
        self._bar: tqdm[None] | None = None
        self._interval = TERMINAL_SECONDS if sys.stderr.isatty() else FILE_SECONDS

    def __enter__(self) -> ProgressBar:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._close(finished=kind is None)

    def show(self, stage: str, share: float | None) -> None:
        """``stage`` is being done, the ``share`` 0 to 1 of it is done if known."""
        if share is None or (share >= 1.0 and stage != self._stage):
            self._close(finished=True)
            self._stage = stage
            tqdm.write(stage, file=sys.stderr)
            return
        if stage != self._stage or self._bar is None:
            self._close(finished=True)
            self._stage = stage
            self._bar = tqdm(total=1.0, desc=stage, bar_format=FORMAT, file=sys.stderr, mininterval=self._interval)
        self._bar.update(share - self._bar.n)

    def _close(self, finished: bool) -> None:
        if self._bar is not None:
            if finished:
                self._bar.update(1.0 - self._bar.n)
            self._bar.close()
            self._bar = None
