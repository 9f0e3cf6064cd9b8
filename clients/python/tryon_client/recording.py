"""Decoded frames to an .npz file: what was published, for judging and replaying offline."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tryon_protocol import DecodedFrame, ProtocolError, Topology

from .stream import Stream


class Recording:
    """Frames of one topology, kept in memory until `save`.

    The file's arrays, for T frames: cloth (T,N,3) float64 m, cloth_faces (F,3) int32, body (T,B,3) float64 m,
    body_faces (F',3) int32, t (T,) float64 s of the pose, t_published (T,) float64 s server's clock, seq (T,) and
    pose_seq (T,) int64, root (T,3) float64 m, rotations (T,J,4) float32 x, y, z, w.
    """

    def __init__(self, topology: Topology) -> None:
        self.topology = topology
        self.frames: list[DecodedFrame] = []

    def add(self, frame: DecodedFrame) -> None:
        """Raises: ProtocolError, code "unknown_topology", when the garment or the body has changed meanwhile."""
        if frame.topology_id != self.topology.topology_id:
            raise ProtocolError(
                "unknown_topology",
                "frame.topology_id",
                f"Frame {frame.seq} is of topology {frame.topology_id}, the recording of {self.topology.topology_id}.",
                "Save this recording and begin another one.",
            )
        self.frames.append(frame)

    def save(self, path: str | Path) -> None:
        """Write the file.

        Raises:
            ValueError: there is no frame in it.
        """
        frames = self.frames
        if not frames:
            raise ValueError("There is no frame in this recording: wait until the session runs.")
        np.savez_compressed(
            path,
            cloth=np.stack([frame.cloth for frame in frames]),
            cloth_faces=self.topology.faces.astype(np.int32),
            body=np.stack([frame.body for frame in frames]),
            body_faces=self.topology.body.faces.astype(np.int32),
            t=np.array([frame.t_sim for frame in frames]),
            t_published=np.array([frame.t_published for frame in frames]),
            seq=np.array([frame.seq for frame in frames], dtype=np.int64),
            pose_seq=np.array([frame.pose_seq for frame in frames], dtype=np.int64),
            root=np.stack([frame.root for frame in frames]),
            rotations=np.stack([frame.rotations for frame in frames]),
        )


async def record(
    stream: Stream,
    *,
    frame_count: int | None = None,
    seconds: float | None = None,
    clock: Callable[[], float] = time.monotonic,
    progress: Callable[[DecodedFrame], None] | None = None,
) -> Recording:
    """Record from now on until a limit is reached or the server closes.

    Args:
        stream: an open connection.
        frame_count: most frames. seconds: longest time on `clock`, from the first frame on. One of them must be given.
        progress: called with each frame.

    Raises:
        ValueError: no limit, or the stream ended before its first frame.
        ProtocolError: as `Stream`; also when the topology changes.
    """
    if frame_count is None and seconds is None:
        raise ValueError("A recording needs an end: give frame_count or seconds.")
    recording: Recording | None = None
    end = float("inf")
    async for frame in stream.frames():
        if recording is None:
            assert stream.topology is not None
            recording = Recording(stream.topology)
            end = clock() + seconds if seconds is not None else end
        recording.add(frame)
        if progress is not None:
            progress(frame)
        if len(recording.frames) == frame_count or clock() >= end:
            break
    if recording is None:
        reason = stream.goodbye.reason if stream.goodbye is not None else "no reason was given"
        raise ValueError(f"The server closed before the first frame: {reason}")
    return recording
