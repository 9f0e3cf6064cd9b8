"""What the filters that prove a motion free have in common: passes whose end is decided on the device, and scratch."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import warp as wp

from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.read_back import read

wp.set_module_options({"enable_backward": False})

NUMBER = wp.constant(0)
MORE = wp.constant(1)
HITS = wp.constant(2)

TURNS = 4  # passes between two looks of a GPU at whether there is another


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


def turns_at_once(array: wp.array) -> int:
    """Passes before it is asked whether there is another, where the array is: a GPU enters a loop's body in the time of
    two or three that find nothing to do."""
    return TURNS if wp.get_device(array.device).is_cuda else 1


@dataclass(frozen=True)
class Passes:
    """Passes over a list, repeated until one finds nothing to do.

    `state` (3,) int32: NUMBER of the pass, from 0; MORE is 1 while there is another, without which a pass is to change
    nothing; HITS of this pass, counted by its kernels.
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

        def turns() -> None:
            for _ in range(turns_at_once(self.state)):
                turn()

        if at_most > 0:
            turn()  # there is no need to ask for the first
        wp.capture_while(self.more, turns)

    @staticmethod
    def number_in(state: np.ndarray) -> int:
        """How many passes had hits, of a `state` that has been read."""
        return int(state[NUMBER])

    def taken(self) -> int:
        """How many passes had hits. Waits for the device."""
        return self.number_in(read(self.state)[0])


@dataclass(frozen=True)
class Filtering:
    """Scratch of the filters."""

    alpha_before: wp.array  # (A,) float32, the fractions that a pass began with, or of no length (bounds.py)
    travel: wp.array  # (A,) float32 m, the longest way each vertex may take in the coming move
    changed: wp.array  # (A,) int32, last pass of a filter that changed the vertex's motion
    passes: Passes

    @staticmethod
    def allocate(all_count: int, device: str, repeatable: bool) -> Filtering:
        """On a GPU what is found repeats bit for bit if it is `repeatable`."""
        kept = all_count if repeatable and wp.get_device(device).is_cuda else 0
        return Filtering(
            wp.zeros(kept, dtype=wp.float32, device=device),
            wp.zeros(all_count, dtype=wp.float32, device=device),
            wp.zeros(all_count, dtype=wp.int32, device=device),
            Passes.allocate(device),
        )
