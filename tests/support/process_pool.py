"""Tasks in processes of their own, several at once: each writes a JSON file, and what it prints goes into a log."""

from __future__ import annotations

import json
import os
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

THREADS = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


@dataclass(frozen=True)
class Tasks:
    """`jobs` processes at once; the task NAME writes `out`/NAME.json, its log is `out`/NAME.log."""

    out: Path
    jobs: int
    longest: float = float("inf")  # s: a process that takes longer is ended and has failed

    def run(
        self, commands: Mapping[str, Sequence[str]], told: Callable[[str, dict[str, Any]], None]
    ) -> dict[str, dict[str, Any]]:
        """The results by name, in the order of `commands`; `told` hears of each as it comes."""
        waiting = list(commands)
        running: dict[subprocess.Popen[bytes], tuple[str, float]] = {}
        results: dict[str, dict[str, Any]] = {}
        while waiting or running:
            while waiting and len(running) < self.jobs:
                name = waiting.pop(0)
                running[self._start(name, commands[name])] = (name, time.monotonic())
            time.sleep(0.2)
            for process, (name, begun) in list(running.items()):
                if process.poll() is None and time.monotonic() - begun > self.longest:
                    process.kill()
                    process.wait()
                if process.poll() is not None:
                    del running[process]
                    results[name] = self._outcome(name, process.returncode)
                    told(name, results[name])
        return {name: results[name] for name in commands}

    def _start(self, name: str, command: Sequence[str]) -> subprocess.Popen[bytes]:
        """A process with one thread; what an earlier one wrote is gone."""
        (self.out / f"{name}.json").unlink(missing_ok=True)
        with (self.out / f"{name}.log").open("wb") as log:
            return subprocess.Popen(
                list(command), stdout=log, stderr=subprocess.STDOUT, env={**os.environ, **THREADS}
            )

    def _outcome(self, name: str, status: int) -> dict[str, Any]:
        """What a process wrote; a failure with its last words when it wrote nothing."""
        written = self.out / f"{name}.json"
        if status == 0 and written.exists():
            return dict(json.loads(written.read_text()))
        said = (self.out / f"{name}.log").read_text(errors="replace").strip().splitlines()
        last = said[-1] if said else "it said nothing"
        return {"failure": f"ended with status {status}: {last}"}
