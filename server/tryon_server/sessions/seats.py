"""Who a client is across lost connections, and whose poses move the body."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

RESUME_SECONDS = 15.0  # how long a seat waits for its client to come back after a lost connection


@dataclass
class Seat:
    """A client's place in the session. ``client`` is None while its connection is lost, since ``lost_at`` [s]."""

    token: str
    client: int | None
    lost_at: float = 0.0


class Seats:
    """The seats of a session. At most one of them holds the poses: two trackers must not fight over one body."""

    def __init__(self, new_token: Callable[[], str]) -> None:
        self._new_token = new_token
        self._by_token: dict[str, Seat] = {}
        self._by_client: dict[int, Seat] = {}
        self._pose_holder: Seat | None = None

    def sit(self, client: int, resume: str | None, now: float) -> tuple[str, int | None]:
        """Give ``client`` a seat: its old one when it presents that one's token.

        Returns the seat's token, and the number of the connection that had the seat until now, if it still stands.
        """
        self.expire(now)
        seat = self._by_token.get(resume) if resume else None
        replaced = None
        if seat is None:
            seat = Seat(self._new_token(), client)
            self._by_token[seat.token] = seat
        elif seat.client is not None:
            replaced = seat.client
            del self._by_client[replaced]
        seat.client = client
        self._by_client[client] = seat
        return seat.token, replaced

    def client_of(self, token: str | None) -> int | None:
        """The connection that has this seat; None: it is nobody's now, or there is none."""
        seat = self._by_token.get(token) if token else None
        return None if seat is None else seat.client

    def leave(self, client: int, now: float, for_good: bool) -> None:
        """A connection ended; unless the client left in good order, its seat is kept for ``RESUME_SECONDS``."""
        seat = self._by_client.pop(client, None)
        if seat is None:
            return
        seat.client, seat.lost_at = None, now
        if for_good:
            self._remove(seat)

    def may_pose(self, client: int, now: float) -> bool:
        """Whether the poses of ``client`` move the body; the first to send one holds that right until it leaves."""
        self.expire(now)
        if self._pose_holder is None:
            self._pose_holder = self._by_client[client]
        return self._pose_holder is self._by_client[client]

    def release_poses(self) -> None:
        """Let whoever sends the next pose move the body."""
        self._pose_holder = None

    def expire(self, now: float) -> None:
        """Give up seats whose clients did not come back."""
        for seat in list(self._by_token.values()):
            if seat.client is None and now - seat.lost_at >= RESUME_SECONDS:
                self._remove(seat)

    def _remove(self, seat: Seat) -> None:
        self._by_token.pop(seat.token, None)
        if self._pose_holder is seat:
            self._pose_holder = None
