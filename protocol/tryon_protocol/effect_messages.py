"""Control messages about the effects of a session's scene: what is asked for, and what there is. PROTOCOL.md section
3.3."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from msgspec import Meta, Struct

from .message_base import Message, Name, Request

AUTO = "auto"
"""In place of an effect's name: those that garment and motion may call for are armed."""


class SetEffectMessage(Message, tag="set_effect", frozen=True, kw_only=True):
    """Have an effect act in the session, change it, or have it armed: its kernels compiled and nothing else.

    Answered by `effects`, or by `error` and nothing has changed. An effect that acts already and is only changed in
    what may be written to a running scene does so from the next frame on; otherwise it is made ready beside the
    simulation and taken up between two frames. Asked for before the garment is worn it is `kept` until then, which
    `effects` says at once; what that garment can't have is refused then.
    """

    name: Annotated[Name, Meta(description='a name of `effects`, or "auto": arm what garment and motion may call for')]
    parameters: Annotated[
        dict[str, Any] | None,
        Meta(description="parameters by name, those left out as they are by default; null: as they stand"),
    ] = None
    state: Annotated[Literal["active", "armed"], Meta(description="what it is to be")] = "active"
    request: Request = None


class RemoveEffectMessage(Message, tag="remove_effect", frozen=True, kw_only=True):
    """Have an effect act no longer in the session, nor be armed. Answered as `set_effect`."""

    name: Annotated[Name, Meta(description='a name of `effects`, or "auto"')]
    request: Request = None


class MeasureEffectsMessage(Message, tag="measure_effects", frozen=True, kw_only=True):
    """Have what each effect takes measured, in the scene as it is. Answered by `effects`."""

    request: Request = None


class EffectState(Struct, frozen=True, kw_only=True):
    """An effect in this session."""

    name: Annotated[str, Meta(description="its name; GET /api/effects says what each is and takes")]
    state: Annotated[
        Literal["absent", "armed", "active"],
        Meta(description="absent: costs nothing; armed: its kernels are compiled, nothing else; active: it acts"),
    ]
    pending: Annotated[
        Literal["", "compiling", "binding"],
        Meta(description='what is under way on the way to what was asked for; "": nothing'),
    ] = ""
    parameters: Annotated[
        dict[str, Any], Meta(description="all of them, as they stand; of what is absent as last, or by default")
    ] = {}
    why: Annotated[str, Meta(description="for people: why it is what it is")] = ""
    ms: Annotated[
        float | None,
        Meta(description="a frame's calls of its stages, as measured last; null: not measured"),
    ] = None
    stages: Annotated[dict[str, float], Meta(description="ms of a call of each stage, as measured last")] = {}


class KeptEffect(Struct, frozen=True, kw_only=True):
    """An effect that was asked for before the garment was worn, and has not come to be as asked yet."""

    name: Annotated[str, Meta(description="its name, as it was asked for")]
    state: Annotated[
        Literal["absent", "armed", "active"], Meta(description="what it is to be once the garment is worn")
    ]
    parameters: Annotated[
        dict[str, Any] | None, Meta(description="that it was asked for with; null: as they will stand")
    ] = None
    refused: Annotated[
        str, Meta(description='for people: why the worn garment can\'t have it, and what to do about it; "": it waits')
    ] = ""


class EffectsMessage(Message, tag="effects", frozen=True, kw_only=True):
    """The effects of the session's scene. Sent on joining once the garment is dressed, and on every change; before,
    with what is `kept` alone, once something is."""

    effects: Annotated[
        tuple[EffectState, ...],
        Meta(description="all that there are, those that are absent, too; none while the garment is put on first"),
    ]
    auto: Annotated[bool, Meta(description="what garment and motion may call for is armed by itself")] = False
    kept: Annotated[
        tuple[KeptEffect, ...], Meta(description="asked for before the garment was worn, in their order")
    ] = ()
    plan: Annotated[
        str, Meta(description="for people: the stages of a step and who takes part in each, with ms where measured")
    ] = ""
