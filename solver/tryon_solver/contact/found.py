"""What one search of the broad phase found on one surface: its scratch, kept from search to search."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import count

import numpy as np
import warp as wp

from tryon_solver.linalg.read_back import read

PAIRS = wp.constant(0)
CLOSE = wp.constant(1)
STENCILS = wp.constant(2)

MOST = 1 << 28  # pairs or stencils: 6 GiB, and half of that again while it is made


SERIALS = count()  # of lists: where one was, another of its length may come to lie in part
LEAST = 1 << 12  # room of a list


def room_for(count: int) -> int:
    """How long a list is made that has to hold so many."""
    return max(LEAST, 1 << max(count - 1, 0).bit_length())


class CrowdedError(RuntimeError):
    """More contacts are in reach of a step than can be kept; the message says how many, and what to change."""


@dataclass
class Found:
    """Pairs of triangles, `triangles` vec2i of the cloth and of the surface; those of them that nothing keeps apart,
    `close` vec2i, with `between` vec2 m: stencils in that range of distances are looked for in them; and these, `ids`,
    `kind` and `distance` as in Candidates.

    `counts` (3,) int32, how many of each, by the places above, which may be more than there is room for; `start` (1,)
    int32, where on the list of candidates a GPU puts them; `serial` is another number for each that was ever allocated;
    `most` is how many pairs and stencils there were at most since that was asked last.
    """

    triangles: wp.array
    close: wp.array
    between: wp.array
    ids: wp.array
    kind: wp.array
    distance: wp.array
    counts: wp.array
    start: wp.array
    serial: int
    most: tuple[int, int] = (0, 0)

    @staticmethod
    def allocate(pairs: int, stencils: int, device: str) -> Found:
        """Nothing yet, with room for so many pairs of triangles and stencils."""
        return Found(
            wp.zeros(pairs, dtype=wp.vec2i, device=device),
            wp.zeros(pairs, dtype=wp.vec2i, device=device),
            wp.zeros(pairs, dtype=wp.vec2, device=device),
            wp.zeros(stencils, dtype=wp.vec4i, device=device),
            wp.zeros(stencils, dtype=wp.int32, device=device),
            wp.zeros(stencils, dtype=wp.float32, device=device),
            wp.zeros(3, dtype=wp.int32, device=device),
            wp.zeros(1, dtype=wp.int32, device=device),
            next(SERIALS),
        )

    def holds(self, pairs: int, stencils: int) -> bool:
        """Is there room for so many?"""
        return 0 <= pairs <= len(self.triangles) and 0 <= stencils <= len(self.ids)

    def with_room(self, pairs: int, stencils: int) -> Found:
        """Itself, or in its place one with room for so many. Raises CrowdedError where no memory would do."""
        if max(pairs, stencils) > MOST or min(pairs, stencils) < 0:  # more than 2^31 are counted as below none
            raise CrowdedError(
                f"over {MOST} contacts are in reach of one step: take shorter steps, a slower motion or a coarser mesh"
            )
        self.most = max(self.most[0], pairs), max(self.most[1], stencils)
        if self.holds(pairs, stencils):
            return self
        return Found.allocate(
            max(len(self.triangles), room_for(pairs)), max(len(self.ids), room_for(stencils)), str(self.ids.device)
        )

    def with_less_room(self) -> Found:
        """Itself, or in its place one with room for what was found at most since this was asked last."""
        pairs, stencils = (room_for(count) for count in self.most)
        self.most = 0, 0
        if pairs >= len(self.triangles) and stencils >= len(self.ids):
            return self
        return Found.allocate(min(pairs, len(self.triangles)), min(stencils, len(self.ids)), str(self.ids.device))


def counted(found: Sequence[Found]) -> list[tuple[int, int]]:
    """How many pairs of triangles and stencils there are of each, or should be. Waits for the device, once."""
    return [counts_of(counts) for counts in read(*(one.counts for one in found))]


def counts_of(counts: np.ndarray) -> tuple[int, int]:
    """How many pairs of triangles and stencils there are, of `counts` (3,) that have been read."""
    return int(counts[PAIRS]), int(counts[STENCILS])
