"""What one viewer of a shared stream may be sent now: credit and bases. No sockets, no clock. PROTOCOL.md section 9."""

from __future__ import annotations

from typing import Literal

from .errors import ProtocolError
from .frames import EncodedFrame

CREDIT = 2
"""Frames that travel unacknowledged. Measured on a slow link: 2 keeps the full rate at a twentieth of the lag."""


class ViewerWindow:
    """Keeps the books of one viewer: which frames it was sent, and which of them it has decoded."""

    def __init__(self, credit: int = CREDIT) -> None:
        self.credit = credit
        self._unacknowledged: list[int] = []
        self._newest = 0
        self._held: tuple[int, ...] = ()

    @property
    def may_send(self) -> bool:
        """False while `credit` frames are unacknowledged: the viewer misses this frame."""
        return len(self._unacknowledged) < self.credit

    def form_for(self, frame: EncodedFrame) -> Literal["shared", "standalone"]:
        """Whether the viewer holds what the shared frame needs, or must get `FrameEncoder.standalone()` instead."""
        return "shared" if frame.stands_alone or self._held[: len(frame.needs)] == frame.needs else "standalone"

    def sent(self, frame: EncodedFrame) -> None:
        """Note that this frame, shared or standalone, was handed to the connection."""
        self._unacknowledged.append(frame.seq)
        self._held = (frame.seq,) if frame.stands_alone else (frame.seq, frame.needs[0])
        self._newest = frame.seq

    def lost(self) -> None:
        """The viewer asked for a keyframe: what it was sent can't serve as a base and will not be acknowledged."""
        self._held = ()
        self._unacknowledged = []

    def acknowledge(self, seq: int) -> None:
        """The viewer has decoded frame `seq` and all it got before; 0 says nothing.

        Raises:
            ProtocolError: code "invalid_ack" for a frame that was never sent.
        """
        if seq > self._newest:
            raise ProtocolError(
                "invalid_ack",
                "$.ack",
                f"Frame {seq} is acknowledged, the newest one sent is {self._newest}.",
                "Acknowledge the seq of the newest frame that was decoded.",
            )
        self._unacknowledged = [sent for sent in self._unacknowledged if sent > seq]
