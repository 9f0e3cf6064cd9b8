"""Control messages: what is read, and how each fault is named."""

from __future__ import annotations

from typing import get_args

import msgpack
import pytest

from tryon_protocol import (
    MAX_CLIENT_MESSAGE_BYTES,
    ClientMessage,
    HelloMessage,
    PingMessage,
    PlayMessage,
    PoseMessage,
    ProtocolError,
    ServerMessage,
    decode_client,
    decode_server,
    encode,
    error_message,
    is_frame,
    negotiate,
)

POSE = {
    "type": "pose",
    "subject": "wearer",
    "convention": "model-local",
    "frame": "session",
    "t": 1.5,
    "seq": 3,
    "root": [0.0, 1.0, 0.0],
    "rotations": [[0.0, 0.0, 0.0, 1.0]],
}


def refuse(message: object) -> ProtocolError:
    with pytest.raises(ProtocolError) as caught:
        decode_client(msgpack.packb(message))
    assert caught.value.message
    assert caught.value.remedy
    return caught.value


def test_unknown_fields_are_ignored() -> None:
    assert decode_client(msgpack.packb({"type": "ping", "t": 2.0, "later": [1, {"x": None}]})) == PingMessage(t=2.0)


def test_fields_with_a_default_may_be_left_out() -> None:
    pose = decode_client(msgpack.packb(POSE))
    assert isinstance(pose, PoseMessage)
    assert pose.ack == 0
    assert decode_client(msgpack.packb({"type": "play"})) == PlayMessage()


def test_integers_and_single_precision_serve_as_floats() -> None:
    whole = decode_client(msgpack.packb({**POSE, "t": 2, "root": [0, 1, 0], "rotations": [[0, 0, 0, 1]]}))
    single = decode_client(msgpack.packb({**POSE, "t": 2.0}, use_single_float=True))
    assert isinstance(whole, PoseMessage)
    assert isinstance(single, PoseMessage)
    assert whole.t == single.t == 2.0
    assert type(whole.root[1]) is float


@pytest.mark.parametrize(
    ("change", "place"),
    [
        ({"rotations": [[0, 0, 0, 1], [0, "x", 0, 1]]}, "$.rotations[1][1]"),
        ({"rotations": [[0, 0, 1]]}, "$.rotations[0]"),
        ({"root": [0, 1]}, "$.root"),
        ({"seq": 0}, "$.seq"),
        ({"seq": 2**32}, "$.seq"),
        ({"ack": -1}, "$.ack"),
        ({"t": None}, "$.t"),
        ({"subject": ""}, "$.subject"),
        ({"rotations": [[0, 0, 0, 1]] * 1025}, "$.rotations"),
    ],
)
def test_a_wrong_field_is_named_by_its_place(change: dict[str, object], place: str) -> None:
    error = refuse({**POSE, **change})
    assert (error.code, error.place) == ("invalid_field", place)


def test_a_missing_field_is_named() -> None:
    error = refuse({key: value for key, value in POSE.items() if key != "convention"})
    assert error.code == "invalid_field"
    assert "`convention`" in error.message


def test_an_unknown_type_has_a_code_of_its_own_and_lists_the_known_ones() -> None:
    error = refuse({"type": "teleport"})
    assert (error.code, error.place) == ("unknown_type", "$.type")
    assert "pose" in error.remedy
    assert refuse({"type": 5}).code == "invalid_field"
    assert refuse({"t": 5}).code == "invalid_field"


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\xc1",
        b"\x81",
        b"\x81\xa4type",
        msgpack.packb(PLAY := {"type": "play"}) + b"\0",
        b"\x81\xa1x" + b"\x91" * 60000,
        b"\x82\xa4type\xaaset_fabric\xa6fabric\xa3\xed\xa0\x80",  # U+D800, half of a surrogate pair
    ],
)
def test_what_is_no_message_is_malformed(data: bytes) -> None:
    with pytest.raises(ProtocolError) as caught:
        decode_client(data)
    assert caught.value.code in ("malformed_message", "invalid_field")


@pytest.mark.parametrize("value", [[PLAY], "play", 5, None])
def test_only_a_map_is_a_message(value: object) -> None:
    assert refuse(value).place == "$"


def test_a_long_message_is_refused_unread() -> None:
    error = refuse({"type": "bye", "reason": "x" * MAX_CLIENT_MESSAGE_BYTES})
    assert error.code == "too_long"


def test_the_largest_pose_fits_into_a_message() -> None:
    pose = {**POSE, "rotations": [[0.1, 0.2, 0.3, 0.9]] * 1024}
    assert len(msgpack.packb(pose)) <= MAX_CLIENT_MESSAGE_BYTES


def test_an_error_becomes_the_message_that_answers_it() -> None:
    error = refuse({"type": "teleport"})
    message = error_message(error, request=4)
    assert (message.code, message.place, message.request, message.fatal) == ("unknown_type", "$.type", 4, False)
    assert decode_server(encode(message)) == message


def test_the_highest_common_version_is_agreed_on() -> None:
    assert negotiate(HelloMessage(versions=(1, 2, 7), client="c"), spoken=(1, 2)) == 2
    with pytest.raises(ProtocolError, match="speaks") as caught:
        negotiate(HelloMessage(versions=(2,), client="c"))
    assert caught.value.code == "unsupported_version"


def test_no_control_message_begins_like_a_frame() -> None:
    assert is_frame(b"\xc1\x01")
    assert not is_frame(b"")
    assert not is_frame(encode(PlayMessage()))


def test_every_message_and_field_says_what_it_is() -> None:
    from msgspec import inspect

    for struct in inspect.multi_type_info([*get_args(ClientMessage), *get_args(ServerMessage)]):
        assert isinstance(struct, inspect.StructType)
        assert struct.cls.__doc__
        for field in struct.fields:
            assert isinstance(field.type, inspect.Metadata), f"{struct.cls.__name__}.{field.name} has no description"
            assert (field.type.extra_json_schema or {}).get("description")
