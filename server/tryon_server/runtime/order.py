"""What is to be simulated, as plain values that can travel to another process."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tryon_server.sessions.commands import MotionFile


@dataclass(frozen=True)
class MeshReading:
    """What is told about a mesh file, which says little itself; None is to be found out.

    Attributes:
        units: ``m``, ``cm``, ``mm``, ``in`` or ``ft``.
        up: the axis that is up, ``y`` or ``z``, of a body ``x`` too.
        fps: frames a second of a sequence.
        animation: which one of a .glb is played, by name.
        facing: the axis of its file that a body faces along: ``x``, ``-x``, ``y``, ``-y``, ``z`` or ``-z``.
        rest_shape: of a garment: ``pattern``, its texture coordinates, or ``shape``, the one it comes in.
    """

    units: str | None = None
    up: str | None = None
    fps: float | None = None
    animation: str | None = None
    facing: str | None = None
    rest_shape: str | None = None


@dataclass(frozen=True)
class DrapeOrder:
    """Which garment is to be draped and how.

    Attributes:
        pattern: file with the garment: a sewing pattern, or a mesh.
        fabric: name of the fabric.
        preset: named accuracy: ``draft``, ``live``, ``fit``, or ``auto`` to choose by the device.
        device: ``cpu``, ``cuda:0``, ...
        edge_length: length of the mesh's edges [m]; None for the preset's.
        garment_name: what its owner calls the garment; None for the name of its file.
        body_name: what its owner calls the body; None for the name of its file.
        specification: of a sewing pattern that was edited since: plain JSON, in place of what is in its file.
        size: of a sewing pattern, over its own; None for the one that fits, which is looked for by trying some on.
        body: file of the body; None for the default body.
        wardrobe: folder where dressed garments are kept for the next time; None to dress anew.
        reading: how to read a garment that is a mesh.
        body_reading: how to read a body that is a mesh.
    """

    pattern: Path
    fabric: str
    preset: str
    device: str
    edge_length: float | None = None
    body: Path | None = None
    wardrobe: Path | None = None
    reading: MeshReading = MeshReading()
    body_reading: MeshReading = MeshReading()
    size: float | None = 1.0
    garment_name: str | None = None
    body_name: str | None = None
    specification: Mapping[str, Any] | None = None


@dataclass(frozen=True)
class Workshop:
    """What a simulation works with, as ``"module:function"``: found in its process, the server needs no solver.

    Attributes:
        build: a ``BuildDrape`` (drape.py).
        load_motion: a ``LoadMotion`` (drape.py).
        compile_effects: makes a task of effects' names and a device, which has their kernels compiled (arming.py).
    """

    build: str = "tryon_server.runtime.production:build_drape"
    load_motion: str = "tryon_server.runtime.motions:load_motion"
    compile_effects: str = "tryon_server.runtime.arming:Compiling"


@dataclass(frozen=True)
class WorkOrder:
    """A drape, what moves it, and how often it is published.

    Attributes:
        drape: what to dress.
        motion: name of the motion that moves the body; None for the poses of a stream. A body that moves by itself
            moves so whatever stands here.
        frames_per_second: most frames published per second of wall time [1/s].
        keyframe_seconds: longest time between frames that stand alone [s].
        motion_file: where the motion is, if it was uploaded.
        effects: what was asked of its effects before, plain JSON (effect_desk.py).
    """

    drape: DrapeOrder
    motion: str | None
    frames_per_second: float
    keyframe_seconds: float
    motion_file: MotionFile | None = None
    effects: Mapping[str, Any] = field(default_factory=dict)
