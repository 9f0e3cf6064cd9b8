"""Launching kernels with arguments that were packed before.

Warp takes about 20 us to check and pack a launch's arguments, as long as a kernel takes for a thousand vertices, and a
frame has hundreds of launches, on a GPU some fifty beside its graphs. Of an array a kernel gets its place in memory,
its shape and its strides: a launch with the same ones goes with the same pack, whichever arrays they are. What a graph
records is launched once: as Warp does it.

A recorded launch of Warp's on a CPU still copies every argument into the structure that the kernel reads, which takes
half of the time that is left: here that structure is kept as well, and the kernel is called with it.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from functools import cache, partial
from threading import Lock
from typing import Any

import warp as wp

PACKS_KEPT = 2048  # a garment's frames have some two hundred
LONGEST = 2**31  # threads whose numbers a kernel can tell

Dim = int | tuple[int, ...]


class _Packed:
    """A launch of one kernel with certain arrays, as it was made last."""

    def __init__(self, command: wp.Launch, dim: Dim, arguments: Sequence[Any]) -> None:
        self.command, self.dim = command, dim
        self.others = [k for k, value in enumerate(arguments) if type(value) is not wp.array]
        self.numbers = [number_of(value) for value in arguments]  # no arrays, nor structs, which hold some
        self.go = command.launch

    def launch(self, dim: Dim, arguments: Sequence[Any]) -> None:
        if dim != self.dim:
            self.resize(dim)
            self.dim = dim
        numbers = self.numbers
        for k in self.others:
            number = number_of(arguments[k])
            if number is None or number != numbers[k]:  # a struct may have been written to
                self.pack(k, arguments[k])
                numbers[k] = number
        self.go()

    def resize(self, dim: Dim) -> None:
        self.command.set_dim(dim)

    def pack(self, k: int, value: Any) -> None:
        self.command.set_param_at_index(k, value)


class _PackedForCpu(_Packed):
    """The same with the structure that the kernel's compiled function reads its arguments from."""

    def __init__(self, command: wp.Launch, dim: Dim, arguments: Sequence[Any]) -> None:
        super().__init__(command, dim, arguments)
        packed = command.params[1:]  # behind the bounds
        self.labels = tuple(argument.label for argument in command.kernel.adj.args)
        self.arguments = _structure(self.labels, tuple(type(one) for one in packed))(*packed)
        self.bind()

    def bind(self) -> None:
        told = ctypes.byref(self.command.bounds), ctypes.byref(self.arguments)
        self.go = partial(self.command.hooks.forward, *told)

    def resize(self, dim: Dim) -> None:
        bounds: Any = self.command.bounds
        if type(dim) is int and 0 < dim < LONGEST and len(bounds.shape) == 1 and bounds.coord_mult == 1:
            bounds.shape[0], bounds.size = dim, dim  # of a list's length, which is another in every call
        else:
            super().resize(dim)
            self.bind()

    def pack(self, k: int, value: Any) -> None:
        if number_of(value) is None:
            super().pack(k, value)
            value = self.command.params[1 + k]
        setattr(self.arguments, self.labels[k], value)


@cache
def _structure(labels: tuple[str, ...], types: tuple[type, ...]) -> type[ctypes.Structure]:
    """Of a kernel's arguments, as Warp lays it out for the compiled function."""
    return type("Arguments", (ctypes.Structure,), {"_fields_": list(zip(labels, types, strict=True))})


def number_of(value: object) -> int | float | None:
    """A number that is told from another by comparing; None for whatever else."""
    return value if type(value) in (int, float) else None  # type: ignore[return-value]


_packed: dict[tuple[Any, ...], _Packed] = {}
_packing = Lock()  # two threads that load a module at once would each unload the other's


def launch(
    kernel: wp.Kernel, dim: Dim, inputs: Sequence[Any], outputs: Sequence[Any], *, device: Any, block_dim: int = 256
) -> None:
    """`wp.launch` of a kernel without derivatives. No two threads may launch one with the same arrays at once."""
    if dim == 0:
        return
    on = wp.get_device(device)
    if on.is_capturing:
        wp.launch(kernel, dim, inputs, outputs, device=device, block_dim=block_dim)
        return
    arguments = [*inputs, *outputs]
    places: list[Any] = [kernel, block_dim]
    for value in arguments:
        if type(value) is wp.array:
            places += (value.ptr, value.shape, value.strides)
    key = tuple(places)
    kept = _packed.get(key)
    if kept is not None:
        kept.launch(dim, arguments)
        return
    if on.is_cpu:
        block_dim = 1  # a processor's blocks are of one thread
    with _packing:
        command = wp.launch(kernel, dim, arguments, device=device, record_cmd=True, block_dim=block_dim)
    if command is None:
        return  # of no threads
    command.fwd_args = None  # which holds the arrays
    if len(_packed) >= PACKS_KEPT:
        _packed.clear()
    packed = _packed[key] = (_PackedForCpu if on.is_cpu else _Packed)(command, dim, arguments)
    packed.launch(dim, arguments)


def launch_blocks(
    kernel: wp.Kernel, blocks: int, inputs: Sequence[Any], outputs: Sequence[Any], *, device: Any, block_dim: int
) -> None:
    """`wp.launch_tiled`: a block of threads each for so many; on a processor a block is one thread."""
    threads = 1 if wp.get_device(device).is_cpu else block_dim
    launch(kernel, (blocks, threads), inputs, outputs, device=device, block_dim=block_dim)
