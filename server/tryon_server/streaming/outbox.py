"""What waits to be sent to one client: bounded, in order, no stale frame before one that stands alone."""

from __future__ import annotations

import asyncio
from collections import deque
from dataclasses import dataclass

CONTROL_MESSAGES_MAX = 256
CONTROL_BYTES_MAX = 64 * 2**20  # a few topologies of the largest garments


class OutboxFullError(Exception):
    """The client does not read: control messages, which are never dropped, have piled up to the cap. It must go."""


@dataclass(frozen=True)
class Closing:
    """The last thing in an outbox: close with this code and reason."""

    code: int
    reason: str


@dataclass(frozen=True)
class _Control:
    payload: bytes
    replaces: str


@dataclass(frozen=True)
class _Frame:
    payload: bytes


class Outbox:
    """One client's outgoing buffer. To be used from one event loop only.

    Attributes:
        closing: set as soon as the connection is to be closed.
    """

    def __init__(self) -> None:
        self._entries: deque[_Control | _Frame | Closing] = deque()
        self._control_count = 0
        self._control_bytes = 0
        self._filled = asyncio.Event()
        self.closing = asyncio.Event()

    def put_control(self, payload: bytes, replaces: str = "") -> None:
        """Queue a message that must arrive. An unsent one with the same non-empty ``replaces`` gives way to it.

        Raises:
            OutboxFullError: as many messages, or as many bytes, wait as may wait.
        """
        if self.closing.is_set():
            return
        if replaces:
            for entry in [old for old in self._entries if isinstance(old, _Control) and old.replaces == replaces]:
                self._entries.remove(entry)
                self._count(entry, -1)
        if self._control_count >= CONTROL_MESSAGES_MAX or self._control_bytes + len(payload) > CONTROL_BYTES_MAX:
            raise OutboxFullError(f"{self._control_count} messages of {self._control_bytes} bytes wait unread")
        entry = _Control(payload, replaces)
        self._count(entry, 1)
        self._append(entry)

    def put_frame(self, payload: bytes, stands_alone: bool) -> None:
        """Queue a frame; one that stands alone takes the place of those that were not sent yet."""
        if self.closing.is_set():
            return
        if stands_alone:
            self._entries = deque(entry for entry in self._entries if not isinstance(entry, _Frame))
        self._append(_Frame(payload))

    def close(self, code: int, reason: str) -> None:
        """Close the connection after what is queued by now; nothing is queued after that."""
        if not self.closing.is_set():
            self.closing.set()
            self._append(Closing(code, reason))

    def overflow(self, code: int, reason: str) -> None:
        """Forget what is queued, since the client reads nothing of it, and close the connection."""
        self._entries.clear()
        self.closing.set()
        self._append(Closing(code, reason))

    async def take(self) -> bytes | Closing:
        """Wait for the next thing to send."""
        while not self._entries:
            self._filled.clear()
            await self._filled.wait()
        entry = self._entries.popleft()
        if isinstance(entry, _Control):
            self._count(entry, -1)
        return entry if isinstance(entry, Closing) else entry.payload

    def _count(self, entry: _Control, sign: int) -> None:
        self._control_count += sign
        self._control_bytes += sign * len(entry.payload)

    def _append(self, entry: _Control | _Frame | Closing) -> None:
        self._entries.append(entry)
        self._filled.set()
