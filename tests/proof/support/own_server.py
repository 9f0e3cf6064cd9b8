"""A server of our own for as long as it is needed: `tryon serve` on a free port, its data in a folder that goes."""

from __future__ import annotations

import contextlib
import re
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

COMMAND = "import sys; from tryon_server.cli import main; sys.exit(main(sys.argv[1:]))"


@contextlib.contextmanager
def own_server(device: str, environment: dict[str, str], log: Path) -> Iterator[str]:
    """Its address, once it listens. Raises RuntimeError with its words when it doesn't start."""
    with tempfile.TemporaryDirectory() as data, log.open("w") as errors:
        options = ["serve", "--port", "0", "--device", device, "--data-dir", data]
        process = subprocess.Popen(
            [sys.executable, "-c", COMMAND, *options], stdout=subprocess.PIPE, stderr=errors, text=True, env=environment
        )
        assert process.stdout is not None
        try:
            said = []
            for line in process.stdout:
                said.append(line)
                found = re.search(r"Open (http://\S+)", line)
                if found:
                    yield found[1]
                    return
            raise RuntimeError("the server did not start: " + "".join(said) + log.read_text())
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(30)
