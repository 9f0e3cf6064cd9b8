"""The wire of the proof: what arrives is the state, rounded; what can't be sent is no frame; a wrong frame is told."""

from dataclasses import replace

import limits
import numpy as np
import pytest
from run_case import Played
from small_scenes import STILL, icosphere, rigid_body
from tube_on_ball import tube
from wire import Wire

from tryon_protocol import GRID, ProtocolError
from tryon_server.runtime.drape import Outfit


class Held:
    """A drape whose state is set by hand."""

    own_motion = None  # its body stands as poses say
    specification, outgrown = None, ""

    def __init__(self):
        garment, self.cloth = tube()
        vertices, faces = icosphere(0.1, 3)
        self.surface = vertices.astype(np.float32)
        self.pose, self.origin = STILL, np.array([2.0, 0, -1])
        self.surface -= self.origin.astype(np.float32)  # the pose is the session's, positions are from the origin
        body = rigid_body(vertices, faces)
        panels = (garment.panel_of_face, ("tube",))
        self.outfit = Outfit(garment.vertex_count, garment.faces, garment.uv_corners, *panels, body)

    def cloth_positions(self):
        return self.cloth.astype(np.float32)

    def body_positions(self):
        return self.surface


@pytest.fixture
def held():
    return Held()


def test_every_state_arrives_rounded_to_the_grid(held):
    wire = Wire(held)
    first = wire.dressed()
    rng = np.random.default_rng(4)
    arrived = []
    for k in range(1, 90):
        held.cloth = held.cloth + 1e-3 * rng.standard_normal(held.cloth.shape)
        frame = wire.frame(STILL, k / 60, 1 / 60)
        arrived.append(frame)
        assert np.abs(frame.cloth - held.cloth - held.origin).max() <= 0.501 * GRID
        assert frame.t_sim == k / 60
    assert first.stands_alone
    assert [f.seq for f in arrived] == list(range(2, 91))
    assert 0 < sum(f.stands_alone for f in arrived) < 10  # differences are on the way, too


def test_a_state_that_is_not_a_number_is_no_frame(held):
    wire = Wire(held)
    wire.dressed()
    held.cloth[7, 1] = np.nan
    with pytest.raises(ProtocolError, match="7"):
        wire.frame(STILL, 1 / 60, 1 / 60)


def test_a_frame_that_shows_another_state_or_pose_is_told(held):
    frame = Wire(held).dressed()
    shifted = frame.cloth.copy()
    shifted[5, 2] += 1e-4
    turned = np.array([[0, np.sin(5e-3), 0, np.cos(5e-3)]], np.float32)
    played = Played()
    for arrived in (frame, replace(frame, cloth=shifted), replace(frame, rotations=turned)):
        played.add(arrived, None, held, STILL)
    assert [error > limits.WIRE for error in played.wire_error] == [False, True, False]
    assert [error > limits.POSE for error in played.pose_error] == [False, False, True]
