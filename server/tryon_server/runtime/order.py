"""What is to be simulated, as plain values that can travel to another process."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from tryon_server.sessions.commands import MotionFile
from tryon_solver.redesign.history import UNDO_MAX


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
class GarmentOrder:
    """A garment to be worn, under the name ``worn_as`` that no other of its outfit has; the rest as in DrapeOrder."""

    worn_as: str
    pattern: Path
    fabric: str
    specification: Mapping[str, Any] | None = None
    size: float | None = 1.0
    garment_name: str | None = None
    reading: MeshReading = MeshReading()
    edited_from: tuple[Mapping[str, Any], ...] = ()


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
        edited_from: the patterns that edits made of it before that one, the first one first, plain JSON: where it can't
            be put on as it is, it is put on as it was (edited_while_worn.py).
        size: of a sewing pattern, over its own; None for the one that fits, which is looked for by trying some on.
        body: file of the body; None for the default body.
        wardrobe: folder where dressed garments are kept for the next time; None to dress anew.
        reading: how to read a garment that is a mesh.
        body_reading: how to read a body that is a mesh.
        worn_as: the garment's name among those that are worn; "" where nobody asks.
        over: what is put on over it, one after the other.
        edited: which of them is edited, by that name; "" for the outermost.
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
    edited_from: tuple[Mapping[str, Any], ...] = ()
    worn_as: str = ""
    over: tuple[GarmentOrder, ...] = ()
    edited: str = ""

    @property
    def garments(self) -> tuple[GarmentOrder, ...]:
        """All of them, from the innermost outwards."""
        own = {item.name: getattr(self, item.name) for item in fields(GarmentOrder)}
        return (GarmentOrder(**own), *self.over)

    @property
    def of_edited(self) -> GarmentOrder:
        """The garment that is edited."""
        every = self.garments
        return next((one for one in every if one.worn_as == self.edited), every[-1])

    def wearing(self, garments: tuple[GarmentOrder, ...], edited: str = "") -> DrapeOrder:
        """The same with these garments, at least one, from the innermost outwards."""
        first, *over = garments
        own = {item.name: getattr(first, item.name) for item in fields(GarmentOrder)}
        return replace(self, **own, over=tuple(over), edited=edited)

    def with_pattern(
        self, specification: Mapping[str, Any], fabric: str, edited_from: tuple[Mapping[str, Any], ...] = ()
    ) -> DrapeOrder:
        """The same with the edited garment of this pattern and fabric, edited from these."""
        own = self.of_edited
        changed = replace(own, specification=specification, fabric=fabric, edited_from=edited_from)
        return self.wearing(tuple(changed if one is own or one == own else one for one in self.garments), self.edited)


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
class KeptEdit:
    """An edit as it is kept: its number, the edit as plain JSON, the pattern that it made, whether it was taken back.
    The first of a garment's, of number 0, tells the pattern before all of them."""

    id: int
    edit: Mapping[str, Any]
    specification: Mapping[str, Any]
    undone: bool


def undoable(edits: Sequence[int]) -> frozenset[int]:
    """Of edits that were made and not taken back, by their numbers and oldest first, those that can be."""
    return frozenset(edits[-UNDO_MAX:])


@dataclass(frozen=True)
class WorkOrder:
    """A drape, what moves it, and how often it is published.

    Attributes:
        drape: what to dress.
        motion: name of the motion that moves the body; None for the poses of a stream. A body that moves by itself
            moves so whatever stands here.
        frames_per_second: most frames published per second of wall time [1/s].
        keyframe_seconds: longest time between frames that stand alone, while some are published [s].
        motion_file: where the motion is, if it was uploaded.
        effects: what was asked of its effects before, plain JSON (effect_desk.py).
        histories: edits that an earlier session began, by the name their garment is worn as.
        edit_seconds: longest time that an edit may take until it is worn [s].
    """

    drape: DrapeOrder
    motion: str | None
    frames_per_second: float
    keyframe_seconds: float
    motion_file: MotionFile | None = None
    effects: Mapping[str, Any] = field(default_factory=dict)
    histories: Mapping[str, tuple[KeptEdit, ...]] = field(default_factory=dict)
    edit_seconds: float = 120.0
