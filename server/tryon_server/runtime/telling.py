"""What a session's worker tells the server."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from multiprocessing.connection import Connection

from tryon_server.sessions.events import Event

PROGRESS_SECONDS = 0.2  # between tellings of the same stage's progress


class Teller:
    """Events in the order in which they happened, but that frames overtake what takes a while to put into words."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._owed: deque[Callable[[], Event]] = deque()

    def tell(self, event: Event) -> None:
        """Tell this, after all that is owed."""
        self.catch_up()
        self._connection.send(event)

    def show(self, frame: Event) -> None:
        """Tell this frame, before what is owed."""
        self._connection.send(frame)

    def owe(self, make: Callable[[], Event]) -> None:
        """Tell what this makes after the next frame, or when there is nothing else to do."""
        self._owed.append(make)

    def catch_up(self) -> None:
        """Tell all that is owed."""
        while self._owed:
            self._connection.send(self._owed.popleft()())


class NowAndThen:
    """Passes on which stage is under way, and how much of it is done, now and then."""

    def __init__(self, tell: Callable[[str, float | None], None], clock: Callable[[], float]) -> None:
        self._tell, self._clock = tell, clock
        self._told = ("", -math.inf)  # stage, and when [s]

    def __call__(self, stage: str, share: float | None) -> None:
        """So much of it is done; None where that is not known."""
        now = self._clock()
        if stage == self._told[0] and now - self._told[1] < PROGRESS_SECONDS:
            return
        self._told = (stage, now)
        self._tell(stage, share)
