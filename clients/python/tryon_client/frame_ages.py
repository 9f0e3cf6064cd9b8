"""How old frames are when they are there: percentiles of what a headset would show."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tryon_protocol import DecodedFrame, PongMessage

PERCENTILES = (50, 95, 99, 100)


@dataclass(frozen=True)
class Ages:
    """Percentiles `PERCENTILES` of one age [s]; NaN without a frame."""

    name: str
    values: tuple[float, ...]

    def line(self) -> str:
        """One row of a table, in milliseconds."""
        return f"{self.name:<34}" + "".join(f"{1e3 * value:8.1f}" for value in self.values)


class FrameAges:
    """Collects frames as they are decoded. ``count_from`` [s, own clock]: what comes earlier only warms up."""

    def __init__(self, count_from: float) -> None:
        self._count_from = count_from
        self._captured: list[float] = []
        self._published: list[tuple[float, float]] = []
        self._arrived: list[float] = []
        self._offsets: list[tuple[float, float]] = []

    def pong(self, message: PongMessage, now: float) -> None:
        """An answer of the server: of the shortest round trip the clocks' difference is taken."""
        self._offsets.append((now - message.t, message.clock - 0.5 * (message.t + now)))

    def frame(self, frame: DecodedFrame, now: float) -> None:
        """A frame has been decoded. Frames that follow no pose of ours have no age."""
        if now < self._count_from or frame.pose_seq == 0:
            return
        self._captured.append(now - frame.t_sim)
        self._published.append((now, frame.t_published))
        self._arrived.append(now)

    @property
    def count(self) -> int:
        """Frames counted."""
        return len(self._arrived)

    def rate(self) -> float:
        """Frames per second; 0 with fewer than two."""
        if len(self._arrived) < 2:
            return 0.0
        return (len(self._arrived) - 1) / (self._arrived[-1] - self._arrived[0])

    def since_capture(self) -> Ages:
        """From the moment that the frame shows, on the tracker's clock, to the decoded frame."""
        return Ages("capture to decoded frame", _percentiles(self._captured))

    def since_publishing(self) -> Ages:
        """From the server's publishing to the decoded frame."""
        offset = min(self._offsets)[1] if self._offsets else np.nan
        return Ages("published to decoded frame", _percentiles([now + offset - sent for now, sent in self._published]))

    def between(self) -> Ages:
        """Between one frame and the next."""
        return Ages("frame to frame", _percentiles(np.diff(self._arrived).tolist()))

    def table(self) -> str:
        """All of it."""
        head = f"{'age [ms]':<34}" + "".join(f"{f'p{p}' if p < 100 else 'max':>8}" for p in PERCENTILES)
        return "\n".join(
            [head, *(ages.line() for ages in (self.since_capture(), self.since_publishing(), self.between()))]
        )


def _percentiles(values: list[float]) -> tuple[float, ...]:
    if not values:
        return (np.nan,) * len(PERCENTILES)
    return tuple(float(value) for value in np.percentile(values, PERCENTILES))
