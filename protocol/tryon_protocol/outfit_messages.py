"""Control messages about what a session wears: put on, taken off, in another order. PROTOCOL.md section 3.4."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta, Struct

from .message_base import Message, Name, Request

WornName = Annotated[Name, Meta(description="a name of `cloth.garments`")]
Size = Annotated[float, Meta(ge=0.5, le=2.0)]


class PutOnMessage(Message, tag="put_on", frozen=True, kw_only=True):
    """Put a garment on over what is worn, or at another place in the order; it is the one that edits are of then.

    Answered by `outfit` once it is worn, or by `error` and nothing has changed. Frames of what is worn go on meanwhile.
    """

    garment: Annotated[Name, Meta(description="id of a garment, from GET /api/garments")]
    fabric: Annotated[Name | None, Meta(description="one of `welcome.fabrics`; null: its pattern's own")] = None
    size: Annotated[Size, Meta(description="of its pattern, over its own")] = 1.0
    position: Annotated[
        Annotated[int, Meta(ge=0, le=100)] | None,
        Meta(description="from the innermost, 0; null: outermost, or where the one was that it replaces"),
    ] = None
    replaces: Annotated[WornName | None, Meta(description="a worn garment that it takes the place of")] = None
    request: Request = None


class TakeOffMessage(Message, tag="take_off", frozen=True, kw_only=True):
    """Take a garment off; the others stay as they are. Answered as `put_on`."""

    garment: WornName
    request: Request = None


class ReorderMessage(Message, tag="reorder", frozen=True, kw_only=True):
    """Wear the same garments in another order, or edit another one of them. Answered as `put_on`; what has to pass
    through others is taken off for it and put on again."""

    order: Annotated[
        tuple[WornName, ...] | None,
        Meta(description="names of all that is worn, from the innermost outwards; null: as they are"),
    ] = None
    edited: Annotated[WornName | None, Meta(description="which one edits are of; null: the same")] = None
    request: Request = None


class WornGarment(Struct, frozen=True, kw_only=True):
    """A garment that the session wears."""

    name: Annotated[str, Meta(description="its name in `cloth.garments`, as edits name it")]
    garment: Annotated[str, Meta(description="id of the garment that it is")]
    fabric: Annotated[str, Meta(description="what it is made of")]
    size: Annotated[float | Literal["fit"], Meta(description='of its pattern, over its own; "fit": the one that fits')]
    edited: Annotated[bool, Meta(description="edits are of this one")]
    again: Annotated[bool, Meta(description="it was taken off and put on again for this change")] = False


class OutfitMessage(Message, tag="outfit", frozen=True, kw_only=True):
    """What the session wears now. Sent to all clients when that was changed, over the websocket or by REST."""

    worn: Annotated[tuple[WornGarment, ...], Meta(description="from the innermost outwards")]
    request: Annotated[int | None, Meta(description="of the command that this answers, to who sent it")] = None


OutfitWish = PutOnMessage | TakeOffMessage | ReorderMessage
