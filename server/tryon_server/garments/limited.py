"""A child process that can't take the server down: bounded in time and in address space."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence

import msgspec

from tryon_server.problems import ProblemError, problem_error

STARTUP_SECONDS = 20.0  # importing the solver's geometry from a cold disk, on top of the time allowed for the work


class Limits(msgspec.Struct, frozen=True, kw_only=True):
    """What a child may use: wall time [s] of its work, and address space [bytes]."""

    seconds: float
    address_space: int


def run_limited(module: str, arguments: Sequence[str], content: bytes, limits: Limits, what: str) -> bytes:
    """Run ``python -m module arguments`` with ``content`` on its standard input; its standard output.

    The module applies the limits to itself with ``apply_limits`` before it reads anything, and the parent ends it when
    it stays longer than the allowed time.

    Raises:
        ProblemError: 422, the child overran a limit or broke down; ``what`` names the work in the message.
    """
    command = [sys.executable, "-m", module, *arguments]
    try:
        done = subprocess.run(
            command, input=content, capture_output=True, timeout=limits.seconds + STARTUP_SECONDS, check=False
        )
    except subprocess.TimeoutExpired as error:
        raise _too_complex(f"{what} took more than {limits.seconds:g} s") from error
    if done.returncode == 0:
        return done.stdout
    raise _too_complex(f"{what} used more than {limits.address_space / 2**30:.1f} GiB or broke down") from RuntimeError(
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


def _too_complex(message: str) -> ProblemError:
    return problem_error(
        "pattern.too_complex",
        message,
        "Give the panels the size of a garment (check units_in_meter) and fewer edges, and upload it again",
        status=422,
    )
