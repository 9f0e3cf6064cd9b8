"""A session's worker in this process: a script gives it commands and sees what a client would, frame by frame.

The worker is the server's, with its publishing code; between it and the script are a connection that is no pipe and a
clock on which waiting takes no time, so that a garment moves by the same poses however slow the machine is. The script
is a generator: what it yields are commands for the worker, and nothing lets it go on by itself.
"""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from tryon_protocol import DecodedFrame, FrameDecoder, Topology, TopologyMessage, decode_server
from tryon_server.runtime.arming import Armoury, Compiling
from tryon_server.runtime.beside import Made, NotMade, Task, Told, carried_out
from tryon_server.runtime.motions import load_motion
from tryon_server.runtime.order import DrapeOrder, WorkOrder
from tryon_server.runtime.production import build_drape
from tryon_server.runtime.remaking import Dressing
from tryon_server.runtime.solver_drape import SolverDrape
from tryon_server.runtime.worker import Worker
from tryon_server.sessions.commands import AllowFrame, ChangePattern, Command, Run
from tryon_server.sessions.events import EditMade, EditRefused, Event, FrameReady, PhaseChanged, TopologyReady, Troubled

FRAMES_PER_SECOND = 30.0
KEYFRAME_SECONDS = 1.0
ALL = 10**9  # frames that may be published
LOOK_SECONDS = 1e-5  # that a look takes at least: by less than its last digit a clock does not go on
LONGEST_ANSWER = 3000  # frames in which an edit has to be answered

Script = Generator[Sequence[Command], None, None]


@dataclass(frozen=True)
class Shown:
    """A frame as a client has it, and when it came: s by the machine's clock; and the body's stance in it."""

    frame: DecodedFrame
    topology: Topology
    came: float
    stance: Any = None


@dataclass(frozen=True)
class Answer:
    """What became of a change, and the frames that were published before its answer."""

    event: EditMade | EditRefused
    before: tuple[Shown, ...]
    asked: float  # s by the machine's clock
    put_on: Literal["", "as before", "anew"]  # in another stance: as it hung when it was worn before, or dressed anew


class SessionError(RuntimeError):
    """The session broke: the garment could not be dressed, a step failed, or an edit was never answered."""


class Here:
    """`Beside` in this process, at the first look: as many frames go by meanwhile on every machine."""

    def __init__(self) -> None:
        self.dressings = 0
        self._task: Task | None = None

    def warm(self) -> None:
        """It is."""

    @property
    def doing(self) -> Task | None:
        """What is to be done when somebody looks."""
        return self._task

    def begin(self, task: Task, short: bool = False) -> None:  # noqa: ARG002
        """Do this when somebody looks."""
        self.dressings += isinstance(task, Dressing)
        self._task = task

    def outcome(self) -> Made | NotMade | None:
        """Do it now."""
        task, self._task = self._task, None
        return None if task is None else carried_out(task)

    def news(self) -> Told | None:
        """None: it is done before anybody could ask."""
        return None

    def give_up(self) -> None:
        """Do nothing."""
        self._task = None

    def close(self) -> None:
        """Do nothing."""
        self._task = None


class EditedSession:
    """A worker and what it sends."""

    def __init__(self, order: DrapeOrder, motion: str, script: Callable[[EditedSession], Script]) -> None:
        """`script` is called with this session and driven until it ends."""
        self.now = 0.0  # s, the worker's clock
        self.troubles: list[str] = []
        self._put_on = 0  # times that a garment was put on in another stance than the one before
        self._order = WorkOrder(order, motion, FRAMES_PER_SECOND, KEYFRAME_SECONDS)
        self._frames: list[Shown] = []
        self._answers: list[EditMade | EditRefused] = []
        self._decoder = FrameDecoder()
        self._topology: Topology | None = None
        self._failed = ""
        self._script = script(self)
        self._commands: Sequence[Command] = ()
        self._here = Here()
        order, here, armoury = self._order, self._here, Armoury(Here(), order.device, Compiling)
        self._worker = Worker(self, order, build_drape, load_motion, self._clock, here, armoury)  # type: ignore[arg-type]

    def _clock(self) -> float:
        return self.now

    def run(self) -> None:
        """Play the script to its end. Raises what the script raises.

        What is loaded is set aside, as by a session's own process: each look for garbage would go through all of it,
        0.3 s of each change of mesh that no session takes.
        """
        gc.collect()
        gc.freeze()
        try:
            self._worker.run()
        except EOFError:
            return
        finally:
            gc.unfreeze()

    @property
    def drape(self) -> SolverDrape:
        """What is worn: what of it no client is told is looked at in it."""
        drape = self._worker._drape
        assert isinstance(drape, SolverDrape)
        return drape

    # What a script does -------------------------------------------------------------------------------------------

    def start(self, *commands: Command) -> Generator[Sequence[Command], None, Shown]:
        """Have it run, with these commands first; the garment as it was dressed."""
        yield (AllowFrame(ALL, keyframe=False, standalone=False, plain=False, again=False), Run(True), *commands)
        return (yield from self.frame())

    def frame(self) -> Generator[Sequence[Command], None, Shown]:
        """The next frame."""
        while not self._frames:
            self._check()
            yield ()
        return self._frames.pop(0)

    def change(self, command: ChangePattern) -> Generator[Sequence[Command], None, Answer]:
        """Ask for a change of the pattern and wait for the answer."""
        asked, put_on, dressings = time.perf_counter(), self._put_on, self._here.dressings
        yield (command,)
        event = yield from self.answer()
        before = tuple(self._frames)
        self._frames.clear()
        anew = "anew" if self._here.dressings > dressings else "as before"
        return Answer(event, before, asked, anew if self._put_on > put_on else "")

    def answer(self) -> Generator[Sequence[Command], None, EditMade | EditRefused]:
        """The next answer to a change."""
        while not self._answers:
            self._check()
            if len(self._frames) > LONGEST_ANSWER:
                raise SessionError("an edit is not answered")
            yield ()
        return self._answers.pop(0)

    def _check(self) -> None:
        if self._failed:
            raise SessionError(self._failed)

    # The connection, as the worker has it -------------------------------------------------------------------------

    def poll(self, wait: float | None) -> bool:
        """Let the script go on; waiting is done by the clock."""
        self.now += max(wait, LOOK_SECONDS) if wait else 0.0
        try:
            self._commands = next(self._script)
        except StopIteration:
            raise EOFError from None
        return bool(self._commands)

    def recv(self) -> list[Command]:
        """What the script said."""
        return list(self._commands)

    def send(self, event: Event) -> None:
        """Keep what a client is sent."""
        match event:
            case TopologyReady():
                message = decode_server(event.payload)
                assert isinstance(message, TopologyMessage)
                self._topology = Topology.from_message(message)
                self._decoder.set_topology(self._topology)
            case FrameReady():
                assert self._topology is not None
                frame = self._decoder.decode(event.shared.data)
                self._frames.append(Shown(frame, self._topology, time.perf_counter(), self.drape.stance))
            case EditMade() | EditRefused():
                self._answers.append(event)
            case Troubled():
                self.troubles.append(event.message)
            case PhaseChanged(phase="ready"):
                self._put_on += 1
            case PhaseChanged(phase="failed"):
                self._failed = event.detail
