"""Pictures as PNG files. https://www.w3.org/TR/png-3"""

from __future__ import annotations

import struct
import zlib

import numpy as np
import numpy.typing as npt

SIGNATURE = b"\x89PNG\r\n\x1a\n"
TRUECOLOUR, UP = 2, 2  # IHDR's colour type, and the filter that subtracts the row above


def png(pixels: npt.NDArray[np.uint8]) -> bytes:
    """An RGB picture (rows from the top, columns, 3) as a file."""
    height, width, _ = pixels.shape
    rows = pixels.reshape(height, 3 * width)
    above = np.vstack([np.zeros_like(rows[:1]), rows[:-1]])
    filtered = np.column_stack([np.full(height, UP, np.uint8), rows - above])
    header = struct.pack(">IIBBBBB", width, height, 8, TRUECOLOUR, 0, 0, 0)
    body = zlib.compress(filtered.tobytes(), 9)
    return SIGNATURE + chunk(b"IHDR", header) + chunk(b"IDAT", body) + chunk(b"IEND", b"")


def chunk(kind: bytes, content: bytes) -> bytes:
    """A chunk: length, kind, content and the checksum of both."""
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
