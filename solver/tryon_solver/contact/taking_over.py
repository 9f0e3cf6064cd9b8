"""Found stencils are put on the list of candidates by the device itself, so that nobody has to be told how many.

All of them or none: what there is no room for is found by no one else. The host looks at the counts when it reads
something anyway, makes room, and has it done again (broad_phase.py).
"""

from __future__ import annotations

from collections.abc import Sequence

import warp as wp

from tryon_solver.contact.candidates import Candidates
from tryon_solver.contact.found import CLOSE, PAIRS, STENCILS, Found
from tryon_solver.linalg.blocks import MOST_THREADS
from tryon_solver.linalg.launch import launch

wp.set_module_options({"enable_backward": False})


@wp.kernel
def begin_kernel(count: wp.array(dtype=wp.int32), fits: wp.array(dtype=wp.int32), end: wp.array(dtype=wp.int32)):
    fits[0] = 1
    end[0] = count[0]


@wp.kernel
def fit_kernel(
    counts: wp.array(dtype=wp.int32),
    pairs_room: int,
    close_room: int,
    stencils_room: int,
    capacity: int,
    fits: wp.array(dtype=wp.int32),
    end: wp.array(dtype=wp.int32),
    start_out: wp.array(dtype=wp.int32),
):
    """Where on the list these begin, and whether there is room for them and was for all that they were found of."""
    found = counts[STENCILS]
    start_out[0] = end[0]
    pairs = counts[PAIRS]
    close = counts[CLOSE]
    held = pairs >= 0 and pairs <= pairs_room and close >= 0 and close <= close_room
    if not held or found < 0 or found > wp.min(stencils_room, capacity - end[0]):
        fits[0] = 0
        return
    end[0] = end[0] + found


@wp.kernel
def copy_kernel(
    fits: wp.array(dtype=wp.int32),
    counts: wp.array(dtype=wp.int32),
    start: wp.array(dtype=wp.int32),
    threads: int,
    ids: wp.array(dtype=wp.vec4i),
    kind: wp.array(dtype=wp.int32),
    distance: wp.array(dtype=wp.float32),
    ids_out: wp.array(dtype=wp.vec4i),
    kind_out: wp.array(dtype=wp.int32),
    distance_out: wp.array(dtype=wp.float32),
):
    if fits[0] == 0:
        return
    for k in range(wp.tid(), counts[STENCILS], threads):
        at = start[0] + k
        ids_out[at] = ids[k]
        kind_out[at] = kind[k]
        distance_out[at] = distance[k]


@wp.kernel
def end_kernel(
    fits: wp.array(dtype=wp.int32), end: wp.array(dtype=wp.int32), count_out: wp.array(dtype=wp.int32)
):
    if fits[0] == 1:
        count_out[0] = end[0]


def take_over(candidates: Candidates, found: Sequence[Found]) -> None:
    """Append what was found to the list, and its number to `count`, if there is room for all; `fits` (1,) int32 tells.

    For a graph: the list's `size` is not known until somebody reads.
    """
    device = candidates.count.device
    fits, end = candidates.fits, candidates.end
    launch(begin_kernel, 1, [candidates.count], [fits, end], device=device)
    for one in found:
        rooms = [*one.rooms, candidates.capacity]
        launch(fit_kernel, 1, [one.counts, *rooms], [fits, end, one.start], device=device)
    for one in found:
        threads = min(len(one.ids), MOST_THREADS)
        stencils = [one.ids, one.kind, one.distance]
        into = [candidates.ids, candidates.kind, candidates.distance]
        launch(copy_kernel, threads, [fits, one.counts, one.start, threads, *stencils], into, device=device)
    launch(end_kernel, 1, [fits, end], [candidates.count], device=device)
