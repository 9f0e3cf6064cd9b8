"""Cases in processes of their own, several at once."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from case import Case, LiveCase
from table import name_of

PROOF = Path(__file__).resolve().parents[1]


@dataclass(frozen=True)
class Pool:
    """`jobs` processes at once; each writes `out`/NAME.json, and what it prints into NAME.log beside it."""

    out: Path
    jobs: int
    options: tuple[str, ...] = ()

    def run(self, cases: Sequence[Case | LiveCase]) -> list[dict[str, Any]]:
        """The results in the order of the cases; each is told of as it comes."""
        waiting = list(cases)
        running: dict[subprocess.Popen[bytes], Case | LiveCase] = {}
        results: dict[Case | LiveCase, dict[str, Any]] = {}
        while waiting or running:
            while waiting and len(running) < self.jobs:
                case = waiting.pop(0)
                running[self.start(case)] = case
            time.sleep(0.2)
            for process in [p for p in running if p.poll() is not None]:
                case = running.pop(process)
                result = results[case] = self.outcome(case, process.returncode)
                said = [b["line"] for b in result.get("broken", ())] + [result["failure"]] * bool(result["failure"])
                print(f"{name_of(result)}: {'; '.join(said) or 'kept every limit'}", flush=True)
        return [results[case] for case in cases]

    def start(self, case: Case | LiveCase) -> subprocess.Popen[bytes]:
        """A process with one thread."""
        (self.out / f"{case.name}.json").unlink(missing_ok=True)
        command = [sys.executable, str(PROOF), "--one", json.dumps(case.plain()), "--out", str(self.out)]
        threads = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        with (self.out / f"{case.name}.log").open("wb") as log:
            return subprocess.Popen(
                [*command, *self.options], stdout=log, stderr=subprocess.STDOUT, env={**threads, **os.environ}
            )

    def outcome(self, case: Case | LiveCase, status: int) -> dict[str, Any]:
        """What a process wrote; a failure with its last words when it wrote nothing."""
        written = self.out / f"{case.name}.json"
        if status == 0 and written.exists():
            return dict(json.loads(written.read_text()))
        said = (self.out / f"{case.name}.log").read_text(errors="replace").strip().splitlines()
        return {"case": case.plain(), "failure": said[-1] if said else f"exit status {status}"}
