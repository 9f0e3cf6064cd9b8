"""What a session asks its surroundings to do."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from tryon_protocol import EffectsMessage, OutfitWish, ProtocolError
from tryon_server.sessions.commands import ChangeEffect, ChangePattern, Command
from tryon_server.sessions.events import EditMade, OutfitWorn

# Close codes: RFC 6455 section 7.4 and PROTOCOL.md section 1.
NORMAL = 1000
GOING_AWAY = 1001
POLICY_VIOLATION = 1008
FATAL_ERROR = 4400
NO_SUCH_SESSION = 4404
NO_HELLO = 4408
TOO_MANY_MESSAGES = 4429


@dataclass(frozen=True)
class Send:
    """Send a control message to one client; it must not be lost while the connection lives.

    Attributes:
        client: the client's number.
        payload: encoded message.
        replaces: when not empty, an unsent earlier message with the same word gives way to this one.
    """

    client: int
    payload: bytes
    replaces: str = ""


@dataclass(frozen=True)
class SendFrame:
    """Send a frame to one client. Frames still waiting to be sent give way to one that stands alone."""

    client: int
    payload: bytes
    stands_alone: bool


@dataclass(frozen=True)
class Close:
    """Close the connection of one client once what was to be sent is on its way."""

    client: int
    code: int
    reason: str


@dataclass(frozen=True)
class Order:
    """Tell the simulation something."""

    command: Command


@dataclass(frozen=True)
class Keep:
    """Keep a change of the pattern for good, then tell the session so."""

    made: EditMade


@dataclass(frozen=True)
class KeepWaiting:
    """Keep for good that this change waits to be made, or, for None, that the one with this ticket does not any
    more."""

    ticket: int
    change: ChangePattern | ChangeEffect | None


@dataclass(frozen=True)
class Answer:
    """Tell whoever asked without a connection how the change with this ticket ended."""

    ticket: int
    outcome: EditMade | OutfitWorn | ProtocolError


@dataclass(frozen=True)
class ChangeWorn:
    """Find what a client wants to wear, and have it worn; then tell the session how that ended."""

    client: int
    wish: OutfitWish


@dataclass(frozen=True)
class KeepEffects:
    """Keep for good what was asked of the session's effects, plain JSON."""

    wishes: Mapping[str, Any]


@dataclass(frozen=True)
class AnswerEffects:
    """Tell whoever asked without a connection how what it asked of effects ended."""

    ticket: int
    outcome: EffectsMessage | ProtocolError


@dataclass(frozen=True)
class End:
    """End the session: stop its simulation and forget it."""

    reason: str


Action = Send | SendFrame | Close | Order | Keep | KeepWaiting | Answer | ChangeWorn | KeepEffects | AnswerEffects | End
