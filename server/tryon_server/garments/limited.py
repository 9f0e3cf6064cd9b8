"""A child process that can't take the server down: bounded in time and in address space."""

from __future__ import annotations

import logging
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import msgspec

from tryon_server.problems import ProblemError, problem_error

logger = logging.getLogger(__name__)

STARTUP_SECONDS = 20.0  # importing the solver's geometry from a cold disk, on top of the time allowed for the work
OUT_OF_MEMORY = 77  # exit status of a child whose address space did not suffice
OUT_OF_TIME = (-signal.SIGXCPU, -signal.SIGKILL) if hasattr(signal, "SIGXCPU") else ()


class Limits(msgspec.Struct, frozen=True, kw_only=True):
    """What a child may use: wall time [s] of its work, and address space [bytes]."""

    seconds: float
    address_space: int


@dataclass(frozen=True)
class Work:
    """What a child does, for the message when it overruns a limit: ``code`` and ``remedy`` as in a Problem."""

    what: str
    code: str
    remedy: str


def run_limited(module: str, arguments: Sequence[str], content: bytes, limits: Limits, work: Work) -> bytes:
    """Run ``python -m module arguments`` with ``content`` on its standard input; its standard output.

    The module applies the limits to itself with ``apply_limits`` before it reads anything, and the parent ends it when
    it stays longer than the allowed time.

    Raises:
        ProblemError: 422, the child overran a limit; 500, it failed, which is told in the log.
    """
    command = [sys.executable, "-m", module, *arguments]
    try:
        done = subprocess.run(
            command, input=content, capture_output=True, timeout=limits.seconds + STARTUP_SECONDS, check=False
        )
    except subprocess.TimeoutExpired as error:
        raise _too_complex(work, f"took more than {limits.seconds:g} s") from error
    if done.returncode == 0:
        return done.stdout
    if done.returncode in OUT_OF_TIME:
        raise _too_complex(work, f"took more than {limits.seconds:g} s")
    said = done.stderr[-4000:].decode(errors="replace")
    logger.error("%s ended with status %d: %s", work.what, done.returncode, said)
    memory = f"used more than {limits.address_space / 2**30:.1f} GiB"
    if done.returncode == OUT_OF_MEMORY:
        raise _too_complex(work, memory)
    if done.returncode < 0:  # a library in another language ends so when memory is denied to it, or when it is wrong
        raise _too_complex(work, f"{memory}, or a library that it uses broke down")
    raise unforeseen(work.what, f"its process ended with status {done.returncode}")


def run_child(work: Callable[[], None]) -> None:
    """Body of a child: does the work, and says so when its address space did not suffice."""
    try:
        work()
    except MemoryError:
        sys.exit(OUT_OF_MEMORY)


def unforeseen(what: str, why: str) -> ProblemError:
    """What nobody thought of: a fault of ours, not of the file."""
    return problem_error(
        "server.fault",
        f"{what} failed ({why}): this is a fault of the server's, which its log describes",
        "Report it with the file and the server's log; the file as another program exports it may go through",
        status=500,
    )


def apply_limits(seconds: float, address_space: int) -> None:
    """Bound the calling process: processor time [s] and address space [bytes]. On systems with POSIX limits only."""
    try:
        import resource
    except ImportError:  # Windows: the parent's timeout still holds
        return
    cpu_seconds = int(seconds + STARTUP_SECONDS) + 1
    resource.setrlimit(resource.RLIMIT_CPU, (cpu_seconds, cpu_seconds + 1))
    resource.setrlimit(resource.RLIMIT_AS, (address_space, address_space))


def _too_complex(work: Work, why: str) -> ProblemError:
    return problem_error(work.code, f"{work.what} {why}", work.remedy, status=422)
