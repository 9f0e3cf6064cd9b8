"""What a session remembers of one connection."""

from __future__ import annotations

from tryon_protocol import ClientMessage
from tryon_server.sessions.complaints import Complaints
from tryon_server.sessions.line import Line
from tryon_server.sessions.pose_stream import PoseStream
from tryon_server.sessions.rate import TokenBucket

BURST_SECONDS = 1.0  # a client may send this much of its rate at once
FLOOD_RATE = 500.0  # messages per second that close the connection when they keep coming
FLOOD_BURST = 1000.0


class Viewer:
    """One connection.

    Attributes:
        joined: when it was made [s].
        greeted: whether its hello was answered.
        takes_zstd: whether it can inflate zstd.
        poses: what its poses need remembered.
        line: what it sent and was not carried out yet.
        complaints: what it did wrong, and how often it is told.
    """

    def __init__(self, joined: float, messages_per_second: float, poses: PoseStream) -> None:
        self.joined = joined
        self.greeted = False
        self.takes_zstd = True
        self.poses = poses
        self.line = Line()
        self.complaints = Complaints()
        self._flood = TokenBucket(FLOOD_RATE, FLOOD_BURST, joined)
        self._bucket = TokenBucket(messages_per_second, max(1.0, messages_per_second * BURST_SECONDS), joined)

    def next(self, now: float) -> ClientMessage | None:
        """The message whose turn it is within the rate that the session allows; None: there is none, or not yet."""
        return self.line.take() if self.line and self._bucket.take(now) else None

    def floods(self, now: float) -> bool:
        """Count one message; whether the client sends far more than any client has reason to."""
        return not self._flood.take(now)
