"""The part of a session that carries out what its clients send in turn, and tells them what was wrong."""

from __future__ import annotations

from collections.abc import Callable

from tryon_protocol import AckMessage, ByeMessage, ClientMessage, PoseMessage, ProtocolError, encode, error_message
from tryon_server.sessions.actions import Action, Send
from tryon_server.sessions.flow import FrameFlow
from tryon_server.sessions.line import name_of
from tryon_server.sessions.rules import Rules
from tryon_server.sessions.viewer import Viewer


class Turns:
    """What a session does with messages before and after it obeys them; the session has these."""

    _flow: FrameFlow
    _rules: Rules
    _viewers: dict[int, Viewer]

    def _obey(self, client: int, viewer: Viewer, message: ClientMessage, now: float) -> list[Action]:
        """Carry out a message. Raises ProtocolError where that can't be."""
        raise NotImplementedError

    def _line_up(self, client: int, viewer: Viewer, message: ClientMessage, now: float) -> list[Action]:
        """Carry out what a client sent, or, beyond its rate, once its turn comes."""
        try:
            if isinstance(message, AckMessage | ByeMessage):  # they cost nothing, and ask for nothing more
                return self._obey(client, viewer, message, now)
            if isinstance(message, PoseMessage) and message.ack:  # now: the pose may give way to one without
                self._flow.acknowledge(client, message.ack)
            gone = viewer.line.put(message)
        except ProtocolError as fault:
            return self._answer_fault(client, viewer, fault, _number_of(message), now)
        actions = self._serve(client, viewer, viewer.next, now)
        for kind in (name_of(one) for one in gone):
            what = f"More than {self._rules.messages_per_second:g} messages a second arrived; "
            what += f"`{kind}` gave way to what came after it."
            told = ProtocolError("rate_limited", "$", what, "Send fewer; a pose per displayed frame is enough.")
            actions += _told(client, viewer.complaints.came(told, now, kind))
        return actions

    def _go_on(self, client: int, viewer: Viewer, now: float) -> list[Action]:
        """Time went by: carry out, and tell, what waited for that."""
        return [*self._serve(client, viewer, viewer.next, now), *_told(client, viewer.complaints.due(now))]

    def _finish(self, client: int, now: float) -> list[Action]:
        """A client leaves: what it sent before counts nevertheless, and it is told what it was not told yet."""
        viewer = self._viewers.get(client)
        if viewer is None:
            return []
        rest = self._serve(client, viewer, lambda _now: viewer.line.take(), now)
        return [*rest, *_told(client, viewer.complaints.due(float("inf")))]

    def _serve(
        self, client: int, viewer: Viewer, turn: Callable[[float], ClientMessage | None], now: float
    ) -> list[Action]:
        """Carry out those messages of a client whose ``turn`` it is."""
        actions: list[Action] = []
        while (message := turn(now)) is not None:
            try:
                actions += self._obey(client, viewer, message, now)
            except ProtocolError as fault:
                actions += self._answer_fault(client, viewer, fault, _number_of(message), now)
        return actions

    def _answer_fault(
        self, client: int, viewer: Viewer, fault: ProtocolError, request: int | None, now: float
    ) -> list[Action]:
        """Tell a client what was wrong: at once when a numbered request failed, while of others a stream is summed
        up."""
        return _told(client, viewer.complaints.came(fault, now) if request is None else [fault], request)


def _told(client: int, faults: list[ProtocolError], request: int | None = None) -> list[Action]:
    return [Send(client, encode(error_message(fault, request=request))) for fault in faults]


def _number_of(message: ClientMessage) -> int | None:
    """The number that a client gave its message, if it did."""
    return getattr(message, "request", None)
