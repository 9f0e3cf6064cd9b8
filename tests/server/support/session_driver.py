"""A session machine with a fake clock: say what happens, look at what it sent, ordered and closed."""

from __future__ import annotations

from collections import defaultdict
from itertools import count

from tryon_protocol import AckMessage, ErrorMessage, HelloMessage, PoseMessage, decode_server, encode
from tryon_server.sessions import Close, End, Order, Rules, Send, SendFrame, Session
from tryon_server.sessions.actions import KeepWaiting
from tryon_server.sessions.events import PhaseChanged, TopologyReady

JOINTS = ("hips", "spine", "head")
RULES = Rules(
    epoch="epoch-1",
    server="tryon test",
    motions=("walk", "squat"),
    fabrics=("cotton", "denim"),
    effects=("wind", "gravity"),
    presets=("draft", "live", "fit", "reference"),
    max_viewers=3,
    messages_per_second=100.0,
    grace_seconds=30.0,
)


class Driver:
    """Drives one session. Messages are decoded; frames are kept as bytes."""

    def __init__(self, motion: str | None = "walk", rules: Rules = RULES) -> None:
        tokens = count(1)
        self.now = 100.0
        self.session = Session("session-1", rules, motion, "cotton", lambda: f"token-{next(tokens)}", self.now)
        self.sent: dict[int, list] = defaultdict(list)
        self.frames: dict[int, list[bytes]] = defaultdict(list)
        self.closed: dict[int, int] = {}
        self.orders: list = []
        self.stored: dict[int, object] = {}
        self.ended: str | None = None

    def connect(self, client: int, **hello) -> None:
        self._note(self.session.connect(client, self.now))
        self.say(client, HelloMessage(versions=(1,), client="test", **hello))

    def connect_silently(self, client: int) -> None:
        self._note(self.session.connect(client, self.now))

    def say(self, client: int, message) -> None:
        self.say_bytes(client, encode(message))

    def say_bytes(self, client: int, data: bytes) -> None:
        self._note(self.session.receive(client, data, self.now))

    def say_text(self, client: int) -> None:
        self._note(self.session.receive_text(client, self.now))

    def leave(self, client: int, in_good_order: bool = False) -> None:
        self._note(self.session.disconnect(client, self.now, in_good_order))

    def simulation(self, event) -> None:
        self._note(self.session.simulated(event, self.now))

    def dressed(self, topology_id: int = 1) -> None:
        self.simulation(TopologyReady(topology_id, b"topology" + bytes([topology_id]), b"plain", JOINTS))
        self.simulation(PhaseChanged("ready", "Dressed"))

    def wait(self, seconds: float) -> None:
        self.now += seconds
        self._note(self.session.tick(self.now))

    def end(self, reason: str, retry_after: float | None = None) -> None:
        self._note(self.session.end(reason, retry_after))

    def ack(self, client: int, seq: int) -> None:
        self.say(client, AckMessage(seq=seq))

    def messages(self, client: int, kind: type) -> list:
        return [message for message in self.sent[client] if isinstance(message, kind)]

    def last(self, client: int, kind: type):
        return self.messages(client, kind)[-1]

    def errors(self, client: int) -> list[str]:
        return [message.code for message in self.messages(client, ErrorMessage)]

    def ordered(self, kind: type) -> list:
        return [command for command in self.orders if isinstance(command, kind)]

    def _note(self, actions: list) -> None:
        for action in actions:
            match action:
                case Send(client, payload, _):
                    self.sent[client].append(
                        payload if payload.startswith((b"topo", b"plain")) else decode_server(payload)
                    )
                case SendFrame(client, payload, _):
                    self.frames[client].append(payload)
                case Close(client, code, _):
                    self.closed[client] = code
                case Order(command):
                    self.orders.append(command)
                case KeepWaiting(ticket, None):
                    del self.stored[ticket]
                case KeepWaiting(ticket, change):
                    self.stored[ticket] = change
                case End(reason):
                    assert self.ended is None, "a session ends once"
                    self.ended = reason


def pose(seq: int, t: float | None = None, **changes) -> PoseMessage:
    """A valid pose of the driver's body, with the given changes."""
    values = {
        "subject": "wearer",
        "convention": "model-local",
        "frame": "session",
        "t": float(seq) if t is None else t,
        "seq": seq,
        "root": (0.0, 1.0, 0.0),
        "rotations": ((0.0, 0.0, 0.0, 1.0),) * len(JOINTS),
    }
    return PoseMessage(**(values | changes))
