"""Sparse offsets of the simulated body surface from the posed one. PROTOCOL.md section 7.5."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import zstandard

from .compression import inflate
from .errors import ProtocolError
from .frames import malformed
from .grid import INT16_MAX
from .planes import merge, split

BYTES_PER_OFFSET = 10


def find_offsets(
    simulated: npt.NDArray[np.floating], posed: npt.NDArray[np.float64], shift: npt.NDArray[np.float64], grid: float
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int32]]:
    """Vertices whose simulated place differs from the posed one by more than q/2 along an axis, and by how much.

    Args:
        simulated: (B,3) m. posed: (B,3) m; overwritten. shift: (3,) m added to simulated. grid: q in m.

    Returns:
        vertex numbers (K,) ascending and offsets (3,K) in units of q; posed + q * offset is within q/2 of simulated.

    Raises:
        ProtocolError: code "unencodable_position" for NaN or an offset beyond int16, naming the vertex.
    """
    difference = np.subtract(simulated, posed, out=posed)
    if shift.any():
        difference += shift
    difference /= grid
    far = ~((difference <= 0.5) & (difference >= -0.5))
    vertices = np.flatnonzero(far[:, 0] | far[:, 1] | far[:, 2])
    offsets = np.rint(difference[vertices].T)
    if not (np.abs(offsets) <= INT16_MAX).all():
        first = int(vertices[np.flatnonzero(~(np.abs(offsets) <= INT16_MAX).all(axis=0))[0]])
        raise ProtocolError(
            "unencodable_position",
            f"body[{first}]",
            f"The simulated surface is at {np.asarray(simulated)[first].tolist()} m, not a finite place within "
            f"{INT16_MAX * grid:.2f} m of the posed skin.",
            "Don't publish this state: the solver has failed, or the pose isn't the one it was solved for.",
        )
    return vertices, offsets.astype(np.int32)


def pack_offsets(
    vertices: npt.NDArray[np.int64], offsets: npt.NDArray[np.int32], compressor: zstandard.ZstdCompressor | None
) -> bytes:
    """Gaps between vertex numbers as four byte planes, then the offsets as six. compressor: None leaves them bare."""
    gaps = np.diff(vertices, prepend=0).astype("<u4")
    planes = gaps.view(np.uint8).reshape(-1, 4).T.tobytes() + split(offsets)
    return compressor.compress(planes) if compressor and planes else planes


def unpack_offsets(
    data: bytes | memoryview, count: int, vertex_count: int, *, compressed: bool
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int32]]:
    """Inverse of `pack_offsets`: vertex numbers (K,) and offsets (3,K) in grid units.

    Raises:
        ProtocolError: codes "malformed_frame", "malformed_compression".
    """
    if count > vertex_count:
        raise malformed("frame.offset_count", f"{count} offsets for {vertex_count} body vertices.")
    planes = inflate(data, count * BYTES_PER_OFFSET, "frame.offsets") if compressed and count else data
    if len(planes) != count * BYTES_PER_OFFSET:
        raise malformed("frame.offsets", f"{len(planes)} bytes for {count} offsets of {BYTES_PER_OFFSET}.")
    gap_bytes = np.frombuffer(planes, dtype=np.uint8, count=4 * count).reshape(4, count)
    gaps = np.ascontiguousarray(gap_bytes.T).view("<u4").reshape(count).astype(np.int64)
    vertices = np.cumsum(gaps)
    if count and ((gaps[1:] == 0).any() or vertices[-1] >= vertex_count):
        raise malformed("frame.offsets", "The vertex numbers don't ascend within the body.")
    return vertices, merge(memoryview(planes)[4 * count :], count)
