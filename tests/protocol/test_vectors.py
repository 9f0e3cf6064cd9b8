"""The committed vectors, generated TypeScript and PROTOCOL.md agree with the code."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path
from typing import Any, get_args

import msgpack
import msgspec
import numpy as np
import pytest

from tryon_protocol import (
    ClientMessage,
    FrameDecoder,
    ProtocolError,
    ServerMessage,
    Topology,
    decode_server,
    generate_ts,
    vectors,
)
from tryon_protocol.messages import Message

PROTOCOL = Path(generate_ts.__file__).resolve().parents[1]
MESSAGES = sorted((PROTOCOL / "vectors" / "messages").glob("*.bin"))
STREAM = json.loads((PROTOCOL / "vectors" / "stream" / "stream.json").read_bytes())
MALFORMED = json.loads((PROTOCOL / "vectors" / "malformed" / "malformed.json").read_bytes())


def read(folder: str, name: str) -> bytes:
    return (PROTOCOL / "vectors" / folder / name).read_bytes()


def unpacked(value: Any) -> Any:
    """A vector's JSON as the Python values MessagePack gives."""
    if isinstance(value, dict):
        if value.keys() == {"$base64"}:
            return base64.b64decode(value["$base64"])
        return {key: unpacked(item) for key, item in value.items()}
    return [unpacked(item) for item in value] if isinstance(value, list) else value


def message_types() -> list[type[Message]]:
    return [*get_args(ClientMessage), *get_args(ServerMessage)]


def test_vectors_say_what_the_code_makes() -> None:
    assert vectors.differences(vectors.make()) == []


def test_a_changed_vector_is_noticed() -> None:
    files = vectors.make()
    client_ping = files["messages/client_ping.json"]
    files["messages/client_ping.json"] = client_ping.replace(b"99.25", b"99.5")
    files["messages/one_more.bin"] = b""
    del files["stream/01_key.bin"]
    assert vectors.differences(files) == [
        "messages/one_more.bin is missing",
        "stream/01_key.bin is not made any more",
        "messages/client_ping.json differs",
    ]


def test_generated_typescript_is_up_to_date(capsys: pytest.CaptureFixture[str]) -> None:
    assert generate_ts.main(["--check"]) == 0, capsys.readouterr().out


def test_every_message_type_has_a_vector() -> None:
    tags = {str(kind.__struct_config__.tag) for kind in message_types()}
    assert {msgpack.unpackb(path.read_bytes())["type"] for path in MESSAGES} == tags


@pytest.mark.parametrize("path", MESSAGES, ids=lambda path: path.stem)
def test_an_independent_reader_finds_the_documented_map(path: Path) -> None:
    assert msgpack.unpackb(path.read_bytes()) == unpacked(json.loads(path.with_suffix(".json").read_bytes()))


@pytest.mark.parametrize("path", MESSAGES, ids=lambda path: path.stem)
def test_an_independent_writer_is_understood(path: Path) -> None:
    kind = ClientMessage if path.stem.startswith("client") else ServerMessage
    written = msgpack.packb(unpacked(json.loads(path.with_suffix(".json").read_bytes())))
    assert msgspec.msgpack.decode(written, type=kind) == msgspec.msgpack.decode(path.read_bytes(), type=kind)


def test_the_stream_decodes_to_its_numbers() -> None:
    decoder, grid, frames = FrameDecoder(), 0.0, 0
    for entry in STREAM:
        data = read("stream", entry["file"])
        if "topology" in entry:
            message = decode_server(data)
            grid = message.grid  # type: ignore[union-attr]
            decoder.set_topology(Topology.from_message(message))  # type: ignore[arg-type]
            continue
        frame, expected = decoder.decode(data), entry["frame"]
        frames += 1
        for name in ("seq", "pose_seq", "topology_id", "t_sim", "t_published", "stands_alone", "offset_count"):
            assert getattr(frame, name) == expected[name]
        np.testing.assert_array_equal(frame.cloth_units, expected["cloth_units"])
        np.testing.assert_array_equal(frame.cloth, grid * np.array(expected["cloth_units"], dtype=np.float64))
        np.testing.assert_allclose(frame.body, expected["body"], rtol=0, atol=1e-7)
        np.testing.assert_array_equal(frame.root, expected["root"])
        np.testing.assert_array_equal(frame.rotations, np.array(expected["rotations"], dtype=np.float32))
    assert frames == 12


@pytest.mark.parametrize("entry", MALFORMED, ids=lambda entry: entry["file"])
def test_a_malformed_frame_is_refused_and_the_stream_goes_on(entry: dict[str, str]) -> None:
    decoder = FrameDecoder()
    decoder.set_topology(Topology.from_message(decode_server(read("stream", STREAM[0]["file"]))))  # type: ignore[arg-type]
    with pytest.raises(ProtocolError) as caught:
        decoder.decode(read("malformed", entry["file"]))
    assert caught.value.code == entry["code"]
    for later in STREAM[1:4]:
        frame = decoder.decode(read("stream", later["file"]))
        np.testing.assert_array_equal(frame.cloth_units, later["frame"]["cloth_units"])


def test_the_description_names_every_message_field_and_error() -> None:
    text = (PROTOCOL / "PROTOCOL.md").read_text(encoding="utf-8")
    for kind in message_types():
        assert f"`{kind.__struct_config__.tag}`" in text or f"**{kind.__struct_config__.tag}**" in text
        for name in kind.__struct_fields__:
            assert name in ("cloth", "body") or f"`{name}`" in text, f"{kind.__name__}.{name} isn't in PROTOCOL.md"
    code = re.compile(r'ProtocolError\(\s*"(\w+)"')
    raised = {
        match for file in (PROTOCOL / "tryon_protocol").glob("*.py") for match in code.findall(file.read_text("utf-8"))
    }
    sender_only = {"unencodable_position", "unencodable_pose", "cloth_too_large", "wrong_shape", "no_frame"}
    sender_only |= {"grid_too_coarse"}
    assert "malformed_frame" in raised
    assert {name for name in raised - sender_only if f"`{name}`" not in text} == set()
