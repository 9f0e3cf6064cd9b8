"""Values from one process to another: their arrays in memory that both see, and not through a pipe.

A pipe is written and read in pieces of some 64 KB, each by a copy: 27 MB of a garment of 20,000 vertices keep whoever
reads them for 0.1 s, and a simulation misses its frames. Here the file descriptor of that memory goes through the
socket (unix(7), SCM_RIGHTS), and the arrays are where they were written (PEP 574). What is written to them stays with
the process that writes.
"""

from __future__ import annotations

import mmap
import os
import pickle
from collections.abc import Sequence
from multiprocessing.connection import Connection
from multiprocessing.reduction import recv_handle, send_handle
from typing import Any, NamedTuple

ALIGNED = 64  # bytes: where arrays begin, as an allocator has them


class Packed(NamedTuple):
    """A value on its way: what it is but for its arrays' contents, and these."""

    rest: bytes
    arrays: Sequence[bytearray | memoryview]


def pack(value: object) -> Packed:
    """The value ready to be sent; its arrays' contents are not copied yet. Raises what pickle.dumps raises."""
    buffers: list[pickle.PickleBuffer] = []
    rest = pickle.dumps(value, protocol=5, buffer_callback=buffers.append)
    return Packed(rest, [buffer.raw() for buffer in buffers])


def unpack(packed: Packed) -> Any:
    """The value. Raises what pickle.loads raises."""
    return pickle.loads(packed.rest, buffers=packed.arrays)


def send(connection: Connection, value: object) -> None:
    """Send a value through a connection of `Pipe()`, to a process that calls `receive`. Raises OSError."""
    send_packed(connection, pack(value))


def send_packed(connection: Connection, packed: Packed) -> None:
    """`send` of what is packed."""
    rest, raw = packed
    sizes = [len(part) for part in raw]
    if not sum(sizes):
        connection.send((rest, sizes))
        return
    memory = os.memfd_create("handed over")
    try:
        for part, start in zip(raw, _starts(sizes)):
            os.lseek(memory, start, os.SEEK_SET)
            _write(memory, part)
        connection.send((rest, sizes))  # once all is there: who receives it waits for nothing
        send_handle(connection, memory, None)
    finally:
        os.close(memory)


def receive(connection: Connection) -> Any:
    """The value that was sent; waits for it. Raises EOFError or OSError where the other process has ended."""
    return unpack(receive_packed(connection))


def receive_packed(connection: Connection) -> Packed:
    """`receive` of what is packed still."""
    rest, sizes = connection.recv()
    if not sum(sizes):
        return Packed(rest, [bytearray() for _ in sizes])
    memory = recv_handle(connection)
    try:
        both = mmap.mmap(memory, 0, flags=mmap.MAP_PRIVATE, prot=mmap.PROT_READ | mmap.PROT_WRITE)
    finally:
        os.close(memory)
    view = memoryview(both)
    return Packed(rest, [view[start : start + size] for start, size in zip(_starts(sizes), sizes)])


def _starts(sizes: list[int]) -> list[int]:
    starts, end = [], 0
    for size in sizes:
        starts.append(end)
        end += -(-size // ALIGNED) * ALIGNED
    return starts


def _write(file: int, part: bytearray | memoryview) -> None:
    data = memoryview(part)
    while data:
        data = data[os.write(file, data) :]
