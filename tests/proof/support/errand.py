"""A part of the proof that is a program of its own: it says what it found and ends with 1 where a limit broke."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[3]
SCENES = ("damped square", "square", "sleeve", "strip below mu", "strip above mu", "sheets")  # of tests/reference
LONG_RUN = "300"  # frames
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
    test = "tests/solver/verification/test_determinism.py"
    return Errand(
        f"equal bytes over {LONG_RUN} frames",
        (sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", test),
        (("TRYON_FRAMES", LONG_RUN),),
    )
