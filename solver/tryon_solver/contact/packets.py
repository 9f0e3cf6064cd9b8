"""A GPU's walk of a tree for 32 neighbouring triangles at once, as rays are traced in packets (Wald et al. 2001,
"Interactive rendering with coherent ray tracing").

With a triangle to a thread each goes from node to node and waits for memory at every one, and at 20,000 vertices there
are too few of them to hide that. The threads of a packet look at nodes of one tree side by side, for the box around all
of their triangles; what comes of it each then holds to its own, out of the others' registers.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from tryon_solver.contact.found import PAIRS
from tryon_solver.contact.surfaces import Side
from tryon_solver.linalg.launch import launch_blocks
from tryon_solver.linalg.warps import WARP, free_slots, least_of_warp, number_of_lane, value_of_lane

wp.set_module_options({"enable_backward": False})

FAR = wp.constant(1.0e30)  # m
FILLED = 0.75  # of a packet that a square of the pattern fills on average: of what it would not hold, another is made


def packets_of(centres: np.ndarray, piece: np.ndarray) -> np.ndarray:
    """(P, 32) int32: triangles that are near each other on the cloth, and so stay, -1 where there is none. `centres`
    (F, 2) m are theirs in the pattern, `piece` (F,) says which of its pieces they are of: each is cut into squares."""
    squares = np.empty((len(centres), 3), np.int64)
    squares[:, 0] = piece
    for one in np.unique(piece):
        of_it = piece == one
        low, high = centres[of_it].min(axis=0), centres[of_it].max(axis=0)
        side = max(float(np.sqrt(np.prod(high - low) * FILLED * WARP / of_it.sum())), 1e-9)
        squares[of_it, 1:] = (centres[of_it] - low) // side
    _, square, count = np.unique(squares, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(square.ravel(), kind="stable")
    begun = np.repeat(np.cumsum(count) - count, count)
    within = np.arange(len(order)) - begun
    packets = -(-count // WARP)
    row = np.repeat(np.cumsum(packets) - packets, count) + within // WARP
    result = np.full((int(packets.sum()), WARP), -1, np.int32)
    result[row, within % WARP] = order
    return result


def pair_packets(packets: wp.array, given: Sequence[Any], triangles: wp.array, counts: wp.array) -> None:
    """Fill `triangles` with the pairs of the packets' triangles whose boxes overlap; `given`, all else that
    `pair_triangles_kernel` is."""
    inputs, made = [packets, *given], [triangles, counts]
    launch_blocks(pair_packets_kernel, len(packets), inputs, made, device=counts.device, block_dim=WARP)


@wp.kernel
def pair_packets_kernel(
    packets: wp.array2d(dtype=wp.int32),
    own: Side,
    other: Side,
    other_bvh: wp.uint64,
    other_gained: wp.array(dtype=wp.int32),
    same: int,
    anew: int,
    triangles_out: wp.array(dtype=wp.vec2i),
    counts: wp.array(dtype=wp.int32),
):
    """What `pair_triangles_kernel` finds, a packet to a block of 32 threads. Warp's query has room for what 32 leaves
    of up to four triangles hold, and leaves out the rest; those of our trees hold one."""
    packet, lane = wp.tid()
    t = packets[packet, lane]
    lower = wp.vec3(FAR, FAR, FAR)
    upper = -lower
    gained = bool(False)
    if t >= 0:
        gained = anew == 1 or own.budget[t] > own.known[t]
        if gained or (same == 0 and other_gained[0] == 1):
            lower = own.lower[t]
            upper = own.upper[t]
    low = wp.vec3(least_of_warp(lower[0]), least_of_warp(lower[1]), least_of_warp(lower[2]))
    high = -wp.vec3(least_of_warp(-upper[0]), least_of_warp(-upper[1]), least_of_warp(-upper[2]))
    query = wp.tile_bvh_query_aabb(other_bvh, low, high)
    while wp.tile_query_valid(query):
        found = wp.untile(wp.tile_bvh_query_next(query))
        its_lower = wp.vec3(FAR, FAR, FAR)
        its_upper = -its_lower
        its_gain = int(anew)
        if found >= 0:
            its_lower = other.lower[found]
            its_upper = other.upper[found]
            if anew == 0 and other.budget[found] > other.known[found]:
                its_gain = 1
        overlapped = int(0)  # a bit for each of what was found
        wanted = int(0)
        for k in range(WARP):
            j = number_of_lane(found, k)
            gains = number_of_lane(its_gain, k) == 1
            between = wp.min(
                wp.min(
                    wp.min(value_of_lane(its_upper[0], k) - lower[0], upper[0] - value_of_lane(its_lower[0], k)),
                    wp.min(value_of_lane(its_upper[1], k) - lower[1], upper[1] - value_of_lane(its_lower[1], k)),
                ),
                wp.min(value_of_lane(its_upper[2], k) - lower[2], upper[2] - value_of_lane(its_lower[2], k)),
            )
            known = same == 1 and (j == t or (j < t and gains))
            if between >= 0.0 and not known and (gained or gains):
                overlapped = overlapped | (1 << k)
                wanted += 1
        slot = free_slots(counts, PAIRS, wanted)
        for k in range(WARP):
            j = number_of_lane(found, k)
            if (overlapped & (1 << k)) != 0:
                if slot < triangles_out.shape[0]:
                    triangles_out[slot] = wp.vec2i(t, j)
                slot += 1
