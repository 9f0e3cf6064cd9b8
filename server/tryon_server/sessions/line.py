"""What one client sent faster than it may: it waits for its turn, and of what sets a value only the newest does."""

from __future__ import annotations

from collections.abc import Hashable
from itertools import count

from tryon_protocol import (
    ClientMessage,
    EditMessage,
    KeyframeRequestMessage,
    PauseMessage,
    PingMessage,
    PlayMessage,
    PoseMessage,
    ProtocolError,
    RedoMessage,
    SetAccuracyMessage,
    SetFabricMessage,
    SetMotionMessage,
    SkeletonMessage,
    UndoMessage,
)

MOST_COUNTED = 32  # messages that wait and count each, such as edits: as many as a session lets wait of one kind

_POSE, _HELD = "pose", "held"
_CHANGES = (EditMessage, UndoMessage, RedoMessage, SetFabricMessage)
_VALUES: dict[type, str] = {
    KeyframeRequestMessage: "keyframe_request",
    PauseMessage: "time",
    PingMessage: "ping",
    PlayMessage: "time",
    PoseMessage: _POSE,
    SetAccuracyMessage: "accuracy",
    SetMotionMessage: "motion",
    SkeletonMessage: "skeleton",
}


class Line:
    """Messages of one client in the order of their turns. It never grows beyond a bound."""

    def __init__(self) -> None:
        self._waiting: dict[Hashable, ClientMessage] = {}
        self._numbers = count()

    def __bool__(self) -> bool:
        """Does anything wait?"""
        return bool(self._waiting)

    def put(self, message: ClientMessage) -> list[ClientMessage]:
        """Line up at the end, or in the place of what gives way to this one, since it would set again what this one
        sets: a pose that comes before the turn of the last one would never have a turn at the end. A held edit stays
        behind the changes that it comes after. What gives way.

        Raises:
            ProtocolError: too many wait already of those that count each.
        """
        value = _value_of(message)
        if value is None:
            if sum(not isinstance(kind, str) for kind in self._waiting) >= MOST_COUNTED:
                what = f"{MOST_COUNTED} messages wait that came faster than they may; "
                what += f"this `{name_of(message)}` was not used."
                raise ProtocolError("rate_limited", "$", what, "Send fewer messages, and send this one again later.")
            self._waiting[next(self._numbers)] = message
            return []
        gone = [self._waiting.get(value)]
        if value == _HELD and self._changed_since(value):
            del self._waiting[value]
        if isinstance(message, SkeletonMessage | SetMotionMessage):  # a pose from before it would be misread after it
            gone.append(self._waiting.pop(_POSE, None))
        self._waiting[value] = message
        return [one for one in gone if one is not None]

    def take(self) -> ClientMessage | None:
        """The one whose turn it is; None: nothing waits."""
        return self._waiting.pop(next(iter(self._waiting))) if self._waiting else None

    def _changed_since(self, value: str) -> bool:
        """Does a change of the garment wait behind what sets this value?"""
        if value not in self._waiting:
            return False
        kinds = list(self._waiting)
        return any(isinstance(self._waiting[kind], _CHANGES) for kind in kinds[kinds.index(value) + 1 :])


def name_of(message: ClientMessage) -> str:
    """The type of a message as the wire has it."""
    return str(message.__struct_config__.tag)


def _value_of(message: ClientMessage) -> str | None:
    """The word of what the message sets, or asks to be told, where only the newest counts; None: each counts."""
    if isinstance(message, EditMessage) and message.hold:
        return _HELD
    return _VALUES.get(type(message))
