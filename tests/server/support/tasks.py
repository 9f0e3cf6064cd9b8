"""Tasks for a process beside: by name, so that they can travel there."""

import os
import time

from tryon_server.problems import problem_error


def double(number):
    return 2 * number


def length(data):
    return len(data)


def refuse():
    raise problem_error("pattern.invalid", "it is crooked", "Draw it straight", place="panels.front")


def fail():
    raise RuntimeError("a screw is loose")


def die():
    os._exit(3)


def wait(path):
    """Writes the number of the process into this file and then does nothing for a long while."""
    path.write_text(str(os.getpid()))
    time.sleep(600.0)


def hoard(size):
    kept = bytearray(b"x") * size
    time.sleep(600.0)
    return len(kept)
