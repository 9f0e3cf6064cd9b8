"""A simulation that is recorded instead of streamed: every frame is solved, however long it takes."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tryon_server.looks.glb import Part, glb
from tryon_server.looks.surface import Finish, Surface, surface_of
from tryon_server.problems import ProblemError, problem_error
from tryon_server.runtime.bodies import kind_of_body, load_body, moves_itself
from tryon_server.runtime.drape import Drape, Progress
from tryon_server.runtime.kernel_news import kernel_news
from tryon_server.runtime.motions import closing_note, read_motion
from tryon_server.runtime.order import DrapeOrder
from tryon_server.runtime.production import build_drape
from tryon_server.runtime.solver_drape import SolverDrape
from tryon_server.runtime.sources import approach_seconds, leap_towards, moved
from tryon_server.sessions.commands import MotionReading
from tryon_server.unused import refuse_unused
from tryon_solver.body.lead_back import LeadBack
from tryon_solver.body.motion import Motion, blend_in
from tryon_solver.files.garment_file import is_mesh

LOWEST_FPS = 11.0  # the solver bridges at most 0.1 s at a time
MOST_BYTES = 4 * 2**30  # a recording is held in memory until it is written
REPORT_BYTES = 2000  # of one frame's report, about
COORDINATES_BYTES = 12  # of a vertex in a frame: three float32
STILL = ("mesh", "glb")  # kinds of bodies that no motion moves
STILL_SECONDS = 2.0  # how long a body without a motion is simulated when nobody says how long


@dataclass(frozen=True, eq=False)
class Recording:
    """Frames of a garment on a body. Metres and seconds.

    Attributes:
        cloth: (frames, N, 3) float32, the cloth; frame 0 is the dressed garment in the motion's first pose.
        cloth_faces: (F, 3) int32.
        body: (frames, B, 3) float32, the body's surface as simulated.
        body_faces: (F', 3) int32.
        dt: time between frames [s].
        reports: what the solver reported on the way to each frame but the first.
        notes: what was found in files that say little themselves, and what was done about it.
        cloth_uv: (F, 3, 2) float32 m, pattern coordinates of each corner; None where there is nothing to draw on it.
        cloth_panels: (F,) int32, the pattern's piece of each triangle.
        surface: what the cloth looks like.
    """

    cloth: npt.NDArray[np.float32]
    cloth_faces: npt.NDArray[np.int32]
    body: npt.NDArray[np.float32]
    body_faces: npt.NDArray[np.int32]
    dt: float
    reports: tuple[dict[str, Any], ...]
    notes: tuple[str, ...] = ()
    cloth_uv: npt.NDArray[np.float32] | None = None
    cloth_panels: npt.NDArray[np.int32] | None = None
    surface: Surface | None = None

    def advice(self) -> list[str]:
        """What the solver advised in the frames with the most stretch, body lag and void steps; none: [].

        Each line says how many frames brought advice, and of which moment it speaks.
        """
        given = [(k, report) for k, report in enumerate(self.reports, start=1) if report["advice"]]
        if not given:
            return []
        figures = ["max_stretch", "body_lag"]
        if any(report["retries"] for _, report in given):
            figures.append("retries")
        worst = {max(given, key=lambda frame: frame[1][figure])[0] for figure in figures}
        said = [f"{len(given)} of {len(self.reports)} frames were out of bounds, for example"]
        return said + [f"  at {k * self.dt:.2f} s: {self.reports[k - 1]['advice']}" for k in sorted(worst)]

    def save(self, path: Path) -> None:
        """Write an .npz, an array per attribute but those of the looks; ``reports`` and ``notes`` are JSON. It appears
        whole or not at all."""
        arrays = {name: getattr(self, name) for name in ("cloth", "cloth_faces", "body", "body_faces")}
        draft = path.with_name(f".{path.name}.{os.getpid()}")
        try:
            with draft.open("wb") as file:
                reports, notes = np.array(json.dumps(self.reports)), np.array(json.dumps(self.notes))
                np.savez_compressed(file, **arrays, dt=np.float64(self.dt), reports=reports, notes=notes)
            draft.replace(path)
        except OSError as error:
            raise _unwritable(path, error) from error

    def save_glb(self, path: Path) -> None:
        """Write the last frame as a .glb scene of two meshes, ``cloth`` in its fabric and ``body``."""
        cloth = Part("cloth", self.cloth[-1], self.cloth_faces, self.cloth_uv, self.cloth_panels, self.surface)
        try:
            path.write_bytes(glb([cloth, Part("body", self.body[-1], self.body_faces)]))
        except OSError as error:
            raise _unwritable(path, error) from error


def simulate(
    order: DrapeOrder,
    motion: str | None,
    seconds: float | None,
    fps: float,
    progress: Progress,
    motion_reading: MotionReading = MotionReading(),  # noqa: B008
    finish: Finish = Finish(),  # noqa: B008
) -> Recording:
    """Dress the garment and record it.

    Args:
        order: garment, fabric, body, accuracy and device.
        motion: a BVH file or the name of a motion that comes with the server; None for a body that stands still.
        seconds: how long to record; None for the motion's length. A motion that is shorter begins again.
        fps: frames per second, 1/``fps`` s apart.
        progress: told what is being done.
        motion_reading: what is told about a BVH file.
        finish: what is done to the fabric's looks.

    Raises:
        ProblemError: something does not fit; names the place and the remedy.
    """
    if fps < LOWEST_FPS:
        raise _out_of_range("fps", f"{fps:g} frames per second are too few", f"Give at least {LOWEST_FPS:g}")
    _refuse_what_has_no_use(order, motion, motion_reading)
    if seconds is not None:
        _check_size(seconds, fps, 0)
    played: Motion | None = None
    found: tuple[str, ...] = ()
    if motion is not None:
        still = kind_of_body(order.body) in STILL
        body = load_body(None if still else order.body)
        played, facts = read_motion(motion, body, motion_reading)  # what is wrong is said at once
        if still:
            why = "the body is a mesh that stands still: it has no joints that a motion could move"
            raise problem_error("motion.of_mesh", why, "Leave --motion out, or --body", place="motion")
        found = facts.notes
    with kernel_news(lambda what: progress(what, None)):
        drape = build_drape(order, progress)
        own = drape.own_motion
        if own is not None and own.duration > 0:
            seconds = own.duration if seconds is None else seconds
            if seconds > own.duration + 1e-9:
                raise _out_of_range("seconds", f"the body's frames last {own.duration:.2f} s", "Ask for no more")
            back = LeadBack(own, own.dressed_at)
            _lead(drape, back.sample, back.duration, fps, progress)
            return _record(drape, back.duration, own.sample, seconds, fps, progress, finish)
        if played is None:
            seconds = STILL_SECONDS if seconds is None else seconds
            return _record(drape, 0.0, lambda _t: drape.pose, seconds, fps, progress, finish)
        seconds = played.duration if seconds is None else seconds
        loop = seconds > played.duration + 1e-9
        if loop:
            found = (*found, *filter(None, [closing_note(played)]))
        leap = leap_towards(drape.pose, played.pose(0))
        drape.leap(leap)
        start = moved(drape.pose, leap)
        lead = blend_in(start, played, approach_seconds(start, played.pose(0)))
        _lead(drape, lead.sample, lead.duration, fps, progress)
        sample = partial(played.sample, loop=loop)
        recording = _record(drape, lead.duration, sample, seconds, fps, progress, finish)
        return replace(recording, notes=(*(f"motion: {note}" for note in found), *recording.notes))


def _refuse_what_has_no_use(order: DrapeOrder, motion: str | None, motion_reading: MotionReading) -> None:
    """Raises ProblemError for a motion or an option that garment or body have no use for."""
    if motion is not None and moves_itself(order.body):
        raise problem_error(
            "motion.two", "the body is a moving mesh, which brings its motion", "Leave --motion out", place="motion"
        )
    refuse_unused("garment", _kind_of_garment(order.pattern), vars(order.reading))
    refuse_unused("body", kind_of_body(order.body), vars(order.body_reading))
    refuse_unused("motion", "none" if motion is None else "file", vars(motion_reading))


def _kind_of_garment(path: Path) -> str | None:
    """``mesh`` or ``pattern``; None for what is left to be told by who reads it next."""
    try:
        content = path.read_bytes()
    except OSError:
        return None
    return "mesh" if is_mesh(content) else "pattern" if content.lstrip()[:1] == b"{" else None


def _lead(
    drape: SolverDrape, pose_at: Callable[[float], Any], seconds: float, fps: float, progress: Progress
) -> None:
    """Take the drape, as it was dressed, into the pose in which the recording begins, ``seconds`` s later."""
    steps = math.ceil(seconds * fps)
    for k in range(1, steps + 1):
        progress("Moving into the first pose", k / steps)
        t = seconds * k / steps
        _advance(drape, pose_at(t), t)


def _record(
    drape: SolverDrape,
    began: float,
    pose_at: Callable[[float], Any],
    seconds: float,
    fps: float,
    progress: Progress,
    finish: Finish,
) -> Recording:
    """Record from the drape's present state on, ``began`` s after its dressing."""
    cloth_count, body_count = drape.outfit.vertex_count, len(drape.outfit.body.rest_vertices)
    count = _check_size(seconds, fps, cloth_count + body_count)
    cloth, body = np.empty((count, cloth_count, 3), np.float32), np.empty((count, body_count, 3), np.float32)
    reports = []
    for k in range(count):
        if k > 0:
            progress("Simulating", (k - 1) / (count - 1))
            reports.append(_advance(drape, pose_at(k / fps), began + k / fps))
        cloth[k] = drape.cloth_positions() + drape.origin
        body[k] = drape.body_positions() + drape.origin
    progress("Simulating", 1.0)
    fabric = drape.simulation.scene.fabric
    return Recording(
        cloth=cloth,
        cloth_faces=np.asarray(drape.outfit.faces, dtype=np.int32),
        body=body,
        body_faces=np.asarray(drape.outfit.body.faces, dtype=np.int32),
        dt=1.0 / fps,
        reports=tuple(reports),
        notes=drape.notes,
        cloth_uv=np.asarray(drape.outfit.uv, dtype=np.float32),
        cloth_panels=np.asarray(drape.outfit.panel_of_face, dtype=np.int32),
        surface=surface_of(fabric.name, fabric.look, finish),
    )


def _check_size(seconds: float, fps: float, vertices: int) -> int:
    """How many frames a recording has. Raises ProblemError when so many, of so many vertices, take too much memory."""
    each = COORDINATES_BYTES * vertices + REPORT_BYTES
    size = (seconds * fps + 1) * each
    if size > MOST_BYTES:
        longest = (MOST_BYTES / each - 1) / fps
        raise _out_of_range(
            "seconds",
            f"{seconds:g} s are {seconds * fps:.3g} frames, which take {size / 2**30:.3g} GiB of memory or more, "
            f"over the limit of {MOST_BYTES / 2**30:g} GiB",
            f"Record less than {longest:.0f} s at once, or give a smaller --fps, or a pattern a longer --edge-length",
        )
    return round(seconds * fps) + 1


def _advance(drape: Drape, pose: Any, t: float) -> dict[str, Any]:
    report = dict(drape.advance(pose, t).to_dict())
    if not (np.isfinite(drape.cloth_positions()).all() and np.isfinite(drape.body_positions()).all()):
        raise problem_error(
            "simulation.failed",
            f"a position is not a number {t:.3f} s after the dressing",
            "Report it with the command that led to it; a longer edge length may help meanwhile",
            place="simulation",
        )
    return report


def _out_of_range(place: str, message: str, remedy: str) -> ProblemError:
    return problem_error("option.range", message, remedy, place=place)


def _unwritable(path: Path, error: OSError) -> ProblemError:
    return problem_error("output.unwritable", f"{path} can't be written: {error.strerror}", "Choose another --out")
