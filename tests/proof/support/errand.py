"""A part of the proof that is a program of its own: it says what it found and ends with 1 where a limit broke."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[3]
SCENES = ("damped square", "square", "sleeve", "strip below mu", "strip above mu", "sheets")  # of tests/reference
LONG_RUN = "300"  # frames
VERIFICATION = "tests/solver/verification"
# momentum in free flight; turned, shifted, mirrored, CPU against CUDA where there is one; physics of closed forms
SHOWN_BY_TESTS = ("free_flight", "symmetries", "hanging_strip", "oscillation", "coulomb", "reference_closed_forms")
WARPS_OWN = ("Module ", "Warp ", " ")  # lines about kernels and devices begin so


@dataclass(frozen=True)
class Errand:
    """A command to run from the project's folder, and what to set in its environment."""

    name: str
    command: tuple[str, ...]
    environment: tuple[tuple[str, str], ...] = ()

    def result(self, status: int, log: str) -> dict[str, Any]:
        """As a case's: what it printed, and a failure when it ended with another status than 0."""
        lines = [line for line in log.splitlines() if line.strip() and not line.startswith(WARPS_OWN)]
        failure = "" if status == 0 else f"exit status {status}: {lines[-1] if lines else 'it said nothing'}"
        return {"errand": self.name, "said": lines, "failure": failure}


def reference_scenes(out: Path) -> list[Errand]:
    """Each contact scene held to full Newton in float64."""
    return [
        Errand(
            f"reference, {scene}",
            (sys.executable, "tests/reference", "--scenes", scene, "--out", str(out / f"reference-{scene}.md")),
        )
        for scene in SCENES
    ]


def long_determinism() -> Errand:
    """Runs of one scene held to each other, byte by byte, over 300 frames."""
    return Errand(
        f"equal bytes over {LONG_RUN} frames", pytest_of("determinism"), (("TRYON_FRAMES", LONG_RUN),)
    )


def momentum_symmetries_and_closed_forms() -> Errand:
    """What holds for any right solver, shown by tests."""
    return Errand("momentum, symmetries, closed forms", pytest_of(*SHOWN_BY_TESTS))


def pytest_of(*names: str) -> tuple[str, ...]:
    """The command that runs these files of the solver's verification."""
    files = (f"{VERIFICATION}/test_{name}.py" for name in names)
    return (sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *files)
