"""Integers to bytes that compress well: zigzag, then low bytes, then high bytes. PROTOCOL.md section 7.4."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .grid import INT16_MAX


def fits_int16(values: npt.NDArray[np.int32]) -> bool:
    """True when every value lies in [-32767, 32767]."""
    return not values.size or (int(values.max()) <= INT16_MAX and int(values.min()) >= -INT16_MAX)


def split(values: npt.NDArray[np.int32]) -> bytes:
    """(3,N) values that fit int16 -> 6 N bytes: zigzag, low bytes of x, y, z, then high bytes of x, y, z."""
    small = values.astype(np.int16)
    zigzag = ((small << 1) ^ (small >> 15)).view(np.uint16)
    return (zigzag & 0xFF).astype(np.uint8).tobytes() + (zigzag >> 8).astype(np.uint8).tobytes()


def merge(data: bytes | memoryview, count: int) -> npt.NDArray[np.int32]:
    """Inverse of `split`: 6 N bytes -> (3,N) int32."""
    planes = np.frombuffer(data, dtype=np.uint8).reshape(2, 3, count)
    zigzag = planes[0].astype(np.int32) | (planes[1].astype(np.int32) << 8)
    return (zigzag >> 1) ^ -(zigzag & 1)
