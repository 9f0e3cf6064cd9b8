"""A worker in this process that a script drives, with a fake connection and a fake clock."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import analytic_drape
import pytest
from pretended_effects import Compiled

from tryon_protocol import FrameDecoder, Topology, decode_server
from tryon_server.runtime.arming import Armoury
from tryon_server.runtime.beside import Made, NotMade, carried_out
from tryon_server.runtime.order import DrapeOrder, WorkOrder
from tryon_server.runtime.worker import Worker
from tryon_server.sessions.commands import AllowFrame
from tryon_server.sessions.events import FrameReady, TopologyReady


class LetGoError(Exception):
    """The script is over."""


class InThisProcess:
    """`Beside` by a fake clock: each task takes so many seconds of it, and is done when it is over."""

    def __init__(self, clock, seconds: float) -> None:
        self.clock, self.seconds = clock, seconds
        self.task, self.done_at = None, 0.0
        self.begun = 0

    def warm(self) -> None:
        pass

    @property
    def doing(self):
        return self.task

    def begin(self, task, short=False) -> None:
        self.task, self.done_at = task, self.clock() + (0.0 if short else self.seconds)
        self.begun += 1

    def outcome(self) -> Made | NotMade | None:
        if self.task is None or self.clock() < self.done_at:
            return None
        task, self.task = self.task, None
        return carried_out(task)

    def news(self):
        return None

    def give_up(self) -> None:
        self.task = None

    def close(self) -> None:
        self.task = None


class ScriptedConnection:
    """Plays a script: at given times commands arrive. Waiting makes the clock go on."""

    def __init__(self, script: list[tuple[float, object]], until: float) -> None:
        self.now = 0.0
        self.script = sorted(script, key=lambda entry: entry[0])
        self.until = until
        self.events: list = []
        self.times: list[float] = []
        self.beside: InThisProcess | None = None

    def poll(self, wait: float | None) -> bool:
        self.now += 0.0005  # looking takes time, too
        due = self.script[0][0] if self.script else self.until
        if due > self.now and wait != 0.0:
            self.now = due if wait is None else min(due, self.now + wait)
        if self.now >= self.until:
            raise LetGoError
        return bool(self.script) and self.script[0][0] <= self.now

    def recv(self) -> list:
        commands = []
        while self.script and self.script[0][0] <= self.now:
            commands.append(self.script.pop(0)[1])
        return commands

    def send(self, event) -> None:
        self.events.append(event)
        self.times.append(self.now)


def work(
    script,
    until: float,
    fabric: str = "cotton",
    motion: str | None = "sway",
    build=analytic_drape.build,
    seconds_beside: float = 0.0,
    effects=None,
    begun=lambda _connection: None,
    **more,
) -> ScriptedConnection:
    """What the worker told by the end of its script; `begun` is told of the connection first, `more` of its order."""
    connection = ScriptedConnection(script, until)
    begun(connection)
    order = WorkOrder(DrapeOrder(Path("pattern.json"), fabric, "draft", "cpu"), motion, 50.0, 1.0)
    order = replace(order, effects=effects or {}, **more)
    worker = Worker(connection, order, build, analytic_drape.load_motion, *clock_of(connection, seconds_beside))
    with pytest.raises(LetGoError):
        worker.run()
    return connection


def clock_of(connection: ScriptedConnection, seconds_beside: float = 0.0):
    """The last arguments of a worker by the connection's clock."""
    connection.beside = InThisProcess(lambda: connection.now, seconds_beside)
    compiler = InThisProcess(lambda: connection.now, seconds_beside)
    return connection.beside.clock, connection.beside, Armoury(compiler, "cpu", Compiled)


def allow(total: int, **forms: bool) -> AllowFrame:
    return AllowFrame(
        **({"total": total, "keyframe": False, "standalone": False, "plain": False, "again": False} | forms)
    )


def frames(connection) -> list:
    """What a client decodes of all that was published."""
    decoder, decoded = FrameDecoder(), []
    for event in connection.events:
        if isinstance(event, TopologyReady):
            decoder.set_topology(Topology.from_message(decode_server(event.payload)))
        elif isinstance(event, FrameReady):
            decoded.append(decoder.decode(event.shared.data))
    return decoded
