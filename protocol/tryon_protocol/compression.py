"""Zstandard with the size known beforehand, so that no message can inflate to more than it may."""

from __future__ import annotations

import zstandard

from .errors import ProtocolError

_decompressor = zstandard.ZstdDecompressor()


def inflate(data: bytes | memoryview, size: int, place: str) -> bytes:
    """Decompress one zstd frame that must hold exactly `size` bytes.

    Raises:
        ProtocolError: code "malformed_compression" when it isn't such a frame.
    """
    try:
        stated = zstandard.frame_content_size(data)
        if stated != size:
            raise _malformed(place, f"The zstd frame states {stated} bytes inside, {size} were expected.")
        return _decompressor.decompress(data, max_output_size=size, allow_extra_data=False) if size else b""
    except zstandard.ZstdError as exc:
        raise _malformed(place, f"This isn't a zstd frame ({exc}).") from exc


def _malformed(place: str, message: str) -> ProtocolError:
    return ProtocolError(
        "malformed_compression", place, message, "Send one zstd frame that states its content size in its header."
    )
