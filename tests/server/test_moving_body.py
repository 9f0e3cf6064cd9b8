"""A body that moves by itself: what its frames show reaches the clients, there and back again."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path

import analytic_drape
import numpy as np
import pytest
from scripted_worker import clock_of

from tryon_protocol import GRID, FrameDecoder, Topology, decode_server
from tryon_server.runtime.bodies import one_joint_body
from tryon_server.runtime.order import DrapeOrder, WorkOrder
from tryon_server.runtime.sources import LONGEST_MOVE, SequenceSource
from tryon_server.runtime.worker import Worker
from tryon_server.sessions.commands import AllowFrame, FollowMotion, Run
from tryon_server.sessions.events import FrameReady, Reported, TopologyReady, Troubled
from tryon_solver.body.lead_back import RAMP, LeadBack
from tryon_solver.body.mesh_sequence import MeshSequence, make_sequence
from tryon_solver.body.pose import Pose, skin


def bowing(frames: int = 13, dt: float = 0.1) -> MeshSequence:
    """The prism bows by 40 degrees, turns about its axis and goes half a metre to the side."""
    body = analytic_drape.small_body()
    shown = []
    for share in np.linspace(0.0, 1.0, frames):
        bow, turn = np.radians(20.0) * share, 0.5 * share
        still = [0.0, 0.0, 0.0, 1.0]
        rotations = [[0.0, np.sin(turn), 0.0, np.cos(turn)], still, [np.sin(bow), 0.0, 0.0, np.cos(bow)]]
        shown.append(skin(body, Pose(np.array([0.5 * share, 0.0, 0.0]), np.array(rotations))))
    return make_sequence(np.array(shown, np.float32), body.faces, dt)


class WornBySequence(analytic_drape.WavingSheet):
    """The sheet beside a body that moves by itself."""

    def __init__(self, sequence: MeshSequence) -> None:
        super().__init__("cotton")
        self.own_motion = sequence
        self.outfit = replace(self.outfit, body=one_joint_body(sequence.rest_vertices, sequence.faces))
        self.pose = self.moment = sequence.start()
        self.current = Pose(np.zeros(3), np.array([[0.0, 0.0, 0.0, 1.0]]))

    def advance(self, pose, t, longest_step=0.0):  # noqa: ARG002
        assert t > self.t
        self.moment, self.t = pose, t
        return analytic_drape.Facts()

    def body_positions(self):
        return self.own_motion.surface(self.moment).astype(np.float32)


class Connection:
    """Lets the simulation run for a while."""

    def __init__(self, script: list[tuple[float, object]], until: float) -> None:
        self.now, self.script, self.until, self.events = 0.0, script, until, []

    def poll(self, wait):
        self.now += 0.0005
        if wait and not (self.script and self.script[0][0] <= self.now):
            self.now += wait
        if self.now >= self.until:
            raise EOFError
        return bool(self.script) and self.script[0][0] <= self.now

    def recv(self):
        return [self.script.pop(0)[1]]

    def send(self, event):
        self.events.append(event)


def frames_of(sequence: MeshSequence, seconds: float, *more) -> tuple[list, list]:
    allow = AllowFrame(10_000, keyframe=False, standalone=False, plain=False, again=False)
    connection = Connection([(0.0, allow), (0.0, Run(True)), *more], seconds)
    order = WorkOrder(DrapeOrder(Path("pattern.json"), "cotton", "draft", "cpu"), "own", 50.0, 1.0)
    drape = WornBySequence(sequence)
    with pytest.raises(EOFError):
        Worker(connection, order, lambda *_: drape, analytic_drape.load_motion, *clock_of(connection)).run()
    decoder, decoded = FrameDecoder(), []
    for event in connection.events:
        if isinstance(event, TopologyReady):
            decoder.set_topology(Topology.from_message(decode_server(event.payload)))
        elif isinstance(event, FrameReady):
            decoded.append(decoder.decode(event.shared.data))
    return decoded, connection.events


def test_clients_see_the_frames_there_and_back():
    sequence = bowing()
    decoded, events = frames_of(sequence, 4.0)
    assert decoded[-1].t_sim > 3.0, "over its end and its beginning"
    length = sequence.duration
    for frame in decoded:
        there = length - abs(frame.t_sim % (2 * length) - length)
        shown = sequence.surface(sequence.sample(there))
        np.testing.assert_allclose(frame.body, shown, atol=GRID / 2 + 1e-5)
    apart = [np.linalg.norm(b.body - a.body, axis=1).max() for a, b in itertools.pairwise(decoded)]
    fastest = max(
        np.linalg.norm(np.diff([sequence.surface(sequence.sample(t)) for t in (s, s + 0.01)], axis=0), axis=2).max()
        for s in np.arange(0.0, length, 0.01)
    )
    assert max(apart) < 1.5 * fastest * LONGEST_MOVE / 0.01, "it never jumps"
    assert any(isinstance(event, Reported) for event in events)


def test_one_frame_stands_still():
    decoded, _ = frames_of(bowing(frames=1), 2.0)
    assert len(decoded) > 50
    np.testing.assert_allclose(decoded[-1].body, decoded[0].body, atol=GRID)


def test_it_moves_by_itself_whatever_it_is_told():
    """And goes on with it where it is."""
    decoded, events = frames_of(bowing(), 2.0, (0.5, FollowMotion(None)), (1.0, FollowMotion("walk")))
    assert not any(isinstance(event, Troubled) for event in events)
    assert decoded[-1].t_published > 1.9
    assert decoded[-1].t_sim == pytest.approx(1.9, abs=0.1)


def test_a_body_dressed_in_a_later_frame_is_led_to_its_first_one_through_its_own():
    """Backwards, from rest to rest, never faster than it is; then its frames are played."""
    sequence = replace(bowing(), dressed_at=0.7)
    decoded, _ = frames_of(sequence, 2.5)
    assert decoded[0].t_sim == pytest.approx(-1.0), "as it was dressed, where the way begins"
    times = [frame.t_sim for frame in decoded[1:]]
    assert times == sorted(times)
    assert times[0] == pytest.approx(-(0.7 + RAMP), abs=0.05)
    lead, length = LeadBack(sequence, 0.7), sequence.duration
    for frame in decoded[1:]:
        moment = sequence.sample(length - abs(frame.t_sim % (2 * length) - length))
        if frame.t_sim < 0:
            moment = lead.sample(frame.t_sim + lead.duration)
        np.testing.assert_allclose(frame.body, sequence.surface(moment), atol=GRID / 2 + 1e-5)
    np.testing.assert_allclose(decoded[0].body, sequence.surface(sequence.sample(0.7)), atol=GRID / 2 + 1e-5)
    assert times[-1] > 1.2, "to its end"


def test_the_sequence_is_played_at_its_own_pace():
    source = SequenceSource(bowing())
    moves = [source.next(0.02) for _ in range(200)]
    assert moves[59].pose.time == pytest.approx(1.2, abs=1e-6), "its end"
    assert moves[-1].t == pytest.approx(4.0)
    assert max(abs(b.pose.time - a.pose.time) for a, b in itertools.pairwise(moves)) <= 0.02 + 1e-9
