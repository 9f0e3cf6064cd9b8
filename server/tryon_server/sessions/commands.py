"""What a session tells its simulation. Of each kind only the newest counts: an unread one gives way to the next."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tryon_protocol import Skeleton, TrackedPose


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
    """Simulate, or hold still without any work of the solver."""

    running: bool


@dataclass(frozen=True)
class MotionFile:
    """Where the file of an uploaded motion is, in which unit it is to be read, and which axis the person faces along in
    its first frame; None for what is found."""

    path: str
    units: str | None
    facing: str | None = None


@dataclass(frozen=True)
class FollowMotion:
    """Move the body by this recorded motion; None: by the poses of a stream. ``file`` of one that was uploaded."""

    motion: str | None
    file: MotionFile | None = None


@dataclass(frozen=True)
class WearFabric:
    """Dress the garment anew in this fabric."""

    fabric: str


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


Command = UsePose | UseTrackedPose | Run | FollowMotion | WearFabric | AllowFrame
