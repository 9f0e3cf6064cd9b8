"""Cases and errands in processes of their own, several at once."""

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
from errand import ROOT, Errand
from table import name_of

PROOF = Path(__file__).resolve().parents[1]
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}

Job = Case | LiveCase | Errand


@dataclass(frozen=True)
class Pool:
    """`jobs` processes at once; a case writes `out`/NAME.json, and what each prints goes into NAME.log beside it."""

    out: Path
    jobs: int
    options: tuple[str, ...] = ()

    def run(self, jobs: Sequence[Job]) -> list[dict[str, Any]]:
        """The results in the order of the jobs; each is told of as it comes."""
        waiting = list(jobs)
        running: dict[subprocess.Popen[bytes], Job] = {}
        results: dict[Job, dict[str, Any]] = {}
        while waiting or running:
            while waiting and len(running) < self.jobs:
                job = waiting.pop(0)
                running[self.start(job)] = job
            time.sleep(0.2)
            for process in [p for p in running if p.poll() is not None]:
                job = running.pop(process)
                result = results[job] = self.outcome(job, process.returncode)
                said = [b["line"] for b in result.get("broken", ())] + [result["failure"]] * bool(result["failure"])
                print(f"{name_of(result)}: {'; '.join(said) or 'kept every limit'}", flush=True)
        return [results[job] for job in jobs]

    def start(self, job: Job) -> subprocess.Popen[bytes]:
        """A process with one thread."""
        environment = {**ONE_THREAD, **os.environ}
        if isinstance(job, Errand):
            command, environment = list(job.command), {**environment, **dict(job.environment)}
        else:
            (self.out / f"{job.name}.json").unlink(missing_ok=True)
            one = ["--one", json.dumps(job.plain()), "--out", str(self.out.resolve())]
            command = [sys.executable, str(PROOF), *one, *self.options]
        with self.log(job).open("wb") as log:
            return subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT, env=environment, cwd=ROOT)

    def log(self, job: Job) -> Path:
        """Where a job's words go."""
        return self.out / f"{job.name}.log"

    def outcome(self, job: Job, status: int) -> dict[str, Any]:
        """What a process wrote; a failure with its last words when it wrote nothing."""
        words = self.log(job).read_text(errors="replace").strip()
        if isinstance(job, Errand):
            return job.result(status, words)
        written = self.out / f"{job.name}.json"
        if status == 0 and written.exists():
            return dict(json.loads(written.read_text()))
        said = words.splitlines()
        return {"case": job.plain(), "failure": said[-1] if said else f"exit status {status}"}
