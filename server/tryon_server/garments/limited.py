"""A child process that can't take the server down: bounded in time and in address space."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass

import msgspec

from tryon_server.problems import ProblemError, problem_error

STARTUP_SECONDS = 20.0  # importing the solver's geometry from a cold disk, on top of the time allowed for the work


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
        ProblemError: 422, the child overran a limit or broke down.
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
    raise _too_complex(work, f"used more than {limits.address_space / 2**30:.1f} GiB or broke down") from RuntimeError(
        f"exit status {done.returncode}: {done.stderr[-2000:].decode(errors='replace')}"
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
