"""How often the host waits for a GPU within a frame."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import Any
from unittest import mock

import warp as wp

from tryon_solver.linalg import read_back


class Waits:
    """`count` of them, of the frame counted last: readings that were waited for, arrays that were read by themselves,
    and looks at whether a loop outside of graphs goes on. Of a processor, which waits for nobody, it stays 0."""

    def __init__(self, device: str) -> None:
        self._on_gpu = wp.get_device(device).is_cuda
        self.count = 0

    @contextlib.contextmanager
    def counted(self) -> Iterator[None]:
        """Count what waits within."""
        self.count = 0
        if not self._on_gpu:
            yield
            return
        wait, numpy, loop = read_back.wait, wp.array.numpy, wp.capture_while

        def waited(*arguments: Any) -> None:
            self.count += 1
            wait(*arguments)

        def read(array: wp.array) -> Any:
            self.count += array.device.is_cuda
            return numpy(array)

        def looked(more: wp.array, turn: Callable[[], None], **options: Any) -> None:
            def counted_turn() -> None:
                self.count += 1
                turn()

            in_graph = more.device.is_capturing
            self.count += not in_graph
            loop(more, turn if in_graph else counted_turn, **options)

        with (
            mock.patch.object(read_back, "wait", waited),
            mock.patch.object(wp.array, "numpy", read),
            mock.patch.object(wp, "capture_while", looked),
        ):
            yield
