"""Arrays inside control messages: bytes that carry their dtype and shape. PROTOCOL.md section 4."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import zstandard

from .compression import inflate
from .errors import ProtocolError
from .messages import ArrayData

MAX_ARRAY_BYTES = 256 * 1024 * 1024
"""An array that would inflate to more than this is refused before anything is allocated."""


def pack_array(array: npt.NDArray[Any], dtype: str, *, compress: bool = True) -> ArrayData:
    """Put an array on the wire as `dtype` ("float32", "uint32", ...), whatever its own type is."""
    contiguous = np.ascontiguousarray(array, dtype=np.dtype(dtype).newbyteorder("<"))
    data = contiguous.tobytes()
    if compress:
        data = zstandard.ZstdCompressor(level=3).compress(data)
    return ArrayData(dtype=dtype, shape=contiguous.shape, codec="zstd" if compress else "none", data=data)  # type: ignore[arg-type]


def unpack_array(array: ArrayData, place: str, dtype: str, shape: tuple[int | None, ...]) -> npt.NDArray[Any]:
    """Read an array and check that it is what the message promises.

    Args:
        array: as received.
        place: its path in the message, for errors.
        dtype: the element type the message's definition asks for.
        shape: the extents it asks for; None where any extent will do.

    Raises:
        ProtocolError: code "invalid_array".
    """
    if array.dtype != dtype:
        raise _invalid(f"{place}.dtype", f"The elements are {array.dtype}.", f"Send {dtype}.")
    fits = len(array.shape) == len(shape) and all(want in (None, got) for want, got in zip(shape, array.shape))
    if not fits:
        wanted = "(" + ", ".join("any" if extent is None else str(extent) for extent in shape) + ")"
        raise _invalid(f"{place}.shape", f"The shape is {tuple(array.shape)}.", f"Send an array of shape {wanted}.")
    size = math.prod(array.shape) * np.dtype(dtype).itemsize
    if size > MAX_ARRAY_BYTES:
        raise _invalid(
            f"{place}.shape", f"The array would take {size} bytes.", f"Send at most {MAX_ARRAY_BYTES} bytes an array."
        )
    data = inflate(array.data, size, f"{place}.data") if array.codec == "zstd" else array.data
    if len(data) != size:
        raise _invalid(f"{place}.data", f"{len(data)} bytes came.", f"Send the {size} bytes of the stated shape.")
    return np.frombuffer(data, dtype=np.dtype(dtype).newbyteorder("<")).reshape(array.shape).astype(dtype)


def _invalid(place: str, message: str, remedy: str) -> ProtocolError:
    return ProtocolError("invalid_array", place, message, remedy)
