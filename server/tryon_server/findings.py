"""What is found out about files that say little themselves: motions, bodies that move, prints. In metres, seconds."""

from __future__ import annotations

import msgspec


class MotionFacts(msgspec.Struct, frozen=True, kw_only=True):
    """A BVH file as it is played.

    Attributes:
        seconds: how long it lasts.
        fps: frames a second.
        frame_count: how many frames it has.
        units: what its lengths are in.
        up: the axis that is up in its poses: ``Y``, ``Z``, ``-Y``, ...
        joints_mapped: part of the body -> joint of the file that moves it.
        joints_unused: joints of the file that move nothing.
        notes: all of this, and what was done about it, for people.
    """

    seconds: float
    fps: float
    frame_count: int
    units: str
    up: str
    joints_mapped: dict[str, str]
    joints_unused: tuple[str, ...]
    notes: tuple[str, ...]


class BodyFacts(msgspec.Struct, frozen=True, kw_only=True):
    """A body that came as a mesh, ready to be worn on.

    Attributes:
        seconds: how long its frames last; 0 for one that stands still.
        frame_count: how many frames it has.
        vertex_count: vertices of its surface after repair and remeshing.
        notes: how it was read and what was mended, for people.
    """

    seconds: float
    frame_count: int
    vertex_count: int
    notes: tuple[str, ...]


class PrintFacts(msgspec.Struct, frozen=True, kw_only=True):
    """A picture that can be printed on cloth.

    Attributes:
        kind: its MIME type.
        pixels: along its width and height.
        size: of it on the cloth, width and height.
    """

    kind: str
    pixels: tuple[int, int]
    size: tuple[float, float]
