"""What was asked for over REST and takes longer than who asked may wait: found again until it is done, and for a while
afterwards, as AIP-151 has it of long-running operations."""

from __future__ import annotations

import asyncio
import secrets
import time
from collections.abc import Callable, Coroutine
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

from tryon_server.problems import ProblemError, problem_error

CANCELLED = "job.cancelled"
UNEXPECTED = "The server failed to make it; its log says why"
BEING_KEPT = "It is worn, and is being kept"

Step = Literal["put_on", "take_off", "reorder", "edit", "undo", "redo", "effect"]
State = Literal["running", "done", "refused", "cancelled"]


class Progress(NamedTuple):
    """What is being done for a job, in a word and for people, and how much of it is done, 0 to 1; None: not known."""

    doing: str
    detail: str
    share: float | None = None


@dataclass(eq=False)
class Job:
    """A change of a session that is made, or was.

    Attributes:
        id: names it.
        session: whose id.
        step: what was asked for.
        garment: of which; "" of the one that is edited, or of all.
        status: HTTP status of its answer, where it is not refused.
        begun: when [s], on the steady clock.
        ended: when it came to an end; None before.
        given_up: was it asked to stop?
    """

    id: str
    session: str
    step: Step
    garment: str
    status: int
    begun: float
    _progress: Callable[[], Progress]
    _give_up: Callable[[], None]
    ended: float | None = None
    given_up: bool = False
    _task: asyncio.Task[Any] = field(init=False)

    @property
    def state(self) -> State:
        """Is it done, and how did that end?"""
        if not self._task.done():
            return "running"
        fault = self._fault
        if fault is None:
            return "done"
        return "cancelled" if isinstance(fault, ProblemError) and fault.problem.code == CANCELLED else "refused"

    @property
    def progress(self) -> Progress:
        """How far it is; how it ended, of one that has."""
        if not self._task.done():
            return self._progress()
        fault = self._fault
        if fault is None:
            return Progress("done", "It is worn", 1.0)
        return Progress(self.state, fault.problem.line() if isinstance(fault, ProblemError) else UNEXPECTED)

    @property
    def _fault(self) -> BaseException | None:
        if self._task.cancelled():
            return asyncio.CancelledError()
        return self._task.exception()

    async def wait(self, seconds: float) -> bool:
        """Wait so long [s] for its end; has it come?"""
        await asyncio.wait({self._task}, timeout=seconds)
        return self._task.done()

    def outcome(self) -> Any:
        """What it came to, once it has ended. Raises what it raised: a ProblemError where it was refused."""
        return self._task.result()

    def give_up(self) -> None:
        """Stop it, if it can still be stopped; its end tells."""
        self.given_up = True
        self._give_up()


class Jobs:
    """The jobs of a server. To be used from one event loop."""

    def __init__(self, kept_seconds: float, most_kept: int) -> None:
        """One that has ended is kept so long [s], and of those the `most_kept` that ended last."""
        self._kept_seconds, self._most_kept = kept_seconds, most_kept
        self._jobs: dict[str, Job] = {}

    def begin(
        self,
        session: str,
        step: Step,
        garment: str,
        work: Coroutine[Any, Any, Any],
        *,
        status: int,
        progress: Callable[[], Progress],
        give_up: Callable[[], None],
    ) -> Job:
        """Have this done. ``work`` returns the answer, or raises ProblemError; ``give_up`` has it raise, if that still
        can be."""
        self._expire()
        job = Job(secrets.token_urlsafe(12), session, step, garment, status, time.monotonic(), progress, give_up)
        job._task = asyncio.get_running_loop().create_task(_unless_given_up(job, work))
        job._task.add_done_callback(lambda _task: self._note_end(job))
        self._jobs[job.id] = job
        return job

    def get(self, session: str, job_id: str) -> Job:
        """The job of this id, of that session. Raises ProblemError 404."""
        self._expire()
        job = self._jobs.get(job_id)
        if job is None or job.session != session:
            message = f"session {session!r} has no job {job_id!r}, or has it no longer"
            remedy = f"An ended one is kept for {self._kept_seconds:g} s; see what the session wears, and its edits"
            raise problem_error("job.unknown", message, remedy, place="job", status=404)
        return job

    def of(self, session: str) -> list[Job]:
        """Those of a session, oldest first."""
        self._expire()
        return [job for job in self._jobs.values() if job.session == session]

    def forget(self, job: Job) -> None:
        """Whoever asked has its answer."""
        self._jobs.pop(job.id, None)

    async def close(self) -> None:
        """End those that the end of their sessions has not ended."""
        tasks = [job._task for job in self._jobs.values()]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def _note_end(self, job: Job) -> None:
        job.ended = time.monotonic()
        _ = job._fault  # it is told when it is asked for

    def _expire(self) -> None:
        ended = sorted((job.ended, job.id) for job in self._jobs.values() if job.ended is not None)
        oldest = time.monotonic() - self._kept_seconds
        too_many = len(ended) - self._most_kept
        for place, (when, job_id) in enumerate(ended):
            if when < oldest or place < too_many:
                del self._jobs[job_id]


async def _unless_given_up(job: Job, work: Coroutine[Any, Any, Any]) -> Any:
    try:
        return await work
    except (ProblemError, asyncio.CancelledError) as error:
        if not job.given_up:
            raise
        message = "it was cancelled before it was worn; what was worn is worn on"
        raise problem_error(CANCELLED, message, "Ask for it again", place="job", status=409) from error
