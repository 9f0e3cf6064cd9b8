"""One process per simulation on this machine."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess

from tryon_server.runtime import fork_server
from tryon_server.runtime.entry import run
from tryon_server.runtime.mailbox import Mailbox
from tryon_server.runtime.memory import own_bytes
from tryon_server.runtime.order import WorkOrder, Workshop
from tryon_server.sessions.commands import Command
from tryon_server.sessions.events import Event, Gone, PhaseChanged

logger = logging.getLogger(__name__)

END_SECONDS = 2.0  # a process that has closed its pipe and has not ended after this long is killed
LOOK_SECONDS = 0.1  # between looks at a process's memory: the fastest takes some 0.3 GB in the meantime


class LocalProcesses:
    """One process per simulation on this machine.

    Args:
        workshop: what the processes work with.
        memory_bytes: most memory of its own that each may take; one that takes more is ended.
    """

    def __init__(self, workshop: Workshop, memory_bytes: int) -> None:
        self._workshop = workshop
        self._memory_bytes = memory_bytes
        self._context = fork_server.started()
        self._processes: set[LocalProcess] = set()
        self._warming: LocalProcess | None = None
        self._lock = threading.Lock()

    def warm(self, order: WorkOrder) -> None:
        """Dress ``order`` once for nothing: Warp's kernels are then compiled and cached for the first session.

        The first session does the same work, so this is given up for it.
        """
        news = _WarmNews(self._stop_warming)
        self._warming = self._start(order, news.take)

    def place(self, order: WorkOrder, on_event: Callable[[Event], None]) -> LocalProcess:
        """Start a process for ``order``."""
        self._stop_warming()
        return self._start(order, on_event)

    def _stop_warming(self) -> None:
        warming, self._warming = self._warming, None
        if warming is not None:
            warming.stop()

    def _start(self, order: WorkOrder, on_event: Callable[[Event], None]) -> LocalProcess:
        here, there = self._context.Pipe()
        process = self._context.Process(
            target=run, args=(there, order, self._workshop), name="tryon simulation", daemon=True
        )
        with self._lock:
            simulation = LocalProcess(process, here, there, on_event, self._forget, self._memory_bytes)
            self._processes.add(simulation)
        return simulation

    def close(self) -> None:
        """End every simulation and wait until they are gone."""
        with self._lock:
            processes = list(self._processes)
        for simulation in processes:
            simulation.stop()
        for simulation in processes:
            simulation.join()

    def _forget(self, simulation: LocalProcess) -> None:
        with self._lock:
            self._processes.discard(simulation)


class _WarmNews:
    """Puts what happens while warming into the log, each thing once, and ends it when it is done."""

    def __init__(self, done: Callable[[], None]) -> None:
        self._done = done
        self._said = ""

    def take(self, event: Event) -> None:
        if not isinstance(event, PhaseChanged):
            return
        if event.detail != self._said:
            self._said = event.detail
            logger.info("getting ready: %s", event.detail)
        if event.phase in ("ready", "failed"):
            self._done()


class LocalProcess:
    """A simulation in a process of its own: one thread starts it and reads its events, another one writes commands.

    ``there`` is the end of the pipe that goes to the process.
    """

    def __init__(
        self,
        process: BaseProcess,
        here: Connection,
        there: Connection,
        on_event: Callable[[Event], None],
        on_end: Callable[[LocalProcess], None],
        memory_bytes: int,
    ) -> None:
        self._process = process
        self._here = here
        self._there = there
        self._on_event = on_event
        self._on_end = on_end
        self._memory_bytes = memory_bytes
        self._looked = 0.0
        self._mailbox = Mailbox()
        self._lock = threading.Lock()
        self._launched = False
        self._stopping = False
        self._reader = threading.Thread(target=self._read, name="simulation events", daemon=True)
        self._writer = threading.Thread(target=self._write, name="simulation commands", daemon=True)
        self._reader.start()

    @property
    def pid(self) -> int | None:
        """Number of the process; None until it runs."""
        return self._process.pid if self._launched else None

    def order(self, command: Command) -> None:
        """Tell it something; returns at once."""
        self._mailbox.put(command)

    def stop(self) -> None:
        """End it; returns at once."""
        with self._lock:
            self._stopping = True
            if self._launched:
                self._process.kill()
        self._mailbox.close()

    def join(self) -> None:
        """Wait until the process has ended."""
        self._reader.join()

    def _read(self) -> None:
        greedy = False
        try:
            if self._launch():
                self._writer.start()
                while not (greedy := self._takes_too_much()):
                    if self._here.poll(LOOK_SECONDS):
                        self._tell(self._here.recv())
        except (EOFError, OSError) as error:
            logger.debug("a simulation's pipe has closed: %r", error)
        except Exception:
            logger.exception("a simulation could not be started or read")
        finally:
            self._finish(greedy)

    def _launch(self) -> bool:
        with self._lock:
            if not self._stopping:
                self._process.start()
                self._launched = True
        self._there.close()  # so that the end of the process is the end of the pipe
        return self._launched

    def _tell(self, event: Event) -> None:
        if not self._stopping:
            self._on_event(event)

    def _takes_too_much(self) -> bool:
        """Whether the process, if it was not looked at just now, has taken more memory than it may."""
        now = time.monotonic()
        if self._process.pid is None or now - self._looked < LOOK_SECONDS:
            return False
        self._looked = now
        return own_bytes(self._process.pid) > self._memory_bytes

    def _finish(self, greedy: bool) -> None:
        self._mailbox.close()
        how = "it could not be started"
        if greedy:
            self._process.kill()
            self._process.join()
            how = f"its process took more memory than the {self._memory_bytes / 2**30:.3g} GiB that a session may take"
        elif self._launched:
            self._process.join(END_SECONDS)
            if self._process.is_alive():  # it has closed its pipe and hangs
                self._process.kill()
                self._process.join()
            how = _ending(self._process.exitcode)
        self._here.close()
        self._tell(Gone(how))
        self._on_end(self)

    def _write(self) -> None:
        try:
            while commands := self._mailbox.take():
                self._here.send(commands)
        except (OSError, ValueError) as error:  # the process has ended; the reader tells
            logger.debug("a simulation takes no more commands: %r", error)


def _ending(code: int | None) -> str:
    if code is not None and code < 0:
        return f"its process was ended by signal {-code}"
    return f"its process ended with status {code}"
