"""Several processes that begin what they measure at once, and keep each other company to the end: by files."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

LONGEST_WAIT = 1800.0  # s, for the others to be dressed
FAILED = "failed"


@dataclass(frozen=True)
class Company:
    """`count` processes that meet in `folder`; this is the one of that `number`."""

    folder: Path
    count: int
    number: int

    @contextlib.contextmanager
    def kept(self) -> Iterator[None]:
        """Who fails here says so, and nobody waits for it."""
        try:
            yield
        except BaseException:
            self.pass_by(FAILED)
            raise

    def meet(self, where: str) -> None:
        """Wait until all have come to the place of that name. Raises TimeoutError when somebody does not come."""
        self.pass_by(where)
        begun = time.monotonic()
        while not self.all_at(where):
            if time.monotonic() - begun > LONGEST_WAIT:
                raise TimeoutError(f"not all of {self.count} sessions came to {where!r} in {LONGEST_WAIT:.0f} s")
            time.sleep(0.005)

    def pass_by(self, where: str) -> None:
        """Be at the place, without waiting."""
        (self.folder / f"{where}.{self.number}").touch()

    def all_at(self, where: str) -> bool:
        """Have all come there? Raises RuntimeError when one has failed."""
        if any(self.folder.glob(f"{FAILED}.*")):
            raise RuntimeError("another session of this case failed: see its log")
        return len(list(self.folder.glob(f"{where}.*"))) >= self.count
