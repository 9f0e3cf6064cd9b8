"""What a session remembers of one connection."""

from __future__ import annotations

from tryon_server.sessions.complaints import Complaints
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
        complaints: what it did wrong, and how often it is told.
    """

    def __init__(self, joined: float, messages_per_second: float, poses: PoseStream) -> None:
        self.joined = joined
        self.greeted = False
        self.takes_zstd = True
        self.poses = poses
        self.complaints = Complaints()
        self._flood = TokenBucket(FLOOD_RATE, FLOOD_BURST, joined)
        self._bucket = TokenBucket(messages_per_second, messages_per_second * BURST_SECONDS, joined)

    def within_rate(self, now: float) -> bool:
        """Count one message; whether it is within the rate that the session allows."""
        return self._bucket.take(now)

    def floods(self, now: float) -> bool:
        """Count one message; whether the client sends far more than any client has reason to."""
        return not self._flood.take(now)
