"""Launches that a GPU keeps as graphs, and loops whose end is decided on the device."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import warp as wp

from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.read_back import read

wp.set_module_options({"enable_backward": False})

NUMBER = wp.constant(0)
MORE = wp.constant(1)
HITS = wp.constant(2)


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


@wp.kernel
def begin_kernel(at_most: int, state: wp.array(dtype=wp.int32)):
    state[NUMBER] = 0
    state[MORE] = wp.where(at_most > 0, 1, 0)
    state[HITS] = 0


@wp.kernel
def next_kernel(at_most: int, state: wp.array(dtype=wp.int32)):
    if state[HITS] == 0:
        state[MORE] = 0
        return
    state[NUMBER] = state[NUMBER] + 1
    state[MORE] = wp.where(state[NUMBER] < at_most, 1, 0)
    state[HITS] = 0


@dataclass(frozen=True)
class Passes:
    """Passes over a list, repeated until one finds nothing to do.

    `state` (3,) int32: NUMBER of the pass, from 0; MORE is 1 while there is another; HITS of this pass, counted by its
    kernels.
    """

    state: wp.array

    @staticmethod
    def allocate(device: str) -> Passes:
        return Passes(wp.zeros(3, dtype=wp.int32, device=device))

    @cached_property
    def more(self) -> wp.array:
        """(1,) the loop's condition."""
        return self.state[MORE : MORE + 1]

    def repeat(self, one: Callable[[], None], at_most: int) -> None:
        """Launch `one` pass until it has no hits, `at_most` times; afterwards NUMBER passes have had some."""
        device = self.state.device
        launch(begin_kernel, 1, [at_most], [self.state], device=device)

        def turn() -> None:
            one()
            launch(next_kernel, 1, [at_most], [self.state], device=device)

        wp.capture_while(self.more, turn)

    def taken(self) -> int:
        """How many passes had hits. Waits for the device."""
        return int(read(self.state)[0][NUMBER])
