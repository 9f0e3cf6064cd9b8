"""One connection to a session: handshake, topology, frames with acknowledgement, poses and commands."""

from __future__ import annotations

import contextlib
import ssl
from collections.abc import AsyncIterator, Sequence
from typing import Union

import websockets
from websockets.asyncio.client import ClientConnection
from websockets.asyncio.client import connect as open_websocket

from tryon_protocol import (
    MAJOR_VERSION,
    POSE_CONVENTION,
    POSE_FRAME,
    SUBPROTOCOL,
    AckMessage,
    ClientMessage,
    DecodedFrame,
    DesignMessage,
    EditedMessage,
    EffectsMessage,
    ErrorMessage,
    FrameDecoder,
    GoodbyeMessage,
    HelloMessage,
    KeyframeRequestMessage,
    OutfitMessage,
    PongMessage,
    PoseMessage,
    ProtocolError,
    ReportMessage,
    StatusMessage,
    Topology,
    TopologyMessage,
    WelcomeMessage,
    encode,
    is_frame,
)

from .reading import read_message

Event = Union[  # noqa: UP007
    DecodedFrame,
    Topology,
    StatusMessage,
    ReportMessage,
    DesignMessage,
    EffectsMessage,
    OutfitMessage,
    EditedMessage,
    ErrorMessage,
    PongMessage,
    GoodbyeMessage,
]
MAX_MESSAGE_BYTES = 256 * 1024 * 1024
"""Longest message taken from a server: a topology of a very large garment."""
MAX_WAITING_MESSAGES = 64
"""Received messages that wait to be read before the connection stops reading. Few are frames: those need credit."""
CLOSE_TIMEOUT = 2.0
"""s to wait for the server's half of the closing handshake."""
CLIENT_NAME = "tryon-python"


class Stream:
    """An open connection after the handshake. Iterate over it, or over `frames()`; one iteration at a time.

    Every frame is acknowledged as soon as it is decoded, which is what paces the server.

    welcome: the server's answer to `hello`. topology, status, report, design, effects, outfit: the newest received, or
    None. errors: all `error` messages received, oldest first. goodbye: why the server closes, or None.
    """

    def __init__(self, connection: ClientConnection, welcome: WelcomeMessage) -> None:
        self._connection = connection
        self._decoder = FrameDecoder()
        self._lost = False
        self._pose_seq = 0
        self.welcome = welcome
        self.topology: Topology | None = None
        self.status: StatusMessage | None = None
        self.report: ReportMessage | None = None
        self.errors: list[ErrorMessage] = []
        self.design: DesignMessage | None = None
        self.effects: EffectsMessage | None = None
        self.outfit: OutfitMessage | None = None
        self.goodbye: GoodbyeMessage | None = None

    async def __aiter__(self) -> AsyncIterator[Event]:
        """Everything the server sends, decoded, until it closes in good order.

        Raises:
            ProtocolError: a message of the server can't be read, or it sent a fatal `error` (with its code).
            websockets.ConnectionClosedError: the connection broke.
        """
        while True:
            try:
                data = await self._connection.recv()
            except websockets.ConnectionClosedOK:
                return
            except websockets.ConnectionClosed:
                if self.goodbye is not None:
                    return
                raise
            event = await self._take(data)
            if event is not None:
                yield event

    async def frames(self) -> AsyncIterator[DecodedFrame]:
        """The decoded frames alone; `topology`, `status`, `report` and `errors` are kept up to date meanwhile."""
        async for event in self:
            if isinstance(event, DecodedFrame):
                yield event

    async def send(self, message: ClientMessage) -> None:
        """Send any message, such as `SetMotionMessage(motion="walk")`."""
        await self._connection.send(encode(message))

    async def send_pose(
        self,
        root: Sequence[float],
        rotations: Sequence[Sequence[float]],
        t: float,
        *,
        subject: str | None = None,
    ) -> int:
        """Send a pose of the session's body and return its seq, which frames solved for it carry as `pose_seq`.

        Args:
            root: (3,) m, position of joint 0 in the session's frame.
            rotations: (J,4) unit quaternions x, y, z, w, in the order of `topology.body.joint_names`.
            t: s, when the pose was captured, on a steady clock.
            subject: whose body; the session's first one when not given.
        """
        x, y, z = (float(value) for value in root)
        self._pose_seq += 1
        await self.send(
            PoseMessage(
                subject=self.welcome.subjects[0] if subject is None else subject,
                convention=POSE_CONVENTION,
                frame=POSE_FRAME,
                t=t,
                seq=self._pose_seq,
                root=(x, y, z),
                rotations=tuple((float(a), float(b), float(c), float(d)) for a, b, c, d in rotations),
                ack=self._decoder.last_seq,
            )
        )
        return self._pose_seq

    async def _take(self, data: str | bytes) -> Event | None:
        if isinstance(data, str):
            raise ProtocolError(
                "malformed_message",
                "$",
                "The server sent a text message.",
                "Check that the address is a tryon stream.",
            )
        if is_frame(data):
            return await self._take_frame(data)
        message = read_message(data)
        if isinstance(message, TopologyMessage):
            self.topology = Topology.from_message(message)
            self._decoder.set_topology(self.topology)
            return self.topology
        if isinstance(message, StatusMessage):
            self.status = message
        elif isinstance(message, ReportMessage):
            self.report = message
        elif isinstance(message, EffectsMessage):
            self.effects = message
        elif isinstance(message, OutfitMessage):
            self.outfit = message
        elif isinstance(message, DesignMessage):
            self.design = message
        elif isinstance(message, GoodbyeMessage):
            self.goodbye = message
        elif isinstance(message, ErrorMessage):
            self.errors.append(message)
            if message.fatal:
                raise as_exception(message)
        return None if isinstance(message, WelcomeMessage) else message

    async def _take_frame(self, data: bytes) -> DecodedFrame | None:
        try:
            frame = self._decoder.decode(data)
        except ProtocolError as exc:
            if exc.code not in ("missing_base", "unknown_topology"):
                raise
            if not self._lost:
                self._lost = True
                await _send_if_open(self._connection, KeyframeRequestMessage(reason=exc.code))
            return None
        self._lost = False
        await _send_if_open(self._connection, AckMessage(seq=frame.seq))
        return frame


@contextlib.asynccontextmanager
async def connect(
    url: str,
    *,
    client: str = CLIENT_NAME,
    codecs: tuple[str, ...] = ("zstd",),
    resume: str | None = None,
    trust: ssl.SSLContext | None = None,
) -> AsyncIterator[Stream]:
    """Open a session's stream and shake hands.

    Args:
        url: address such as "ws://localhost:8000/api/sessions/ID/stream".
        client: name and version of the program, for the server's log.
        codecs: () asks for uncompressed frames.
        resume: `welcome.resume_token` of a lost connection.
        trust: whom to trust, for wss; None for the system's authorities.

    Raises:
        ProtocolError: the server refused the client (with its code), or doesn't speak this protocol.
        OSError, websockets.WebSocketException: no connection came about.
    """
    async with open_websocket(
        url,
        subprotocols=[websockets.Subprotocol(SUBPROTOCOL)],
        compression=None,
        max_size=MAX_MESSAGE_BYTES,
        max_queue=MAX_WAITING_MESSAGES,
        close_timeout=CLOSE_TIMEOUT,
        ssl=trust if trust is not None else (True if url.startswith("wss:") else None),
    ) as connection:
        hello = HelloMessage(versions=(MAJOR_VERSION,), client=client, codecs=codecs, resume=resume)
        await _send_if_open(connection, hello)
        first = await connection.recv()
        welcome = read_message(first) if isinstance(first, bytes) and not is_frame(first) else None
        if isinstance(welcome, ErrorMessage):
            raise as_exception(welcome)
        if not isinstance(welcome, WelcomeMessage):
            raise ProtocolError(
                "malformed_message",
                "$",
                "The server didn't answer `hello` by `welcome`.",
                "Check that the address is a tryon stream.",
            )
        yield Stream(connection, welcome)


async def _send_if_open(connection: ClientConnection, message: ClientMessage) -> None:
    """Send what only the server wants to know: when it has closed, what it sent before is still to be read."""
    with contextlib.suppress(websockets.ConnectionClosed):
        await connection.send(encode(message))


def as_exception(message: ErrorMessage) -> ProtocolError:
    """An `error` of the server as the exception that its code would be raised as here."""
    return ProtocolError(message.code, message.place, message.message, message.remedy)
