"""Bytes of the server to messages, read with `msgpack`: independent of the library that the server writes with."""

from __future__ import annotations

import msgpack
import msgspec

from tryon_protocol import ProtocolError, ServerMessage
from tryon_protocol.control import validation_error


def read_message(data: bytes) -> ServerMessage | None:
    """One control message of the server; None when its type is of a later version, to be ignored.

    Raises:
        ProtocolError: codes "malformed_message" and "invalid_field".
    """
    try:
        value = msgpack.unpackb(data)
    except (ValueError, msgpack.exceptions.UnpackException) as exc:
        raise ProtocolError(
            "malformed_message",
            "$",
            f"The server sent something else than a MessagePack map ({exc!r}).",
            "Check that the address is a tryon stream.",
        ) from exc
    try:
        message: ServerMessage = msgspec.convert(value, ServerMessage)
    except msgspec.ValidationError as exc:
        error = validation_error(exc, "server")
        if error.code == "unknown_type":
            return None
        raise error from exc
    return message
