"""In which of its frames a body that moves by itself is dressed.

In the first, if the garment goes on there: the motion begins with it. A person who is recorded in mid-motion, though,
often begins with the arms on the trunk, crossed, or in a stride, and what is then said of the garment, that it is too
tight, is not what is wrong. So where it is refused in a stance that is not fit for dressing (stance.py), the first
frame that is as open as an A pose, or else the most open one that is fit, takes its place; the body is led back from
there through its own frames (body/lead_back.py). Where no frame is, the refusal says that it is the pose. Ours.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TypeVar

import numpy as np

from tryon_solver.body.mesh_sequence import Moment
from tryon_solver.body.on_device import WornBody
from tryon_solver.dressing.dress import Progress, tell_nobody
from tryon_solver.dressing.fit import DressingError, StanceError
from tryon_solver.dressing.stance import Covered, Held, Skin
from tryon_solver.files.mesh_body import MeshBody
from tryon_solver.files.raw_mesh import MeshFileError
from tryon_solver.geometry.placement import PlacementError

GOOD = 0.5  # of the strain that dressing takes: with no more it is not the stance that a garment is refused for
OPEN = 0.15  # the rank of a frame than which none better is looked for
FIT = 1.0
BETTER = 0.5  # of the strain of before: for less it is not worth trying again
LOOK_EVERY = 0.1  # s, frames are looked at so far apart
MOST_LOOKED_AT = 150

A_POSE = (
    "Give the body in a stance fit for dressing: upright, with the arms away from the trunk and the legs apart, as in "
    "an A pose"
)
A_POSE_FRAME = (
    "Begin with a frame, or add one anywhere, in which the person stands upright with the arms away from the trunk and "
    "the legs apart, as in an A pose: the garment is put on there, and the body led from there to its first frame"
)

Worn = TypeVar("Worn")


class FittingRoom:
    """A body, in the stance in which a garment is to be put on."""

    def __init__(
        self, body: WornBody, covered: Covered, moving: MeshBody | None = None, progress: Progress = tell_nobody
    ) -> None:
        """`moving` is the body as it was read, where it came as a mesh, `body` then its sequence.

        Raises MeshFileError when it stands in none of the frames that are looked at.
        """
        self.body = body
        self.moving = moving
        self.frame = 0
        self.note = ""
        self._covered = covered
        self._read = moving
        self._progress = progress
        self._worn = False
        self._looked = False
        self._skin = Skin(np.asarray(body.rest_vertices, np.float64), np.asarray(body.faces))
        self._held: Held | None = None
        if moving is not None:
            try:
                self._stand_in(moving, 0)
            except MeshFileError as error:
                if not self._moved(np.inf, f"in the first frame {error.message}"):
                    raise

    def look_ahead(self) -> None:
        """Change to a frame that is fit for dressing at once, if the present one is not: for who tries many sizes."""
        held = self._now()
        if held.strain > FIT:
            self._moved(held.strain, f"in the first frame {held.describe()}")

    def put_on(self, wear: Callable[[WornBody], Worn]) -> Worn:
        """The garment as `wear` puts it on a body; in another frame where it is refused in one that is not fit for it.

        Raises what `wear` raises, and StanceError where the likely cause is how the body is held.
        """
        try:
            worn = wear(self.body)
        except (DressingError, PlacementError) as error:
            if self.frame:
                where = f"in frame {self.frame + 1}, in which the body is held fit for it, {error.message}"
                raise type(error)(where, error.place, error.remedy) from error
            if self._worn or (self._read is not None and self._read.cut_off):
                raise
            held = self._now()
            why = held.describe() or error.message
            if held.strain > GOOD and self._moved(held.strain, f"in the first frame {why}"):
                return self.put_on(wear)
            if held.strain <= FIT:
                raise
            raise self._refusal(error, held) from error
        self._worn = True
        return worn

    def _refusal(self, error: DressingError | PlacementError, held: Held) -> StanceError:
        frames = 1 if self._read is None else self._read.sequence.frame_count
        message = f"the likely cause is how the body is held, not the size: {held.describe()}"
        if frames > 1:
            message += f", and in none of its {frames} frames that were looked at is it held fit for dressing"
        return StanceError(f"{message}; as it is, {error.message}", "body", A_POSE_FRAME if frames > 1 else A_POSE)

    def _now(self) -> Held:
        if self._held is None:
            surface = self.body.surface(self.body.start())
            self._held = self._skin.held(surface, self._covered)
        return self._held

    def _stand_in(self, read: MeshBody, frame: int) -> None:
        self.moving = read.for_patterns(frame)
        self.body = self.moving.sequence

    def _moved(self, strain: float, why: str) -> bool:
        """Whether there is a frame that is fit, and much more so than one of that strain; then it is changed to."""
        read = self._read
        if read is None or self._looked:
            return False
        self._looked = True
        chosen: tuple[float, int] | None = None
        for frame, held in self._others(read):
            fit = held.strain_to_choose <= min(FIT, BETTER * strain)
            if fit and (chosen is None or held.rank < chosen[0]):
                chosen = held.rank, frame
                if held.rank <= OPEN:
                    break
        if chosen is None:
            return False
        frame, count = chosen[1], read.sequence.frame_count
        self._stand_in(read, frame)
        self._held, self.frame = None, frame
        self.note = (
            f"dressed in frame {frame + 1} of {count}, at {frame * read.sequence.dt:.2f} s, in which it is held fit "
            f"for it, then led to frame 1, backwards through its own frames ({why})"
        )
        return True

    def _others(self, read: MeshBody) -> Iterator[tuple[int, Held]]:
        """Frames after the first in which the body stands, in their order, and how it is held there."""
        sequence = read.sequence
        step = max(1, round(LOOK_EVERY / sequence.dt), -(-sequence.frame_count // MOST_LOOKED_AT))
        for frame in range(step, sequence.frame_count, step):
            self._progress("looking", frame / sequence.frame_count)
            x = sequence.surface(Moment(frame * sequence.dt, np.zeros(3)))
            try:
                stand = read.stand(x)
            except MeshFileError:
                continue
            yield frame, self._skin.held(x @ stand.turn.T + stand.shift, self._covered)
