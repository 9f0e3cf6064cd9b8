"""Frames: what comes out is what went in to half a grid unit, whatever the garment does."""

from __future__ import annotations

import struct
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tryon_protocol import GRID, Codec, EncodedFrame, FrameDecoder, FrameEncoder, ProtocolError, Topology, read_header
from tryon_protocol.frames import HEADER_BYTES
from tryon_protocol.vector_content import topology as golden_topology

HALF = GRID / 2
MakeState = Callable[..., object]


def decoder_for(topology: Topology) -> FrameDecoder:
    decoder = FrameDecoder()
    decoder.set_topology(Topology.from_message(topology.to_message()))
    return decoder


def assert_same(decoded, state) -> None:
    """Every coordinate of cloth and body within q/2; the slack is float64 rounding at 10 km."""
    assert np.abs(decoded.cloth - state.cloth).max() <= HALF + 1e-9
    assert np.abs(decoded.body - state.body).max() <= HALF + 1e-9
    np.testing.assert_array_equal(decoded.root, state.root)
    np.testing.assert_array_equal(decoded.rotations, state.rotations.astype(np.float32))


@given(
    st.lists(st.tuples(st.integers(0, 9), st.floats(-6.0, 6.0), st.booleans()), min_size=1, max_size=7),
    st.floats(-1e4, 1e4),
)
def test_every_frame_of_a_stream_is_within_half_a_unit(topology, make_state, steps, away) -> None:
    encoder, decoder = FrameEncoder(topology), decoder_for(topology)
    for index, (seed, walked, asked) in enumerate(steps):
        state = make_state(seed, (away + walked, 0.9, walked))
        if asked:
            encoder.request_keyframe()
        frame = state.encode(encoder, index / 60)
        assert frame.seq == index + 1
        assert_same(decoder.decode(frame.data), state)
        assert decoder.last_seq == frame.seq


@given(st.floats(-1e4, 1e4), st.lists(st.floats(-0.3, 0.3), min_size=4, max_size=12))
def test_differences_stay_exact_while_the_origin_follows_a_walk(topology, make_state, away, steps) -> None:
    encoder, decoder = FrameEncoder(topology), decoder_for(topology)
    place = away
    for index, step in enumerate([*steps, *[0.25] * 12]):
        place += step
        state = make_state(1, (place, 0.0, 0.0))
        frame = state.encode(encoder, index / 60)
        expected = Codec.KEY if index == 0 else Codec.DELTA1 if index == 1 else Codec.DELTA2
        assert frame.codec == expected
        decoded = decoder.decode(frame.data)
        np.testing.assert_array_equal(decoded.cloth_units, np.rint(state.cloth / GRID))
    header, _ = read_header(frame.data)
    assert header.origin[0] != 0


def test_a_jump_that_leaves_int16_makes_the_frame_stand_alone(topology, make_state) -> None:
    encoder, decoder = FrameEncoder(topology), decoder_for(topology)
    codecs = []
    for index, place in enumerate([0.0, 0.0, 0.0, 2.2, 2.2, 2.2, 9e4, -9e4, -9e4]):
        state = make_state(1, (0.0, place, 0.0))
        frame = state.encode(encoder, index / 60)
        codecs.append(frame.codec.name)
        assert_same(decoder.decode(frame.data), state)
    # From rest to 2.2 m is a DELTA2 of 35,200 units, beyond int16, and so is stopping after it.
    assert codecs == ["KEY", "DELTA1", "DELTA2", "KEY", "DELTA1", "DELTA2", "KEY", "KEY", "DELTA1"]


def test_neighbours_too_far_apart_for_a_difference_go_bare(topology, make_state) -> None:
    state = make_state(1)
    state.cloth[0] = [-1.5, 0.0, 0.0]
    state.cloth[1] = [1.5, 0.0, 0.0]
    frame = state.encode(FrameEncoder(topology), 0.0)
    assert frame.codec == Codec.RAW
    assert frame.stands_alone
    assert_same(decoder_for(topology).decode(frame.data), state)


def test_a_keyframe_comes_each_second_and_on_request(topology, make_state) -> None:
    encoder = FrameEncoder(topology, keyframe_interval=1.0)
    alone = []
    for index in range(24):
        if index == 13:
            encoder.request_keyframe()
        alone.append(make_state(1).encode(encoder, index / 8).stands_alone)
    assert [index for index, value in enumerate(alone) if value] == [0, 8, 13, 21]


def test_needs_name_the_chain(topology, make_state) -> None:
    encoder = FrameEncoder(topology, first_seq=40)
    frames = [make_state(index).encode(encoder, index / 60) for index in range(4)]
    assert [frame.needs for frame in frames] == [(), (40,), (41, 40), (42, 41)]
    assert [read_header(frame.data)[0].base_seq for frame in frames] == [0, 40, 41, 42]


@pytest.mark.parametrize("compressed", [True, False])
def test_a_standalone_form_says_the_same_at_any_point(topology, make_state, compressed) -> None:
    encoder = FrameEncoder(topology)
    for index in range(4):
        state = make_state(index)
        shared = state.encode(encoder, index / 60)
        alone = encoder.standalone(compressed=compressed)
        assert alone.stands_alone
        assert alone.seq == shared.seq
        assert alone is encoder.standalone(compressed=compressed)
        assert alone.codec == (Codec.KEY if compressed else Codec.RAW)
        assert_same(decoder_for(topology).decode(alone.data), state)


def test_a_bare_frame_holds_nothing_to_inflate(topology, make_state) -> None:
    encoder = FrameEncoder(topology)
    make_state(1, yielding=20).encode(encoder, 0.0)
    header, start = read_header(encoder.standalone(compressed=False).data)
    assert header.flags == 0
    assert header.offset_count == 20
    assert len(encoder.standalone(compressed=False).data) == start + header.pose_bytes + 6 * 60 + 10 * 20


def test_standalone_before_any_frame_is_an_error(topology) -> None:
    with pytest.raises(ProtocolError, match="encode"):
        FrameEncoder(topology).standalone()


def test_only_vertices_off_the_skin_get_offsets(topology, make_state) -> None:
    encoder, decoder = FrameEncoder(topology), decoder_for(topology)
    assert decoder.decode(make_state(1, yielding=0).encode(encoder, 0.0).data).offset_count == 0
    assert decoder.decode(make_state(1, yielding=20).encode(encoder, 0.1).data).offset_count == 20
    assert decoder.decode(make_state(1, yielding=58).encode(encoder, 0.2).data).offset_count == 58


def test_offsets_are_taken_from_the_pose_as_float32_carries_it(topology, make_state) -> None:
    """With rotations that float32 rounds noticeably, the body still comes within half a unit."""
    state = make_state(3, yielding=0)
    state.rotations += 4e-4 * np.sin(np.arange(state.rotations.size)).reshape(state.rotations.shape)
    frame = state.encode(FrameEncoder(topology), 0.0)
    decoded = decoder_for(topology).decode(frame.data)
    assert np.abs(decoded.body - state.body).max() <= HALF + 1e-9
    assert decoded.offset_count > 0


def test_space_origin_moves_cloth_and_body_alike(topology, make_state) -> None:
    state = make_state(1, (500.0, 0.0, -20.0))
    origin = (500.0, 0.0, -20.0)
    encoder = FrameEncoder(topology)
    frame = encoder.encode(
        (state.cloth - origin).astype(np.float32),
        (state.body - origin).astype(np.float32),
        state.root,
        state.rotations,
        t_sim=0.0,
        t_published=0.0,
        space_origin=origin,
    )
    decoded = decoder_for(topology).decode(frame.data)
    assert np.abs(decoded.cloth - state.cloth).max() <= HALF + 2e-7
    assert np.abs(decoded.body - state.body).max() <= HALF + 2e-7


def test_the_encoder_leaves_its_input_alone(topology, make_state) -> None:
    state, same = make_state(1), make_state(1)
    state.encode(FrameEncoder(topology), 0.0)
    for name in ("cloth", "body", "root", "rotations"):
        np.testing.assert_array_equal(getattr(state, name), getattr(same, name))


@pytest.mark.parametrize(
    ("name", "index", "value", "code", "place"),
    [
        ("cloth", (7, 1), np.nan, "unencodable_position", "cloth[7]"),
        ("cloth", (7, 1), 1e9, "unencodable_position", "cloth[7]"),
        ("cloth", (7, 1), 50.0, "cloth_too_large", "cloth"),
        ("body", (9, 0), np.nan, "unencodable_position", "body[9]"),
        ("body", (9, 0), 40.0, "unencodable_position", "body[9]"),
        ("root", (2,), np.inf, "unencodable_pose", "root"),
        ("rotations", (3,), 0.0, "unencodable_pose", "rotations[3]"),
        ("rotations", (3, 0), np.nan, "unencodable_pose", "rotations[3]"),
    ],
)
def test_what_a_frame_cannot_say_is_refused_and_the_stream_goes_on(
    topology, make_state, name, index, value, code, place
) -> None:
    encoder, decoder = FrameEncoder(topology), decoder_for(topology)
    for step in range(2):
        decoder.decode(make_state(step).encode(encoder, step / 60).data)
    wrong = make_state(5)
    getattr(wrong, name)[index] = value
    with pytest.raises(ProtocolError) as caught:
        wrong.encode(encoder, 0.05)
    assert (caught.value.code, caught.value.place) == (code, place)
    assert caught.value.remedy
    good = make_state(6)
    frame = good.encode(encoder, 0.06)
    assert (frame.seq, frame.codec) == (3, Codec.DELTA2)
    assert_same(decoder.decode(frame.data), good)


def test_arrays_of_another_garment_are_refused(topology, make_state) -> None:
    state = make_state(1)
    state.cloth = state.cloth[:-1]
    with pytest.raises(ProtocolError, match="set_topology") as caught:
        state.encode(FrameEncoder(topology), 0.0)
    assert (caught.value.code, caught.value.place) == ("wrong_shape", "cloth")


def test_sequence_numbers_end_with_an_error_not_with_zero(topology, make_state) -> None:
    encoder = FrameEncoder(topology, first_seq=2**32 - 1)
    make_state(1).encode(encoder, 0.0)
    with pytest.raises(ProtocolError, match="new session"):
        make_state(1).encode(encoder, 0.1)


def test_a_new_topology_begins_with_a_frame_that_stands_alone(topology, make_state) -> None:
    encoder, decoder = FrameEncoder(topology), decoder_for(topology)
    for step in range(3):
        decoder.decode(make_state(step).encode(encoder, step / 60).data)
    encoder.set_topology(golden_topology(2))
    frame = make_state(3).encode(encoder, 0.1)
    assert (frame.seq, frame.stands_alone) == (4, True)
    with pytest.raises(ProtocolError) as caught:
        decoder.decode(frame.data)
    assert caught.value.code == "unknown_topology"
    decoder.set_topology(golden_topology(2))
    assert decoder.decode(frame.data).topology_id == 2


def test_a_header_that_has_grown_is_read_past(topology, make_state) -> None:
    state = make_state(1)
    data = bytearray(state.encode(FrameEncoder(topology), 0.0).data)
    struct.pack_into("<H", data, 54, HEADER_BYTES + 16)
    data[3] |= 0x80
    decoded = decoder_for(topology).decode(
        bytes(data[:HEADER_BYTES]) + b"sixteen more yes" + bytes(data[HEADER_BYTES:])
    )
    assert_same(decoded, state)


def lossy_chains() -> st.SearchStrategy[list[int]]:
    return st.lists(st.integers(0, 3), min_size=3, max_size=20)


@given(lossy_chains())
def test_a_decoder_never_guesses_when_frames_are_missing(topology, make_state, fates) -> None:
    """0, 1: a frame arrives; 2: it is lost; 3: its standalone form arrives. Decoded means right, else missing_base."""
    encoder, decoder = FrameEncoder(topology, keyframe_interval=0.1), decoder_for(topology)
    chain: list[int] = []
    for index, fate in enumerate(fates):
        state = make_state(index)
        frame: EncodedFrame = state.encode(encoder, index / 60)
        if fate == 2:
            continue
        frame = encoder.standalone() if fate == 3 else frame
        if frame.stands_alone or tuple(chain[: len(frame.needs)]) == frame.needs:
            assert_same(decoder.decode(frame.data), state)
            chain = [frame.seq, *frame.needs[:1]]
        else:
            with pytest.raises(ProtocolError) as caught:
                decoder.decode(frame.data)
            assert caught.value.code == "missing_base"
