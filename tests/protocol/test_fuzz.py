"""Whatever bytes arrive: a decoder raises ProtocolError or returns something sound."""

from __future__ import annotations

import msgpack
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tryon_client.reading import read_message
from tryon_protocol import FrameDecoder, ProtocolError, Topology, TopologyMessage, decode_client, decode_server, encode
from tryon_protocol import vector_content as golden

MESSAGES = [data for data, _ in golden.messages().values()]
FRAMES = [data for data in golden.stream().values() if data[0] == 0xC1]
FRAMES += [data for data, _ in golden.malformed().values()]
SMALL = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**64 - 1)
    | st.floats()
    | st.text(max_size=6)
    | st.binary(max_size=9),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=12,
)


def read_quietly(read, data: bytes) -> object:
    try:
        return read(data)
    except ProtocolError as exc:
        error = exc
    assert error.code
    assert error.place
    assert error.remedy
    return None


@st.composite
def mutilated(draw, originals: list[bytes]) -> bytes:
    data = bytearray(draw(st.sampled_from(originals)))
    for _ in range(draw(st.integers(0, 4))):
        if data:
            data[draw(st.integers(0, len(data) - 1))] = draw(st.integers(0, 255))
    return bytes(data[: draw(st.integers(0, len(data)))]) if draw(st.booleans()) else bytes(data)


@given(st.binary(max_size=200) | mutilated(MESSAGES) | SMALL.map(msgpack.packb))
@settings(max_examples=400)
def test_control_messages(data: bytes) -> None:
    read_quietly(decode_client, data)
    read_quietly(decode_server, data)
    read_quietly(read_message, data)


@given(
    st.sampled_from(["pose", "hello", "set_motion", "report", "status"]), st.dictionaries(st.text(max_size=8), SMALL)
)
def test_maps_of_a_known_type_with_anything_inside(kind: str, fields: dict[str, object]) -> None:
    names = ["rotations", "root", "t", "versions", "motion", "times_ms", "progress", *fields]
    message = {"type": kind, **dict(zip(names, fields.values())), **fields}
    read_quietly(decode_client, msgpack.packb(message))
    read_quietly(decode_server, msgpack.packb(message))


@given(mutilated(FRAMES) | st.binary(max_size=300).map(b"\xc1\x01".__add__))
@settings(max_examples=600)
def test_frames(topology: Topology, data: bytes) -> None:
    decoder = FrameDecoder()
    decoder.set_topology(topology)
    before = FRAMES[0]
    decoder.decode(before)
    for frame in (data, data):
        decoded = read_quietly(decoder.decode, frame)
        if decoded is not None:
            assert decoded.cloth.shape == (topology.cloth_vertex_count, 3)
            assert np.isfinite(decoded.cloth).all()
            assert np.isfinite(decoded.body).all()


@given(mutilated([encode(golden.topology().to_message(compress=compress)) for compress in (True, False)]))
@settings(max_examples=400)
def test_topologies(data: bytes) -> None:
    message = read_quietly(decode_server, data)
    if isinstance(message, TopologyMessage):
        topology = read_quietly(Topology.from_message, message)  # type: ignore[arg-type]
        if isinstance(topology, Topology):
            decoder = FrameDecoder()
            decoder.set_topology(topology)
            read_quietly(decoder.decode, FRAMES[0])
