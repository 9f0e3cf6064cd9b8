"""What all control messages are made of."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

U32 = Annotated[int, Meta(ge=0, le=2**32 - 1)]
Number = Annotated[int, Meta(ge=1, le=2**32 - 1)]
Name = Annotated[str, Meta(min_length=1, max_length=200)]
Text = Annotated[str, Meta(max_length=500)]
Request = Annotated[
    U32 | None,
    Meta(description="number chosen by the client and repeated in the `error` that answers this command; null: none"),
]


class Message(Struct, tag_field="type", frozen=True, kw_only=True):
    """Base of all control messages: a map whose field "type" names the message."""
