"""Credit and bases of viewers with different luck on one shared stream."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tryon_protocol import FrameDecoder, FrameEncoder, ProtocolError, ViewerWindow
from tryon_protocol.frames import Codec, EncodedFrame


def frame(seq: int, *needs: int) -> EncodedFrame:
    return EncodedFrame(b"", seq, Codec.KEY if not needs else Codec.DELTA1, needs)


def test_two_frames_travel_and_an_acknowledgement_makes_room() -> None:
    window = ViewerWindow()
    for seq in (1, 2):
        assert window.may_send
        window.sent(frame(seq))
    assert not window.may_send
    window.acknowledge(0)
    assert not window.may_send
    window.acknowledge(1)
    assert window.may_send
    window.sent(frame(3))
    window.acknowledge(3)
    window.acknowledge(2)
    assert window.may_send


def test_an_acknowledgement_of_what_was_not_sent_is_refused() -> None:
    window = ViewerWindow()
    window.sent(frame(5))
    with pytest.raises(ProtocolError) as caught:
        window.acknowledge(6)
    assert (caught.value.code, caught.value.place) == ("invalid_ack", "$.ack")


def test_a_keyframe_request_settles_what_is_under_way() -> None:
    window = ViewerWindow()
    window.sent(frame(1))
    window.sent(frame(2, 1))
    window.lost()
    assert window.may_send
    assert window.form_for(frame(3, 2, 1)) == "standalone"
    assert window.form_for(frame(3)) == "shared"


@given(
    st.lists(st.lists(st.sampled_from(["ack", "stall", "lost"]), min_size=3, max_size=3), min_size=2, max_size=14),
    st.integers(1, 3),
)
def test_every_viewer_decodes_all_it_is_sent(topology, make_state, moments, credit) -> None:
    """Three viewers acknowledge, stall or ask for a keyframe at random while one encoder serves them all."""
    encoder = FrameEncoder(topology, keyframe_interval=0.1)
    windows = [ViewerWindow(credit) for _ in range(3)]
    decoders = [FrameDecoder() for _ in range(3)]
    received: list[list[int]] = [[], [], []]
    for decoder in decoders:
        decoder.set_topology(topology)
    for step, behaviours in enumerate(moments):
        state = make_state(step)
        shared = state.encode(encoder, step / 60)
        for window, decoder, behaviour, seqs in zip(windows, decoders, behaviours, received):
            if window.may_send:
                chosen = shared if window.form_for(shared) == "shared" else encoder.standalone()
                window.sent(chosen)
                decoded = decoder.decode(chosen.data)
                np.testing.assert_array_equal(decoded.cloth_units, np.rint(state.cloth / topology.grid))
                seqs.append(decoded.seq)
            if behaviour == "ack":
                window.acknowledge(decoder.last_seq)
            elif behaviour == "lost":
                window.lost()
                encoder.request_keyframe()
    assert all(seqs and seqs[0] == 1 for seqs in received)
