"""Tasks for a process beside: by name, so that they can travel there."""

import os
import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from tryon_server.problems import problem_error


def double(number):
    return 2 * number


def length(data):
    return len(data)


def refuse():
    raise problem_error("pattern.invalid", "it is crooked", "Draw it straight", place="panels.front")


def fail():
    raise RuntimeError("a screw is loose")


def die():
    os._exit(3)


def wait(path):
    """Writes the number of the process into this file and then does nothing for a long while."""
    path.write_text(str(os.getpid()))
    time.sleep(600.0)


def hoard(size):
    kept = bytearray(b"x") * size
    time.sleep(600.0)
    return len(kept)


@dataclass(frozen=True)
class Counting:
    """Tells each number up to its own, of which it takes the `share`; waits for `go_on`, a file, before its end."""

    last: int
    go_on: Path

    def telling(self, tell):
        return partial(self._count, tell)

    def __call__(self):
        return self._count(lambda _stage, _share: None)

    def _count(self, tell):
        for k in range(1, self.last + 1):
            tell(f"number {k}", k / self.last)
        while not self.go_on.exists():
            time.sleep(0.01)
        return self.last
