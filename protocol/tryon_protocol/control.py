"""Control messages to and from bytes, with every fault turned into a `ProtocolError`. PROTOCOL.md section 2."""

from __future__ import annotations

import re
from typing import Any, get_args

import msgspec

from .errors import ProtocolError
from .messages import MAJOR_VERSION, MAX_CLIENT_MESSAGE_BYTES, ClientMessage, ErrorMessage, HelloMessage, ServerMessage

_encoder = msgspec.msgpack.Encoder()
_decoders: dict[str, msgspec.msgpack.Decoder[Any]] = {
    "client": msgspec.msgpack.Decoder(ClientMessage),
    "server": msgspec.msgpack.Decoder(ServerMessage),
}
_type_names = {
    "client": [kind.__struct_config__.tag for kind in get_args(ClientMessage)],
    "server": [kind.__struct_config__.tag for kind in get_args(ServerMessage)],
}
_PLACE = re.compile(r"^(?P<what>.*?)(?: - at `(?P<place>.*)`)?$", re.DOTALL)


def is_frame(data: bytes | bytearray | memoryview) -> bool:
    """True when the bytes are a binary frame: they begin with 0xC1, which no MessagePack value begins with."""
    return len(data) > 0 and data[0] == 0xC1


def encode(message: ClientMessage | ServerMessage) -> bytes:
    """The bytes of one control message."""
    return _encoder.encode(message)


def decode_client(data: bytes) -> ClientMessage:
    """Read one message of a client.

    Raises:
        ProtocolError: code "too_long", "malformed_message", "unknown_type" or "invalid_field"; the server answers with
            `error_message(exc)` and goes on.
    """
    if len(data) > MAX_CLIENT_MESSAGE_BYTES:
        raise ProtocolError(
            "too_long",
            "$",
            f"The message has {len(data)} bytes.",
            f"Send at most {MAX_CLIENT_MESSAGE_BYTES} bytes in one message.",
        )
    return _decode(data, "client")


def decode_server(data: bytes) -> ServerMessage:
    """Read one control message of a server.

    Raises:
        ProtocolError: as `decode_client`; a client ignores code "unknown_type".
    """
    return _decode(data, "server")


class _Numbered(msgspec.Struct):
    request: int | None = None


def request_of(data: bytes) -> int | None:
    """The number of a command that can't be read otherwise, for the `error` that answers it; None when it has none."""
    try:
        number = msgspec.msgpack.decode(data, type=_Numbered).request
    except (msgspec.DecodeError, RecursionError, UnicodeDecodeError):
        return None
    return number if number is not None and 0 <= number < 2**32 else None


def _decode(data: bytes, side: str) -> Any:
    try:
        return _decoders[side].decode(data)
    except msgspec.ValidationError as exc:
        raise validation_error(exc, side) from exc
    except (msgspec.DecodeError, RecursionError, UnicodeDecodeError) as exc:
        raise ProtocolError(
            "malformed_message",
            "$",
            f"The message isn't one MessagePack map ({exc}).",
            "Send each control message as one binary websocket message that holds one MessagePack map.",
        ) from exc


def validation_error(exc: msgspec.ValidationError, side: str) -> ProtocolError:
    """Name the place and the remedy of a fault that msgspec found in a message of that side ("client" or "server")."""
    match = _PLACE.match(str(exc))
    what, place = (match["what"], match["place"] or "$") if match else (str(exc), "$")
    if place == "$.type" and what.startswith("Invalid value"):
        return ProtocolError(
            "unknown_type",
            place,
            f"{what}: no message of this protocol version has that type.",
            f"The types known here are {', '.join(_type_names[side])}.",
        )
    return ProtocolError(
        "invalid_field", place, f"{what}.", "Send this field with the type and range that PROTOCOL.md gives for it."
    )


def error_message(error: ProtocolError, *, fatal: bool = False, request: int | None = None) -> ErrorMessage:
    """The answer to a client whose message was at fault. request: the number its command had, if any."""
    return ErrorMessage(
        code=error.code,
        place=error.place,
        message=error.message,
        remedy=error.remedy,
        fatal=fatal,
        request=request,
    )


def negotiate(hello: HelloMessage, spoken: tuple[int, ...] = (MAJOR_VERSION,)) -> int:
    """The highest major version both sides speak.

    Raises:
        ProtocolError: code "unsupported_version" when there is none; fatal.
    """
    common = set(hello.versions) & set(spoken)
    if not common:
        raise ProtocolError(
            "unsupported_version",
            "$.versions",
            f"The client speaks {list(hello.versions)}, this server speaks {list(spoken)}.",
            "Use a client and a server with a common major version.",
        )
    return max(common)
