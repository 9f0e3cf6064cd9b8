"""What one search of the broad phase found on one surface: its scratch, kept from search to search."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import count

import numpy as np
import warp as wp

from tryon_solver.linalg.read_back import read

PAIRS = wp.constant(0)
CLOSE = wp.constant(1)
STENCILS = wp.constant(2)

Counts = tuple[int, int, int]  # by these places
NONE = (0, 0, 0)
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
    `most` is how many there were at most since that was asked last.
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
    most: Counts = NONE

    @staticmethod
    def allocate(rooms: Counts, device: str) -> Found:
        """Nothing yet, with room for so many pairs of triangles, close ones among them, and stencils."""
        pairs, close, stencils = rooms
        return Found(
            wp.zeros(pairs, dtype=wp.vec2i, device=device),
            wp.zeros(close, dtype=wp.vec2i, device=device),
            wp.zeros(close, dtype=wp.vec2, device=device),
            wp.zeros(stencils, dtype=wp.vec4i, device=device),
            wp.zeros(stencils, dtype=wp.int32, device=device),
            wp.zeros(stencils, dtype=wp.float32, device=device),
            wp.zeros(3, dtype=wp.int32, device=device),
            wp.zeros(1, dtype=wp.int32, device=device),
            next(SERIALS),
        )

    @property
    def rooms(self) -> Counts:
        """For how many of each there is room."""
        return len(self.triangles), len(self.close), len(self.ids)

    def with_room(self, counts: Counts) -> Found:
        """Itself, or in its place one with room for so many. Raises CrowdedError where no memory would do."""
        if max(counts) > MOST or min(counts) < 0:  # more than 2^31 are counted as below none
            raise CrowdedError(
                f"over {MOST} contacts are in reach of one step: take shorter steps, a slower motion or a coarser mesh"
            )
        self.most = each(max, self.most, counts)
        if all(count <= room for count, room in zip(counts, self.rooms)):
            return self
        return Found.allocate(each(max, self.rooms, rooms_for(counts)), str(self.ids.device))

    def with_less_room(self) -> Found:
        """Itself, or in its place one with room for what was found at most since this was asked last."""
        wanted = each(min, self.rooms, rooms_for(self.most))
        self.most = NONE
        return self if wanted == self.rooms else Found.allocate(wanted, str(self.ids.device))


def each(choose: Callable[[int, int], int], one: Counts, other: Counts) -> Counts:
    """The three chosen of two by two."""
    pairs, close, stencils = map(choose, one, other)
    return pairs, close, stencils


def rooms_for(counts: Counts) -> Counts:
    """How long lists are made that have to hold so many."""
    pairs, close, stencils = map(room_for, counts)
    return pairs, close, stencils


def counted(found: Sequence[Found]) -> list[Counts]:
    """How many there are of each, or should be. Waits for the device, once."""
    return [counts_of(counts) for counts in read(*(one.counts for one in found))]


def counts_of(counts: np.ndarray) -> Counts:
    """How many pairs of triangles, close ones among them, and stencils there are, of `counts` (3,) that have been
    read."""
    return int(counts[PAIRS]), int(counts[CLOSE]), int(counts[STENCILS])
