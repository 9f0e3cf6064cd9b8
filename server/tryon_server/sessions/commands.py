"""What a session tells its simulation. Of each kind only the newest counts: an unread one gives way to the next. Edits
that are to be kept all count."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from tryon_protocol import Skeleton, TrackedPose

EditStep = Literal["edit", "undo", "redo"]
HELD = 0  # in place of a ticket, for what is only to be shown
UNASKED = -1  # in place of a ticket: nobody waits for the answer


@dataclass(frozen=True)
class UsePose:
    """The newest pose of a stream: its number, capture time [s, sender's clock], root (3,) [m], rotations (J, 4) xyzw.

    ``stream`` changes with the sender, whose clock and numbers have nothing to do with the one before.
    """

    stream: int
    seq: int
    t_capture: float
    root: npt.NDArray[np.float64]
    rotations: npt.NDArray[np.float64]


@dataclass(frozen=True)
class UseTrackedPose:
    """The newest pose of a tracker, in its own joints: as ``UsePose``, with the coordinate system of its places, the
    skeleton it refers to, how many skeletons that client has sent, and the arrays."""

    stream: int
    seq: int
    t_capture: float
    frame: str
    skeleton: Skeleton
    skeleton_number: int
    pose: TrackedPose


@dataclass(frozen=True)
class Run:
    """Simulate, or hold still without any work of the solver: but where it may ``settle``, as while nobody watches, a
    change of the pattern that is kept is taken on nevertheless, on the body as it stands."""

    running: bool
    settle: bool = True


@dataclass(frozen=True)
class MotionReading:
    """What is told about a BVH file; None is to be found out.

    Attributes:
        units: ``m``, ``dm``, ``asf`` (CMU's), ``in``, ``ft``, ``cm`` or ``mm``.
        up: the axis of the file that is up: ``y``, ``-z``, ...
        facing: the axis of the file that the person faces along in its first frame.
        joints: part of the body -> joint of the file, where names alone don't tell.
    """

    units: str | None = None
    up: str | None = None
    facing: str | None = None
    joints: Mapping[str, str] | None = None


@dataclass(frozen=True)
class MotionFile:
    """Where the file of an uploaded motion is, and how it is to be read."""

    path: str
    reading: MotionReading = MotionReading()


@dataclass(frozen=True)
class FollowMotion:
    """Move the body by this recorded motion; None: by the poses of a stream. ``file`` of one that was uploaded."""

    motion: str | None
    file: MotionFile | None = None


@dataclass(frozen=True)
class WearFabric:
    """Dress the garment anew, of this fabric, while it is worn on; one that is worn by its pattern is changed by
    ``ChangePattern``."""

    fabric: str


@dataclass(frozen=True)
class BuyAccuracy:
    """Solve frames down to an estimated error of ``accuracy`` [m], each in ``deadline`` [s]; None: as the preset has
    it, and in what it takes. The ``preset`` is ``draft``, ``live``, ``fit`` or ``reference``; None: the one that the
    session was opened with."""

    accuracy: float | None = None
    deadline: float | None = None
    preset: str | None = None


@dataclass(frozen=True)
class ChangePattern:
    """Make ``edit`` (plain JSON; None with ``hold``: show what is kept), take the last edit back or make it again.

    ``mirror``: on the symmetric piece, too. ``hold``: show it and keep nothing. ``ticket`` is repeated in the event
    that answers a change which is to be kept.
    """

    step: EditStep
    ticket: int = 0
    edit: Mapping[str, Any] | None = None
    mirror: bool = False
    hold: bool = False
    garment: str = ""


@dataclass(frozen=True)
class WornItem:
    """A garment of an outfit, by its `name` there: the stored garment's id, fabric and `size`, over its pattern's own.
    Its `number` is its own in the session, and no other garment ever has it there."""

    name: str
    garment: str
    fabric: str
    size: float | None
    number: int


@dataclass(frozen=True)
class ChangeOutfit:
    """Wear these garments, from the innermost outwards, and edit the one of this name. ``ticket`` as of ChangePattern.

    ``order`` is how they are dressed; the session does not look into it.
    """

    ticket: int
    items: tuple[WornItem, ...]
    edited: str
    order: Any = None


@dataclass(frozen=True)
class GiveUp:
    """The change of the pattern, or of what is worn, that has this ticket is wanted no more: it is refused, unless it
    can't be stopped any longer."""

    ticket: int


@dataclass(frozen=True)
class ChangeEffect:
    """Have an effect be in this state, with these parameters (plain JSON; None: as they stand).

    ``ticket`` is repeated in the event that answers.
    """

    ticket: int
    name: str
    state: Literal["absent", "armed", "active"]
    parameters: Mapping[str, Any] | None = None


@dataclass(frozen=True)
class MeasureEffects:
    """Find out what each effect takes. ``ticket`` as in ChangeEffect."""

    ticket: int


@dataclass(frozen=True)
class AllowFrame:
    """How many frames may have been encoded and handed over since the session began, and in which forms the next one.

    Attributes:
        total: so many frames in all.
        keyframe: the shared frame shall stand alone, because nobody holds the frame before.
        standalone: make it in a second form that stands alone, for those who missed a frame.
        plain: make it in a form without compression, for those who can't inflate.
        again: somebody lacks the newest state: publish it again if there is no newer one.
    """

    total: int
    keyframe: bool
    standalone: bool
    plain: bool
    again: bool


Command = (
    UsePose
    | UseTrackedPose
    | Run
    | FollowMotion
    | WearFabric
    | BuyAccuracy
    | ChangePattern
    | ChangeEffect
    | MeasureEffects
    | ChangeOutfit
    | GiveUp
    | AllowFrame
)
