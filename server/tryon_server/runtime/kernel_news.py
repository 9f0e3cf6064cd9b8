"""Says what is going on while Warp compiles: its own lines on standard output, turned into progress."""

from __future__ import annotations

import contextlib
import io
import logging
import re
from collections.abc import Callable, Iterator

logger = logging.getLogger(__name__)

COMPILED = re.compile(r"^Module (?P<module>\S+) \S+ load on device '(?P<device>[^']*)' took .*\(compiled\)")


class _Reader(io.TextIOBase):
    """Takes what Warp prints, line by line."""

    def __init__(self, tell: Callable[[str], None]) -> None:
        self._tell = tell
        self._rest = ""
        self._compiled = 0

    def write(self, text: str) -> int:
        *lines, self._rest = (self._rest + text).split("\n")
        for line in lines:
            logger.debug("%s", line)
            match = COMPILED.match(line)
            if match:
                self._compiled += 1
                module = match["module"].rpartition(".")[2].replace("_", " ")
                self._tell(f"Compiling kernels, once per machine: {self._compiled} so far, the last one {module}")
        return len(text)


@contextlib.contextmanager
def kernel_news(tell: Callable[[str], None]) -> Iterator[None]:
    """While this lasts, ``tell`` hears of every module that Warp has compiled, and nothing of it is printed."""
    with contextlib.redirect_stdout(_Reader(tell)):
        yield
