"""What this machine can simulate on. Asked in a process of its own: the server itself holds no GPU context."""

from __future__ import annotations

import json
import subprocess
import sys

from tryon_server.problems import problem_error
from tryon_server.runtime.interface import Device

QUERY_SECONDS = 120.0


def list_devices() -> tuple[Device, ...]:
    """The devices of this machine, the best one first. Raises ProblemError when the solver can't be started."""
    command = [sys.executable, "-m", "tryon_server.runtime.devices"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=QUERY_SECONDS, check=False)
    if done.returncode != 0:
        last_line = (done.stderr.strip().splitlines() or ["no message"])[-1]
        raise problem_error(
            "solver.unusable",
            f"the solver can't be started: {last_line}",
            "Install it again with make demo, and check the GPU's driver if there is one",
            status=503,
        )
    return tuple(Device(**entry) for entry in json.loads(done.stdout.splitlines()[-1]))


def main() -> None:
    """Body of the process: one line of JSON."""
    from tryon_solver.device import available_devices

    print(json.dumps([{"name": d.name, "description": d.description, "memory": d.memory} for d in available_devices()]))


if __name__ == "__main__":
    main()
