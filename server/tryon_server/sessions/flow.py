"""Which frames go to which client: credit, shared encoding, and the way back for those who had to drop.

One encoding serves all clients of a session. A frame is encoded only when somebody has credit for it ("drop before
encode"), so a single client never misses a link of the chain, however slow it is. With several clients the one with
credit sets the pace; one that missed a frame gets the next ones in a form that stands alone, until the next shared
frame that does.
"""

from __future__ import annotations

from tryon_protocol import Codec, EncodedFrame, ViewerWindow
from tryon_server.sessions.actions import Action, Order, SendFrame
from tryon_server.sessions.commands import AllowFrame
from tryon_server.sessions.events import FrameReady


class Lane:
    """What one client was sent; ``newest`` is a frame's seq. ``takes_zstd``: whether it can inflate."""

    def __init__(self, credit: int, takes_zstd: bool) -> None:
        self.window = ViewerWindow(credit)
        self.takes_zstd = takes_zstd
        self.topology_id = 0
        self.newest = 0

    def form(self, event: FrameReady) -> EncodedFrame | None:
        """The form of a frame that this client can decode, if it was made."""
        if not self.takes_zstd:
            return event.plain
        return event.shared if self.window.form_for(event.shared) == "shared" else event.standalone


class FrameFlow:
    """The lanes of all clients of a session."""

    def __init__(self, credit: int) -> None:
        self._credit = credit
        self._lanes: dict[int, Lane] = {}
        self._topology_id = 0
        self._handed_over = 0
        self._last: EncodedFrame | None = None
        self._ordered: AllowFrame | None = None

    def open(self, client: int, takes_zstd: bool) -> None:
        """A client is ready for frames."""
        self._lanes[client] = Lane(self._credit, takes_zstd)

    def close(self, client: int) -> None:
        """A client has left."""
        self._lanes.pop(client, None)

    def new_topology(self, topology_id: int) -> None:
        """The frames from here on refer to this topology, the first of them stands alone."""
        self._topology_id = topology_id
        self._last = None

    def topology_sent(self, client: int) -> None:
        """A client has been sent the newest topology."""
        self._lanes[client].topology_id = self._topology_id

    def acknowledge(self, client: int, seq: int) -> None:
        """A client has decoded the frames up to ``seq``. Raises ProtocolError for a frame that it was never sent."""
        self._lanes[client].window.acknowledge(seq)

    def lost_chain(self, client: int) -> None:
        """A client can't decode what comes next, and does not have the newest state."""
        lane = self._lanes[client]
        lane.window.lost()
        lane.newest = 0

    def frame(self, event: FrameReady) -> list[Action]:
        """Hand a frame to everybody who has credit for it and can decode it."""
        self._handed_over += 1
        if event.topology_id != self._topology_id:
            return []
        self._last = event.shared
        actions: list[Action] = []
        for client, lane in self._lanes.items():
            if lane.topology_id != event.topology_id or not lane.window.may_send:
                continue
            form = lane.form(event)
            if form is not None:
                lane.window.sent(form)
                lane.newest = form.seq
                actions.append(SendFrame(client, form.data, form.stands_alone))
        return actions

    def orders(self) -> list[Action]:
        """What the simulation has to be told about frames, if that has changed."""
        ready = [
            lane
            for lane in self._lanes.values()
            if self._topology_id and lane.topology_id == self._topology_id and lane.window.may_send
        ]
        if not ready:
            return []
        inflating = [lane for lane in ready if lane.takes_zstd]
        out_of_chain = [lane for lane in inflating if not self._in_chain(lane)]
        nobody_in_chain = len(out_of_chain) == len(inflating)
        order = AllowFrame(
            total=self._handed_over + 1,
            keyframe=bool(inflating) and nobody_in_chain,
            standalone=bool(out_of_chain) and not nobody_in_chain,
            plain=len(inflating) < len(ready),
            again=self._last is None or any(lane.newest < self._last.seq for lane in ready),
        )
        if order == self._ordered:
            return []
        self._ordered = order
        return [Order(order)]

    def _in_chain(self, lane: Lane) -> bool:
        """Whether a client holds what the next shared frame will need if that does not stand alone."""
        last = self._last
        if last is None:
            return False
        needs = (last.seq,) if last.stands_alone else (last.seq, last.needs[0])
        codec = Codec.DELTA1 if last.stands_alone else Codec.DELTA2
        return lane.window.form_for(EncodedFrame(b"", last.seq + 1, codec, needs)) == "shared"
