"""Simulated states to frames: one encoder per session, shared by all its viewers. PROTOCOL.md section 7."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import zstandard

from .errors import ProtocolError
from .frames import FLAG_OFFSETS_ZSTD, Codec, EncodedFrame, FrameHeader
from .grid import Units, follow, quantise
from .offsets import find_offsets, pack_offsets
from .planes import fits_int16, split
from .skinning import Skinner
from .topology import Topology

Doubles = npt.NDArray[np.float64]
KEYFRAME_INTERVAL = 1.0
"""s between frames that stand alone: how long a viewer that lost its base waits at most for a shared frame."""
MAX_SEQ = 2**32 - 1
FARTHEST_BASE = 65536
"""Units. When the origin has moved farther than this since the base, no difference is tried: it could leave int32."""


@dataclass(frozen=True)
class _State:
    """What the last frame said, so that it can be said again in a form that stands alone."""

    header: FrameHeader
    units: Units
    pose: bytes
    offset_vertices: npt.NDArray[np.int64]
    offsets: npt.NDArray[np.int32]


class FrameEncoder:
    """Turns each simulated state that is to be sent into one frame; the base of a difference is the last frame encoded.

    Drop states before `encode`, never frames after it. A viewer that did not get every frame since the last one that
    stands alone gets `standalone()` instead, until the next such frame (`ViewerWindow` keeps the books).
    """

    def __init__(self, topology: Topology, *, keyframe_interval: float = KEYFRAME_INTERVAL, first_seq: int = 1) -> None:
        """keyframe_interval: s on the clock of `t_published`. first_seq: number of the first frame."""
        self._interval = keyframe_interval
        self._next_seq = first_seq
        self._compressor = zstandard.ZstdCompressor(level=1)
        self._origin = np.zeros(3, dtype=np.int64)
        self.set_topology(topology)

    @property
    def topology(self) -> Topology:
        return self._topology

    def set_topology(self, topology: Topology) -> None:
        """Go on with another topology; sequence numbers run on, the next frame stands alone."""
        self._topology = topology
        self._skinner = Skinner(topology.body)
        self._state: _State | None = None
        self._before: Units | None = None
        self._before_seq = 0
        self._keyframe_wanted = True
        self._keyframe_time = 0.0
        self._standalone: dict[bool, EncodedFrame] = {}

    def request_keyframe(self) -> None:
        """The next frame stands alone."""
        self._keyframe_wanted = True

    def encode(
        self,
        cloth: npt.NDArray[np.floating],
        body: npt.NDArray[np.floating],
        root: npt.NDArray[np.float64],
        rotations: npt.NDArray[np.floating],
        *,
        t_sim: float,
        t_published: float,
        pose_seq: int = 0,
        space_origin: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> EncodedFrame:
        """The shared frame for one state.

        Args:
            cloth: (N,3) m simulated cloth vertices.
            body: (B,3) m simulated body surface.
            root: (3,) m position of joint 0 in the session's frame.
            rotations: (J,4) local quaternions x, y, z, w of the pose the state was solved for; sent as float32.
            t_sim: s, time of the pose, on the poses' clock. t_published: s, the server's steady clock now.
            pose_seq: number of the client's pose; 0 when the server plays a motion.
            space_origin: m, where the origin of `cloth` and `body` lies in the session's frame.

        Raises:
            ProtocolError: codes "unencodable_position", "unencodable_pose", "cloth_too_large", "wrong_shape". Nothing
                has changed then: the next call goes on from the last frame.
        """
        self._check_shapes(cloth, body, root, rotations, t_sim, t_published)
        topology, shift = self._topology, np.array(space_origin, dtype=np.float64)
        root = np.asarray(root, dtype=np.float64)
        sent_rotations = np.ascontiguousarray(rotations, dtype="<f4")
        units = quantise(cloth, topology.grid, shift, "cloth")
        origin = follow(self._origin, units)
        posed = self._skinner.pose(root, sent_rotations)
        offset_vertices, offsets = find_offsets(body, posed, shift, topology.grid)

        due = self._keyframe_wanted or t_published - self._keyframe_time >= self._interval
        delta = None if due else self._difference(units, origin)
        header = FrameHeader(
            codec=Codec.KEY,
            flags=0,
            topology_id=topology.topology_id,
            seq=self._next_seq,
            base_seq=0,
            pose_seq=pose_seq,
            origin=(int(origin[0]), int(origin[1]), int(origin[2])),
            t_sim=t_sim,
            t_published=t_published,
            cloth_vertices=topology.cloth_vertex_count,
            joints=len(topology.body.joint_names),
            cloth_bytes=0,
            offset_count=len(offset_vertices),
        )
        pose = root.astype("<f8").tobytes() + sent_rotations.tobytes()
        last, self._state = self._state, _State(header, units, pose, offset_vertices, offsets)
        self._standalone = {}
        self._origin = origin
        self._next_seq += 1
        if delta is None or last is None:
            self._before, self._before_seq = None, 0
            self._keyframe_wanted, self._keyframe_time = False, t_published
            return self.standalone()
        base = last.header.seq
        codec, needs = (Codec.DELTA1, (base,)) if self._before is None else (Codec.DELTA2, (base, self._before_seq))
        self._before, self._before_seq = last.units, base
        cloth_block = self._compressor.compress(split(delta))
        return self._assemble(replace(header, base_seq=base), codec, cloth_block, compressed=True, needs=needs)

    def standalone(self, *, compressed: bool = True) -> EncodedFrame:
        """The last state once more, with the same seq, in a form that needs no other frame.

        compressed: False for a client that named no "zstd" in its hello: int16 positions and nothing inflated.

        Raises:
            ProtocolError: code "no_frame" before the first `encode`.
        """
        state = self._state
        if state is None:
            raise ProtocolError("no_frame", "encoder", "No frame was encoded yet.", "Call encode() first.")
        if compressed not in self._standalone:
            relative = state.units - np.array(state.header.origin, dtype=np.int32)[:, None]
            steps = np.diff(relative, axis=1, prepend=0)
            if compressed and fits_int16(steps):
                codec, block = Codec.KEY, self._compressor.compress(split(steps))
            else:
                codec, block = Codec.RAW, relative.T.astype("<i2").tobytes()
            self._standalone[compressed] = self._assemble(state.header, codec, block, compressed=compressed, needs=())
        return self._standalone[compressed]

    def _difference(self, units: Units, origin: npt.NDArray[np.int64]) -> npt.NDArray[np.int32] | None:
        """What DELTA1 or DELTA2 carries; None when there is no base or a difference leaves int16."""
        if self._state is None:
            return None
        moved = np.abs(origin - np.array(self._state.header.origin))
        if (moved > FARTHEST_BASE).any():
            return None
        delta = units - self._state.units
        if self._before is not None:
            delta -= self._state.units - self._before
        return delta if fits_int16(delta) else None

    def _assemble(
        self, header: FrameHeader, codec: Codec, cloth_block: bytes, *, compressed: bool, needs: tuple[int, ...]
    ) -> EncodedFrame:
        state = self._state
        assert state is not None
        offset_block = pack_offsets(state.offset_vertices, state.offsets, self._compressor if compressed else None)
        header = replace(
            header, codec=codec, flags=FLAG_OFFSETS_ZSTD if compressed else 0, cloth_bytes=len(cloth_block)
        )
        return EncodedFrame(header.pack() + state.pose + cloth_block + offset_block, header.seq, codec, needs)

    def _check_shapes(
        self,
        cloth: npt.NDArray[np.floating],
        body: npt.NDArray[np.floating],
        root: npt.NDArray[np.float64],
        rotations: npt.NDArray[np.floating],
        t_sim: float,
        t_published: float,
    ) -> None:
        topology = self._topology
        expected = {
            "cloth": (np.shape(cloth), (topology.cloth_vertex_count, 3)),
            "body": (np.shape(body), (len(topology.body.rest_vertices), 3)),
            "root": (np.shape(root), (3,)),
            "rotations": (np.shape(rotations), (len(topology.body.joint_names), 4)),
        }
        for place, (shape, wanted) in expected.items():
            if shape != wanted:
                raise ProtocolError(
                    "wrong_shape",
                    place,
                    f"The shape is {shape}, topology {topology.topology_id} has {wanted}.",
                    "Call set_topology() when the garment or the body changes.",
                )
        if not (np.isfinite(t_sim) and np.isfinite(t_published)):
            raise _unencodable("t_sim", "A time isn't finite.")
        if not np.isfinite(root).all():
            raise _unencodable("root", f"The root is {np.asarray(root).tolist()}.")
        lengths = np.linalg.norm(rotations, axis=1)
        wrong = np.flatnonzero(~(np.abs(lengths - 1.0) <= 1e-3))
        if wrong.size:
            joint = int(wrong[0])
            name = topology.body.joint_names[joint]
            raise _unencodable(f"rotations[{joint}]", f"The rotation of joint {name!r} isn't a unit quaternion.")
        if self._next_seq > MAX_SEQ:
            raise ProtocolError("no_frame", "seq", "The sequence numbers are used up.", "Start a new session.")


def _unencodable(place: str, message: str) -> ProtocolError:
    return ProtocolError("unencodable_pose", place, message, "Give the finite pose that the state was solved for.")
