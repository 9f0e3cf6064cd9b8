"""Launches that a GPU keeps as graphs."""

from __future__ import annotations

from collections.abc import Callable

import warp as wp


def keeps_graphs(device: str) -> bool:
    """Does the device run graphs with conditions (a GPU whose driver knows such: CUDA 12.4), and is none being made?"""
    on = wp.get_device(device)
    return bool(on.is_cuda and not on.is_capturing and wp.is_conditional_graph_supported())


class KeptGraph:
    """Launches that are recorded once and repeated as one for as long as what they were recorded of stands: on a GPU
    they cost the processor next to nothing, however many they are."""

    def __init__(self) -> None:
        self._graph: wp.Graph | None = None
        self._key: object = None

    def run(self, body: Callable[[], None], key: object, device: str) -> None:
        """Launch what `body` launches.

        `body` must neither allocate nor read back; `key` names what it hands to kernels by value, and the arrays that
        may change place. Within another graph, or without graphs, it is simply called.
        """
        if not keeps_graphs(device):
            body()
            return
        if self._graph is None or key != self._key:
            with wp.ScopedCapture(device=device) as recorded:
                body()
            self._graph, self._key = recorded.graph, key
        wp.capture_launch(self._graph)
