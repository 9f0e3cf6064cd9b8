"""What holds for every session of a server."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from tryon_protocol import CREDIT, ProtocolError
from tryon_server.sessions.smoothing import DEFAULT_SMOOTHING, Smoothing


@dataclass(frozen=True)
class Rules:
    """What holds for every session of a server.

    Attributes:
        epoch: word that changes when the server restarts.
        server: name and version of the server, for the clients' logs.
        motions: names of the motions that the server can play.
        fabrics: names of the fabrics.
        credit: most frames that travel unacknowledged to one client.
        max_viewers: most connections of one session.
        messages_per_second: most messages per second from one client, on average.
        grace_seconds: how long a session lives on without a connection, and without being asked for [s].
        smoothing: settings of the filter between a tracker and the physics.
    """

    epoch: str
    server: str
    motions: tuple[str, ...]
    fabrics: tuple[str, ...]
    credit: int = CREDIT
    max_viewers: int = 16
    messages_per_second: float = 240.0
    grace_seconds: float = 60.0
    smoothing: Smoothing = DEFAULT_SMOOTHING


def unknown(code: str, kind: str, name: str, known: Sequence[str]) -> ProtocolError:
    """The fault of a name that is none of those known."""
    return ProtocolError(code, f"$.{kind}", f"There is no {kind} {name!r}.", f"Choose one of: {', '.join(known)}.")
