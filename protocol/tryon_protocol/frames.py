"""The header of a binary frame and the codecs it names. PROTOCOL.md section 7 has the layout byte by byte."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from enum import IntEnum

from .errors import ProtocolError

MAGIC = 0xC1
"""First byte of every binary frame: the one byte that MessagePack never uses, so no control message begins with it."""
KIND_FRAME = 1
FLAG_OFFSETS_ZSTD = 1
_HEADER = struct.Struct("<BBBBIIIIiiiddIHHII")
HEADER_BYTES = _HEADER.size
ORIGIN_LIMIT = 2**31 - 2**16


class Codec(IntEnum):
    """How a frame carries the cloth."""

    RAW = 0
    """int16 x, y, z relative to the origin, vertex by vertex; stands alone. Every client reads it."""
    KEY = 1
    """Difference to the vertex before, in planes, zstd; stands alone."""
    DELTA1 = 2
    """Difference to the base frame, in planes, zstd."""
    DELTA2 = 3
    """Difference to the straight line through the base frame and the frame before it, in planes, zstd."""


@dataclass(frozen=True)
class FrameHeader:
    """The fixed part of a frame.

    seq: number of the frame in its session, 1 or more, growing. base_seq: frame the difference is to; 0: stands alone.
    pose_seq: client pose that the body goes to, or is at; 0: none yet, or a motion the server plays.
    origin: (3) grid units that RAW and KEY positions are relative to.
    t_sim: s, time of the pose shown, on the poses' clock. t_published: s, the server's steady clock at the encoding.
    cloth_vertices: N. joints: J. cloth_bytes: size of the cloth block. offset_count: body vertices with an offset.
    """

    codec: Codec
    flags: int
    topology_id: int
    seq: int
    base_seq: int
    pose_seq: int
    origin: tuple[int, int, int]
    t_sim: float
    t_published: float
    cloth_vertices: int
    joints: int
    cloth_bytes: int
    offset_count: int

    @property
    def pose_bytes(self) -> int:
        """Root float64[3], then J rotations of float32[4]."""
        return 24 + 16 * self.joints

    def pack(self) -> bytes:
        return _HEADER.pack(
            MAGIC,
            KIND_FRAME,
            self.codec,
            self.flags,
            self.topology_id,
            self.seq,
            self.base_seq,
            self.pose_seq,
            *self.origin,
            self.t_sim,
            self.t_published,
            self.cloth_vertices,
            self.joints,
            HEADER_BYTES,
            self.cloth_bytes,
            self.offset_count,
        )


@dataclass(frozen=True)
class EncodedFrame:
    """One frame as bytes, and what a viewer must hold to read it.

    needs: () when it stands alone, (base,) for DELTA1, (base, frame before the base) for DELTA2.
    """

    data: bytes
    seq: int
    codec: Codec
    needs: tuple[int, ...]

    @property
    def stands_alone(self) -> bool:
        return not self.needs


def read_header(data: bytes | memoryview) -> tuple[FrameHeader, int]:
    """The header and the place where the payload begins.

    Raises:
        ProtocolError: codes "malformed_frame", "unknown_codec".
    """
    if len(data) < HEADER_BYTES:
        raise malformed("frame", f"{len(data)} bytes are shorter than the header of {HEADER_BYTES}.")
    (
        magic,
        kind,
        codec,
        flags,
        topology_id,
        seq,
        base_seq,
        pose_seq,
        origin_x,
        origin_y,
        origin_z,
        t_sim,
        t_published,
        cloth_vertices,
        joints,
        header_bytes,
        cloth_bytes,
        offset_count,
    ) = _HEADER.unpack_from(data)
    if magic != MAGIC or kind != KIND_FRAME:
        raise malformed("frame.magic", f"It begins with {magic:#04x} {kind:#04x}, not {MAGIC:#04x} {KIND_FRAME:#04x}.")
    if codec not in list(Codec):
        raise ProtocolError(
            "unknown_codec", "frame.codec", f"Codec {codec} isn't known.", "Update this client, or ask for codec 0."
        )
    if header_bytes < HEADER_BYTES or header_bytes > len(data):
        raise malformed("frame.header_bytes", f"A header of {header_bytes} bytes doesn't fit.")
    if seq == 0 or (base_seq == 0) != (codec in (Codec.RAW, Codec.KEY)) or base_seq >= seq:
        raise malformed("frame.base_seq", f"Frame {seq} with codec {codec} can't have the base {base_seq}.")
    if not (math.isfinite(t_sim) and math.isfinite(t_published)):
        raise malformed("frame.t_sim", "A time isn't finite.")
    origin = (origin_x, origin_y, origin_z)
    if any(abs(unit) > ORIGIN_LIMIT for unit in origin):
        raise malformed("frame.origin", f"The origin {origin} is too near the end of int32.")
    header = FrameHeader(
        codec=Codec(codec),
        flags=flags,
        topology_id=topology_id,
        seq=seq,
        base_seq=base_seq,
        pose_seq=pose_seq,
        origin=origin,
        t_sim=t_sim,
        t_published=t_published,
        cloth_vertices=cloth_vertices,
        joints=joints,
        cloth_bytes=cloth_bytes,
        offset_count=offset_count,
    )
    return header, header_bytes


def malformed(place: str, message: str) -> ProtocolError:
    """A frame whose bytes contradict PROTOCOL.md section 7."""
    return ProtocolError(
        "malformed_frame", place, message, "The sender breaks the protocol, or the message was cut: reconnect."
    )
