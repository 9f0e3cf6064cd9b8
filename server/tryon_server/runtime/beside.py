"""Work beside a simulation, in a process of its own: Python beside Python in one process would hold up every frame."""

from __future__ import annotations

import gc
import logging
import os
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from typing import Any, Protocol, runtime_checkable

from tryon_server.problems import Problem, ProblemError
from tryon_server.runtime import handed_over
from tryon_server.runtime.telling import NowAndThen

logger = logging.getLogger(__name__)

SHORT_SECONDS = 0.2  # that a short task which nobody waits for is given to end, before it is ended
IDLE_SECONDS = 1.0  # without a task, after which what the ones before left behind is given back: who comes then waits
LESS_URGENT = 5  # steps of niceness: where processors are few, a frame goes first

Task = Callable[[], Any]
"""What is to be done. It and what it returns travel as pickles; it may raise ProblemError."""


@dataclass(frozen=True)
class Made:
    """A task is done: what it returned."""

    value: Any


@dataclass(frozen=True)
class NotMade:
    """A task could not be done: why, and what to do about it."""

    problem: Problem


@dataclass(frozen=True)
class Told:
    """What a task is at, in a sentence for people, and how much of that is done, 0 to 1; None: not known."""

    stage: str
    share: float | None


@runtime_checkable
class TellingTask(Protocol):
    """A task that tells how far it is."""

    def telling(self, tell: Callable[[str, float | None], None]) -> Task:
        """The task itself, which tells this."""


class Beside(Protocol):
    """Does one task at a time while a simulation goes on."""

    def warm(self) -> None:
        """Be ready for a task soon; returns at once."""

    @property
    def doing(self) -> Task | None:
        """What is being done, for whoever began it; None where nothing is."""

    def begin(self, task: Task, short: bool = False) -> None:
        """Do this; returns at once. What was being done is given up. `short`: it takes less time than to start anew
        what does it, so that giving it up is waiting for its end."""

    def outcome(self) -> Made | NotMade | None:
        """How the task ended, once it has, and then no more; returns at once."""

    def news(self) -> Told | None:
        """The newest that the task told, as far as `outcome` has seen, and then no more."""

    def give_up(self) -> None:
        """Nobody waits for the task any more."""

    def close(self) -> None:
        """End whatever does tasks, and what is done; it begins anew with the next task."""


class ProcessBeside:
    """`Beside` in another process, which ends with this one, however that ends.

    It is started by `warm`, and again after it was killed in the middle of what was given up.
    """

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._connection: Connection | None = None
        self._sender: threading.Thread | None = None
        self._task: Task | None = None
        self._short = False
        self._fault = ""
        self._news: Told | None = None

    def warm(self) -> None:
        """Start the process, unless it runs; returns at once."""
        if self._process is not None:
            return
        here, there = Pipe()
        command = f"from tryon_server.runtime.beside import serve; serve({there.fileno()})"
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-c", command], pass_fds=[there.fileno()], stdin=subprocess.DEVNULL, env=environment
            )
        except OSError as error:
            self._fault = f"no process could be started: {error}"
            here.close()
        else:
            self._connection = here
        finally:
            there.close()  # so that the end of either process is the end of the pipe

    @property
    def doing(self) -> Task | None:
        """What the process is doing."""
        return self._task

    def begin(self, task: Task, short: bool = False) -> None:
        """Have the process do this; returns at once, unless it is at the end of what is short."""
        self.give_up()
        self.warm()
        self._task, self._short = task, short
        if self._connection is not None:
            # What it needs takes a while to be written, and a process that starts reads nothing yet.
            arguments = self._connection, handed_over.pack(task)
            self._sender = threading.Thread(target=_send, args=arguments, name="task", daemon=True)
            self._sender.start()

    def outcome(self) -> Made | NotMade | None:
        """How the task ended, once it has, and then no more; returns at once."""
        if self._task is None:
            return None
        if self._connection is None:
            return self._ended(self._fault)
        try:
            while self._connection.poll():
                message: Made | NotMade | Told = handed_over.receive(self._connection)
                if not isinstance(message, Told):
                    self._task = self._news = None
                    return message
                self._news = message
        except (EOFError, OSError):
            return self._ended("the process that was to do it has ended")
        return None

    def news(self) -> Told | None:
        """The newest that the task told."""
        news, self._news = self._news, None
        return news

    def give_up(self) -> None:
        """Nobody waits for the task any more."""
        if self._task is None:
            return
        if self._short and self._connection is not None and self._connection.poll(SHORT_SECONDS):
            self.outcome()
        else:
            self.close()

    def close(self) -> None:
        """End the process."""
        process, self._process = self._process, None
        connection, self._connection = self._connection, None
        self._task, self._fault, self._news = None, "", None
        if process is not None:
            process.kill()
            process.wait()
        if self._sender is not None:
            self._sender.join()  # nobody reads any more what it may still have been sending
        if connection is not None:
            connection.close()

    def _ended(self, why: str) -> NotMade:
        self.close()
        return not_made(why, "Try it again; if it happens again, choose a coarser preset or a simpler pattern")


def not_made(why: str, remedy: str) -> NotMade:
    """That a task failed in a way that was not foreseen."""
    return NotMade(Problem(code="beside.failed", place="edit", message=why, remedy=remedy))


def _send(connection: Connection, task: handed_over.Packed) -> None:
    try:
        handed_over.send_packed(connection, task)
    except (OSError, ValueError) as error:  # the process has ended, or was given up; who reads the outcome tells
        logger.debug("a task was not taken: %r", error)


def serve(descriptor: int) -> None:
    """Body of the process: do what comes through the pipe of this number until its other end closes."""
    for number in (signal.SIGINT, signal.SIGTERM):  # told to all processes of the server, which ends them itself
        signal.signal(number, signal.SIG_IGN)
    os.nice(LESS_URGENT)
    connection = Connection(descriptor)
    tasks: queue.SimpleQueue[handed_over.Packed] = queue.SimpleQueue()
    threading.Thread(target=_receive, args=(connection, tasks), name="tasks", daemon=True).start()
    import_module("tryon_server.runtime.cutting")  # what most tasks need takes a second to load
    give_back_freed = import_module("tryon_solver.linalg.freed").give_back_freed
    while True:
        try:
            packed = tasks.get(timeout=IDLE_SECONDS)
        except queue.Empty:
            gc.collect()  # a garment that was made: its parts refer to each other
            give_back_freed()
            packed = tasks.get()
        task = handed_over.unpack(packed)
        del packed
        if isinstance(task, TellingTask):
            task = task.telling(
                NowAndThen(lambda stage, share: handed_over.send(connection, Told(stage, share)), time.monotonic)
            )
        handed_over.send(connection, carried_out(task))
        del task


def _receive(connection: Connection, tasks: queue.SimpleQueue[handed_over.Packed]) -> None:
    """Take tasks; end the process with the other one, also in the middle of a task."""
    while True:
        try:
            tasks.put(handed_over.receive_packed(connection))
        except (EOFError, OSError):
            os._exit(0)


def carried_out(task: Task) -> Made | NotMade:
    """How the task ends, here and now."""
    try:
        return Made(task())
    except ProblemError as error:
        return NotMade(error.problem)
    except Exception as error:
        logger.exception("a task failed")
        return not_made(f"it failed: {error!r}", "Do something else")
