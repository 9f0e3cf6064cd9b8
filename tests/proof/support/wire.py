"""From the state of a drape to what a client has of it: the server's publishing code, then the client's decoder."""

from __future__ import annotations

from tryon_protocol import DecodedFrame, FrameDecoder, Topology, TopologyMessage, decode_server
from tryon_server.runtime.drape import Drape
from tryon_server.runtime.publishing import Publisher
from tryon_server.runtime.sources import Move
from tryon_server.sessions.commands import AllowFrame
from tryon_solver.body.pose import Pose

KEYFRAME_SECONDS = 1.0  # the server's default


class Wire:
    """One viewer that takes every frame, without a network between. Its clock is the simulated time."""

    def __init__(self, drape: Drape) -> None:
        self.drape = drape
        self.time = 0.0
        self.bytes = 0
        self.publisher = Publisher(KEYFRAME_SECONDS, lambda: self.time)
        message = decode_server(self.publisher.dress(drape, Move(drape.pose, 0.0, 0.0, 0)).payload)
        assert isinstance(message, TopologyMessage)
        self.topology = Topology.from_message(message)
        self.decoder = FrameDecoder()
        self.decoder.set_topology(self.topology)

    def dressed(self) -> DecodedFrame:
        """The frame of the garment as it was dressed, which a server publishes first."""
        return self._publish()

    def frame(self, pose: Pose, t: float, dt: float) -> DecodedFrame:
        """The frame of the drape's present state, simulated to `pose` at `t` [s].

        Raises ProtocolError when the state can't be encoded, as when a position is not a number.
        """
        self.time = t
        self.publisher.show(Move(pose, dt, t, 0))
        return self._publish()

    def _publish(self) -> DecodedFrame:
        total = self.publisher.last_seq + 1
        self.publisher.allow(AllowFrame(total, keyframe=False, standalone=False, plain=False, again=False))
        ready = self.publisher.publish()
        assert ready is not None
        self.bytes += len(ready.shared.data)
        return self.decoder.decode(ready.shared.data)
