"""Checks one uploaded motion, body or print; the body of the child process of an upload, as of a garment's.

What a session does with the file later is done here once, by the same code, so that what is wrong is said at once.
"""

from __future__ import annotations

import os
import sys
import tempfile
import traceback
from pathlib import Path

import msgspec

from tryon_server.findings import BodyFacts, MotionFacts, PrintFacts
from tryon_server.garments.limited import apply_limits, run_child, unforeseen
from tryon_server.looks.picture import read_picture
from tryon_server.problems import Problem, ProblemError
from tryon_server.unused import note_unused
from tryon_server.wording import as_parameters, in_parameters


class Telling(msgspec.Struct, frozen=True, kw_only=True):
    """What was told about a file with it; None is to be found out."""

    kind: str
    name: str
    units: str | None = None
    up: str | None = None
    fps: float | None = None
    animation: str | None = None
    facing: str | None = None
    joints: dict[str, str] | None = None
    width: float | None = None


class UploadReply(msgspec.Struct, frozen=True, kw_only=True):
    """Either facts or a problem with the HTTP status that fits; ``trace`` is the traceback of one nobody thought of."""

    motion: MotionFacts | None = None
    body: BodyFacts | None = None
    print: PrintFacts | None = None
    problem: Problem | None = None
    status: int = 200
    trace: str = ""


def check(content: bytes, told: Telling) -> UploadReply:
    """Read a file as what it is said to be; never raises on account of its content."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "body"  # without an ending, as it is kept: what it is is found in it
        try:
            if told.kind == "motion":
                return UploadReply(motion=check_motion(content, told))
            if told.kind == "print":
                return UploadReply(print=check_print(content, told))
            path.write_bytes(content)
            return UploadReply(body=check_body(path, told))
        except ProblemError as error:
            return UploadReply(problem=in_parameters(error.problem), status=error.status)
        except MemoryError:
            raise  # told by the parent as what it is
        except Exception as error:
            why = f"{type(error).__name__}: {error}".replace(str(path), told.name)
            fault = unforeseen(f"checking the {told.kind}", why)
            return UploadReply(problem=fault.problem, status=fault.status, trace=traceback.format_exc())


def check_motion(content: bytes, told: Telling) -> MotionFacts:
    """Read a BVH file and have the default body do what it says. Raises ProblemError."""
    from tryon_server.runtime.bodies import load_body
    from tryon_server.runtime.motions import closing_note, read_clip
    from tryon_server.sessions.commands import MotionReading

    reading = MotionReading(told.units, told.up, told.facing, told.joints)
    motion, facts = read_clip(content, told.name, load_body(None), reading)
    notes = (*facts.notes, *filter(None, [closing_note(motion)]))  # a session repeats it
    return msgspec.structs.replace(facts, notes=tuple(as_parameters(note) for note in notes))


def check_body(path: Path, told: Telling) -> BodyFacts:
    """Read a body that is a mesh and make it ready to be worn on. Raises ProblemError."""
    from tryon_server.runtime.bodies import kind_of_body, load_moving_mesh
    from tryon_server.runtime.order import MeshReading

    reading = MeshReading(told.units, told.up, told.fps, told.animation, told.facing)
    body = load_moving_mesh(path, reading, told.name)
    unused = note_unused("body", kind_of_body(path), {"fps": told.fps})
    assert body is not None
    sequence = body.sequence
    return BodyFacts(
        seconds=sequence.duration,
        frame_count=sequence.frame_count,
        vertex_count=sequence.vertex_count,
        notes=tuple(as_parameters(note) for note in (*body.notes, *unused)),
    )


def check_print(content: bytes, told: Telling) -> PrintFacts:
    """Read a picture that is to be so wide on the cloth. Raises ProblemError."""
    assert told.width is not None
    picture = read_picture(content)
    size = (told.width, told.width * picture.height / picture.width)
    return PrintFacts(kind=picture.kind, pixels=(picture.width, picture.height), size=size)


def main() -> None:
    """Entry of the child: arguments are the limits in seconds and in bytes, then a ``Telling`` in JSON."""
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = "1"  # each thread of a BLAS reserves address space
    os.environ["CUDA_VISIBLE_DEVICES"] = ""  # so does each device
    apply_limits(float(sys.argv[1]), int(sys.argv[2]))
    told = msgspec.json.decode(sys.argv[3], type=Telling)
    output, sys.stdout = sys.stdout, sys.stderr  # Warp says hello where it can
    reply = check(sys.stdin.buffer.read(), told)
    output.buffer.write(msgspec.json.encode(reply))


if __name__ == "__main__":
    run_child(main)
