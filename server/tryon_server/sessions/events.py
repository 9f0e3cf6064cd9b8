"""What a simulation tells its session."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from tryon_protocol import DesignMessage, EffectsMessage, EncodedFrame, ReportMessage
from tryon_server.sessions.commands import EditStep

Phase = Literal["preparing", "dressing", "ready", "failed"]


@dataclass(frozen=True)
class PhaseChanged:
    """What the simulation is doing: ``detail`` in a sentence for people, ``progress`` 0 to 1 when known; of one that is
    ready: how far what is put on next is.

    Of a dressed garment: ``fit``, what there is to say about it, ``fitting_size``, the size that would fit if another
    one does, ``notes``, how garment and body were read, and ``worn_size``, that of its pattern.
    """

    phase: Phase
    detail: str
    progress: float | None = None
    fit: str = ""
    fitting_size: float | None = None
    notes: tuple[str, ...] = ()
    worn_size: float | None = None


@dataclass(frozen=True)
class TopologyReady:
    """The garment is dressed: its topology's number, the encoded message with and without compressed arrays, the names
    of the joints that a pose must have, and whether a body with these joints can follow trackers."""

    topology_id: int
    payload: bytes
    plain_payload: bytes
    joint_names: tuple[str, ...]
    followable: bool = False


@dataclass(frozen=True)
class FrameReady:
    """One state of the garment in the forms that were asked for; all of them have the same seq.

    Attributes:
        topology_id: what it refers to.
        shared: for everybody who holds what it needs.
        standalone: the same state in a form that needs no other frame, or None.
        plain: the same state without compression, or None.
    """

    topology_id: int
    shared: EncodedFrame
    standalone: EncodedFrame | None = None
    plain: EncodedFrame | None = None


@dataclass(frozen=True)
class Reported:
    """What the solver did lately."""

    report: ReportMessage


@dataclass(frozen=True)
class Troubled:
    """Something went wrong in the simulation, which goes on: a step that failed, a motion that can't be read."""

    code: str
    place: str
    message: str
    remedy: str


@dataclass(frozen=True)
class Designed:
    """The pattern as it is worn, and the fabric that it names."""

    design: DesignMessage
    fabric: str


@dataclass(frozen=True)
class FabricWorn:
    """The garment that is edited, a mesh, is of this fabric: the one that was asked for, or that it was of before."""

    fabric: str


@dataclass(frozen=True)
class EditMade:
    """A change of the pattern that is to be kept has been made.

    Attributes:
        ticket: of the command that asked for it.
        step: what it was.
        id: of the edit that was made, taken back or made again.
        last: of the edit that is the last one now; 0 for none.
        change: ``value`` where the triangles stay, else ``topology``.
        edit: of a new edit, plain JSON.
        mirror: of a new edit, whether it was made on both sides.
        specification: of a new edit, the pattern that it made, plain JSON.
        garment: which one of those that are worn; "" of one without a name.
        notes: what happened besides, for people.
    """

    ticket: int
    step: EditStep
    id: int
    last: int
    change: Literal["value", "topology"]
    edit: Mapping[str, Any] | None = None
    mirror: bool = False
    specification: Mapping[str, Any] | None = None
    garment: str = ""
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class TakenOn:
    """The garment of this name, which is worn, has taken on the pattern that was kept last: a change that was answered
    is worn from the next frame on, but its shape is come to in some more of them."""

    garment: str


@dataclass(frozen=True)
class EditRefused:
    """A change of the pattern can't be made: nothing has changed. ``ticket`` as in EditMade; 0 of one that was held."""

    ticket: int
    place: str
    message: str
    remedy: str


Doing = Literal["waiting", "remeshing", "building", "dressing", "settling"]
"""What is done for a change of the pattern that is not worn yet: nothing, others are made first; its mesh is made; that
is put on where the garment is worn; or the garment is put on anew; and brought to where the body is."""


@dataclass(frozen=True)
class ChangeUnderWay:
    """A change of the pattern that is not worn yet: the ticket of its command, what is done for it, the same for
    people, and how much of that is done, 0 to 1; None: not known."""

    ticket: int
    doing: Doing
    detail: str = ""
    progress: float | None = None


@dataclass(frozen=True)
class ChangesTold:
    """The changes of the pattern that the simulation works at, in their order, as that stands now."""

    changes: tuple[ChangeUnderWay, ...]


@dataclass(frozen=True)
class EffectsTold:
    """The effects as they are now.

    Attributes:
        effects: what clients are told.
        wishes: what was asked for, to be kept: plain JSON.
        answers: tickets of commands that are done with this.
    """

    effects: EffectsMessage
    wishes: Mapping[str, Any]
    answers: tuple[int, ...] = ()


@dataclass(frozen=True)
class EffectRefused:
    """An effect can't be as it was asked for: nothing has changed. ``ticket`` of the command that asked."""

    ticket: int
    place: str
    message: str
    remedy: str


@dataclass(frozen=True)
class PresetInForce:
    """Frames are solved with ``preset``, which is what ``asked`` asks for, as in BuyAccuracy; "" before any are."""

    preset: str = ""
    asked: str | None = None


@dataclass(frozen=True)
class PresetRefused:
    """What is worn could not come to be solved with the preset ``asked``, and goes on with ``kept``, both as in
    BuyAccuracy."""

    asked: str | None
    kept: str | None
    message: str
    remedy: str


@dataclass(frozen=True)
class OutfitWorn:
    """The outfit of the command with this ticket is worn; for it garments of the names ``again`` were taken off and put
    on again."""

    ticket: int
    again: tuple[str, ...] = ()


@dataclass(frozen=True)
class OutfitRefused:
    """It can't be worn: what was worn is worn on. The rest as in EditRefused."""

    ticket: int
    place: str
    message: str
    remedy: str


@dataclass(frozen=True)
class Gone:
    """The simulation's process has ended without being asked to."""

    detail: str


Event = (
    PhaseChanged
    | TopologyReady
    | FrameReady
    | Reported
    | Troubled
    | Designed
    | FabricWorn
    | EditMade
    | TakenOn
    | EditRefused
    | ChangesTold
    | EffectsTold
    | EffectRefused
    | PresetInForce
    | PresetRefused
    | OutfitWorn
    | OutfitRefused
    | Gone
)
