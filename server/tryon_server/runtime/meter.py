"""How fast the simulation runs, over the last seconds."""

from __future__ import annotations

from collections import deque

WINDOW_SECONDS = 2.0


class Meter:
    """Counts published frames, and simulated against wall time. Times in s; time spent held or idle is left out."""

    def __init__(self) -> None:
        self._moves: deque[tuple[float, float, float]] = deque()  # when, wall time and simulated time of a move
        self._frames: deque[float] = deque()

    def moved(self, now: float, wall: float, simulated: float) -> None:
        """A move of ``simulated`` s took ``wall`` s since the one before."""
        self._moves.append((now, wall, simulated))
        while now - self._moves[0][0] > WINDOW_SECONDS:
            self._moves.popleft()

    def published(self, now: float) -> None:
        """A frame was handed over."""
        self._frames.append(now)
        while now - self._frames[0] > WINDOW_SECONDS:
            self._frames.popleft()

    @property
    def real_time_factor(self) -> float:
        """Simulated seconds per wall second."""
        wall = sum(move[1] for move in self._moves)
        return sum(move[2] for move in self._moves) / wall if wall > 0 else 0.0

    def frames_per_second(self, now: float) -> float:
        """Frames handed over per second, over the last seconds or as long as frames have been flowing."""
        recent = [when for when in self._frames if now - when <= WINDOW_SECONDS]
        return (len(recent) - 1) / (recent[-1] - recent[0]) if len(recent) > 1 and recent[-1] > recent[0] else 0.0
