"""Broad phase: which stencils could come into reach while their vertices stay in a region.

Pairs of triangles (triangle_pairs.py) are taken apart into the stencils whose vertices and edges they own, each pair by
a thread of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import warp as wp

from tryon_solver.contact.candidates import Candidates
from tryon_solver.contact.distances import approach, stencil_vector, stencil_weights
from tryon_solver.contact.found import CLOSE, STENCILS, Counts, Found, counted
from tryon_solver.contact.region import Region
from tryon_solver.contact.surfaces import Reach, Side, Surface, reach_of_stencil
from tryon_solver.contact.taking_over import take_over
from tryon_solver.contact.triangle_pairs import NOTHING_KNOWN, pair_triangles, threads_over
from tryon_solver.linalg.clear import clear
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.side_by_side import side_by_side
from tryon_solver.linalg.warps import (
    free_slots,
    lane_of_warp,
    lane_that_has,
    lanes_of_warp,
    number_of_lane,
    sum_of_lanes_before,
)

wp.set_module_options({"enable_backward": False})

UNLISTED = wp.constant(1.0e30)  # m, in place of the distance of a stencil that is not to be on the list


@wp.func
def listed_distance(
    kind: int,
    reach: float,
    between: wp.vec2,
    v: wp.vec4i,
    group: wp.array(dtype=wp.int32),
    centre: wp.array(dtype=wp.vec3),
    x: wp.array(dtype=wp.vec3),
) -> float:
    """What is stored of a stencil, its distance for x; UNLISTED if it shares a vertex or is not `between` further
    apart, at the centres, than it reaches."""
    of = wp.vec4i(group[v[0]], group[v[1]], group[v[2]], group[v[3]])
    if of[0] == of[2] or of[0] == of[3]:
        return UNLISTED
    if kind == 0:
        if of[0] == of[1]:
            return UNLISTED
    elif of[1] == of[2] or of[1] == of[3]:
        return UNLISTED
    x0 = centre[v[0]]
    x1 = centre[v[1]]
    x2 = centre[v[2]]
    x3 = centre[v[3]]
    lam = stencil_weights(kind, x0, x1, x2, x3)
    distance = wp.length(stencil_vector(lam, x0, x1, x2, x3))
    if distance > reach + between[1] or distance <= reach + between[0]:
        return UNLISTED
    return distance - approach(kind, x[v[0]] - x0, x[v[1]] - x1, x[v[2]] - x2, x[v[3]] - x3)


@wp.func_native("""
    for (int k = 0; k < place; ++k)
        bits &= bits - 1;
#if defined(__CUDA_ARCH__)
    return __ffs(bits) - 1;
#else
    return __builtin_ctz(bits);
#endif
""")
def set_bit(bits: int, place: int) -> int:  # type: ignore[empty-body]
    """Which bit is set as the so-manieth, from 0, of those that are; there must be so many."""


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    return __popc(bits);
#else
    return __builtin_popcount(bits);
#endif
""")
def number_of(bits: int) -> int:  # type: ignore[empty-body]
    """How many bits are set."""


@wp.func
def corner(face: wp.vec3i, k: int) -> int:
    """The k-th vertex of a triangle, the first coming again after the last: told, not looked up, which a GPU does in
    memory."""
    return wp.where(k == 1, face[1], wp.where(k == 2, face[2], face[0]))


@wp.func
def edges_of(mine: int, theirs: int) -> int:
    """Bit 3k + m for each two edges k and m that the two triangles own, as `Surface.owned` has them."""
    other = theirs >> 3
    return wp.where((mine & 8) != 0, other, 0) | wp.where((mine & 16) != 0, other << 3, 0) | wp.where(
        (mine & 32) != 0, other << 6, 0
    )


@wp.func
def edge_stencil(at: int, f: wp.vec3i, g: wp.vec3i) -> wp.vec4i:
    """The vertices of edge k of the one and m of the other, as bit `at` = 3k + m says."""
    k = at // 3
    m = at - 3 * k
    return wp.vec4i(corner(f, k), corner(f, k + 1), corner(g, m), corner(g, m + 1))


@wp.func
def point_stencil(at: int, f: wp.vec3i, g: wp.vec3i) -> wp.vec4i:
    """Vertex `at` of the two triangles' six, and the triangle that it is none of."""
    if at < 3:
        return wp.vec4i(corner(f, at), g[0], g[1], g[2])
    return wp.vec4i(corner(g, at - 3), f[0], f[1], f[2])


@wp.func
def list_stencils(
    kind: int,
    bits: int,
    first: int,
    close: wp.array(dtype=wp.vec2i),
    between: wp.array(dtype=wp.vec2),
    own: Side,
    other: Side,
    reach: Reach,
    group: wp.array(dtype=wp.int32),
    centre: wp.array(dtype=wp.vec3),
    x: wp.array(dtype=wp.vec3),
    ids_out: wp.array(dtype=wp.vec4i),
    kind_out: wp.array(dtype=wp.int32),
    distance_out: wp.array(dtype=wp.float32),
    counts: wp.array(dtype=wp.int32),
):
    """List what is to be listed of one kind: of the pair that each lane has, the `first` lane's being number `first`,
    those stencils whose `bits` are set. The lanes share all of theirs evenly.

    Of two edges the one whose first vertex has the lower number comes first, whoever was looked for: by these numbers
    contacts are known again (effects/presliding.py).
    """
    begin = sum_of_lanes_before(number_of(bits))
    total = number_of_lane(begin + number_of(bits), lanes_of_warp() - 1)
    for begun in range(0, total, lanes_of_warp()):
        stencil = begun + lane_of_warp()
        lane = lane_that_has(begin, stencil)
        place = stencil - number_of_lane(begin, lane)
        of_pair = number_of_lane(bits, lane)
        v = wp.vec4i()
        distance = float(UNLISTED)
        if stencil < total:
            pair = close[first + lane]
            f = own.faces[pair[0]]
            g = other.faces[pair[1]]
            at = set_bit(of_pair, place)
            if kind == 1:
                v = edge_stencil(at, f, g)
                if v[2] < v[0]:
                    v = wp.vec4i(v[2], v[3], v[0], v[1])
            else:
                v = point_stencil(at, f, g)
            distance = listed_distance(kind, reach_of_stencil(v, reach), between[first + lane], v, group, centre, x)
        listed = wp.where(distance != UNLISTED, 1, 0)
        slot = free_slots(counts, STENCILS, listed)
        if listed == 1 and slot < ids_out.shape[0]:
            ids_out[slot] = v
            kind_out[slot] = kind
            distance_out[slot] = distance


@wp.kernel
def take_apart_kernel(
    close: wp.array(dtype=wp.vec2i),
    between: wp.array(dtype=wp.vec2),
    own: Side,
    other: Side,
    reach: Reach,
    group: wp.array(dtype=wp.int32),
    centre: wp.array(dtype=wp.vec3),
    x: wp.array(dtype=wp.vec3),
    threads: int,
    ids_out: wp.array(dtype=wp.vec4i),
    kind_out: wp.array(dtype=wp.int32),
    distance_out: wp.array(dtype=wp.float32),
    counts: wp.array(dtype=wp.int32),
):
    """The stencils of pairs of triangles: of the vertices and edges that the two own, both ways' points.

    A pair has three as a rule, and up to 15: with a thread for each pair most would wait for one that has many.
    """
    count = wp.min(counts[CLOSE], close.shape[0])
    for begun in range(wp.tid() - lane_of_warp(), count, threads):
        entry = begun + lane_of_warp()
        edges = int(0)
        points = int(0)
        if entry < count:
            mine = own.owned[close[entry][0]]
            theirs = other.owned[close[entry][1]]
            edges = edges_of(mine, theirs)
            points = (mine & 7) | ((theirs & 7) << 3)
        for n in range(2):  # edges, then points
            list_stencils(
                1 - n,
                wp.where(n == 0, edges, points),
                begun,
                close,
                between,
                own,
                other,
                reach,
                group,
                centre,
                x,
                ids_out,
                kind_out,
                distance_out,
                counts,
            )


@dataclass(frozen=True)
class Scope:
    """What is searched: the cloth against `others`, the surfaces that the scene lets it touch: itself, the body, or
    both, within a region. Stencils with two vertices of one `group` (A,) are skipped: a vertex of its own, or vertices
    being sewn into one. x (A,) m is where the vertices are now, for the distances."""

    cloth: Surface
    others: tuple[Surface, ...]
    region: Region
    group: wp.array
    x: wp.array

    @property
    def surfaces(self) -> Iterable[Surface]:
        """Each of them once."""
        return {id(surface): surface for surface in (self.cloth, *self.others)}.values()

    def enclose(self) -> None:
        """Boxes for the region as it is."""
        region, margin = self.region, 0.5 * max(other.reach.farthest for other in self.others)
        for surface in self.surfaces:
            surface.enclose(region.centre, region.half_way, region.budget, margin)

    def search(self, found: Found, k: int, anew: bool) -> None:
        """Fill `found` with what the cloth and the k-th other surface have new, as far as there is room."""
        clear(found.counts)
        pair_triangles(found, self.cloth, self.others[k], self.region, self.group, anew)
        take_apart(found, self.cloth, self.others[k], self.region, self.group, self.x)


def find(candidates: Candidates, scope: Scope) -> None:
    """Fill `candidates` with every stencil that can come within its surface's reach while its vertices stay in the
    region. Grows the list when it is full. Waits for the device."""
    candidates.clear()
    launch_search(candidates, scope)
    settle(candidates, scope, counted(candidates.found[: len(scope.others)]))


def launch_extension(candidates: Candidates, scope: Scope) -> None:
    """Launch what adds to `candidates` the stencils that come into question because budgets have grown since they were
    found; it is done when `settle` is told what was counted, or where there was room for all of it.

    The region's paths must be the same. A budget that has shrunk counts as it was.
    """
    begin(candidates, scope, anew=False)


def launch_search(candidates: Candidates, scope: Scope) -> None:
    """Launch what `find` does with cleared candidates, which is done when `settle` is told what was counted."""
    begin(candidates, scope, anew=True)


def begin(candidates: Candidates, scope: Scope, anew: bool) -> None:
    """Launch a search, `anew` or for what is not on the list."""
    device = wp.get_device(scope.x.device)
    while len(candidates.found) < len(scope.others):
        rooms = candidates.capacity, candidates.capacity, candidates.capacity
        candidates.found.append(Found.allocate(rooms, str(device)))
    found = candidates.found[: len(scope.others)]

    def search(k: int) -> None:
        scope.others[k].refit()
        scope.search(found[k], k, anew)

    def search_all() -> None:
        if anew:
            clear(candidates.count)
            for surface in scope.surfaces:
                surface.budget.fill_(NOTHING_KNOWN)
        scope.enclose()
        at_once(search, len(found), device)
        if device.is_cuda:
            take_over(candidates, found)

    if all(surface.bvh for surface in scope.others):
        candidates.searches[anew].run(search_all, (scope.x.ptr, *candidates.places), str(device))
    else:
        search_all()  # which builds the trees


def settle(candidates: Candidates, scope: Scope, counts: Sequence[Counts]) -> bool:
    """End a search that counted so many of each surface: was there room for all? Else there is now, and they are on the
    list as well."""
    total = candidates.size + sum(stencils for *_, stencils in counts)
    found = candidates.found
    room = all(found[k].with_room(counted) is found[k] for k, counted in enumerate(counts))
    if wp.get_device(scope.x.device).is_cuda and room and total <= candidates.capacity:
        candidates.know_size(total)
        return True
    for k, of_surface in enumerate(counts):
        while (roomier := candidates.found[k].with_room(of_surface)) is not candidates.found[k]:
            candidates.found[k] = roomier
            scope.search(roomier, k, anew=False)
            (of_surface,) = counted([roomier])
        candidates.append(candidates.found[k], of_surface[-1])
    return False


def take_apart(found: Found, cloth: Surface, other: Surface, region: Region, group: wp.array, x: wp.array) -> None:
    """Fill `found` with the stencils of its pairs of triangles, as far as there is room."""
    threads = threads_over(len(found.close), wp.get_device(x.device))
    launch(
        take_apart_kernel,
        threads,
        [
            found.close,
            found.between,
            cloth.side,
            other.side,
            other.reach,
            group,
            region.centre,
            x,
            threads,
        ],
        [found.ids, found.kind, found.distance, found.counts],
        device=x.device,
    )


OTHER_CORE = ThreadPoolExecutor(max_workers=1)  # starts its thread with its first task


def at_once(search: Callable[[int], None], count: int, device: wp.Device) -> None:
    """Run the searches 0 to count - 1. On a CPU Warp runs a kernel on the thread that launches it: all but the first go
    to another one. A GPU has the first on a branch of its own."""
    if device.is_cuda:
        side_by_side(device, lambda: search(0), lambda: in_turn(search, range(1, count)))
        return
    elsewhere = [OTHER_CORE.submit(search, k) for k in range(1, count)]
    search(0)
    for searched in elsewhere:
        searched.result()


def in_turn(search: Callable[[int], None], which: Iterable[int]) -> None:
    """These searches, one after the other."""
    for k in which:
        search(k)
