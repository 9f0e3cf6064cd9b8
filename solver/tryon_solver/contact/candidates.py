"""The candidates: stencils that could come into reach, where their list is complete, and which of them matter.

A *candidate* is a stencil from the broad phase, not yet a contact. Stencils that share a vertex are no candidates, nor
are stencils of body vertices alone (a posed body crosses itself freely).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import warp as wp

from tryon_solver.contact.distances import approach, stencil_vector, stencil_weights
from tryon_solver.contact.found import NONE, SERIALS, Found, room_for
from tryon_solver.linalg.blocks import MOST_THREADS
from tryon_solver.linalg.clear import clear
from tryon_solver.linalg.device_loop import KeptGraph
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.read_back import read
from tryon_solver.linalg.slots import next_slot

wp.set_module_options({"enable_backward": False})


QUIET = 30  # steps and searches
FILLINGS = 300  # of a list, after which it is asked how much room they took: seconds of a motion
SOON = 30  # the same, where what needed most is over


@wp.struct
class ContactSizes:
    """Lengths [m] of the contact model, one number for contact with the body and one for cloth on cloth.

    Of an outfit these are the largest, and each surface has its own share: `half` (A,) m of the offset belongs to each
    vertex, half the thickness of its cloth or the body's offset; `garment` (A,) int32 says whose cloth it is. Of a
    garment alone both are empty.
    """

    xi_body: float
    xi_self: float
    d_hat: float
    half: wp.array(dtype=wp.float32)
    garment: wp.array(dtype=wp.int32)


@wp.func
def offset(ids: wp.vec4i, cloth_count: int, sizes: ContactSizes) -> float:
    """Thickness offset xi [m] of a stencil; of either kind, its first and its last vertex are on different sides."""
    if sizes.half.shape[0] > 0:
        return sizes.half[ids[0]] + sizes.half[ids[3]]
    if ids[0] >= cloth_count or ids[3] >= cloth_count:
        return sizes.xi_body
    return sizes.xi_self


@wp.func
def same_garment(ids: wp.vec4i, sizes: ContactSizes) -> bool:
    """Are both sides of a stencil of cloth on cloth of one garment?"""
    if sizes.garment.shape[0] == 0:
        return True
    return sizes.garment[ids[0]] == sizes.garment[ids[3]]


@dataclass
class Candidates:
    """Stencils: `ids` vec4i, `kind` int32 (POINT_TRIANGLE, EDGE_EDGE); how many: `size`, and `count` (1,) int32.

    `distance` m is a lower bound at the current positions (`follow` keeps it one), so that most stencils can be passed
    over without looking at their vertices. `near` int32 lists those that the coming move concerns (`list_near`),
    `near_count` (1,) int32 how many; `near_size` is that, or more in a graph. `capacity` grows when the broad phase
    finds more; nothing is ever dropped. `found` is the broad phase's scratch, one a surface, `searches` its launches,
    for what is not on the list and anew. `most` is how long the list was since there was too much room for it, and
    `fillings` how often it was filled since; `quiet` counts the steps and searches since there was any. `fits` and
    `end` (1,) int32 are of taking over what was found (taking_over.py). `serial` is as in Found.
    """

    ids: wp.array
    kind: wp.array
    distance: wp.array
    near: wp.array
    near_count: wp.array
    count: wp.array
    fits: wp.array
    end: wp.array
    capacity: int
    serial: int
    found: list[Found]
    size: int = 0
    near_size: int = 0
    searches: tuple[KeptGraph, KeptGraph] = field(default_factory=lambda: (KeptGraph(), KeptGraph()))
    most: int = 0
    fillings: int = 0
    quiet: int = 0

    @staticmethod
    def allocate(capacity: int, device: str) -> Candidates:
        """Empty list with room for `capacity` stencils."""
        return Candidates(
            wp.zeros(capacity, dtype=wp.vec4i, device=device),
            wp.zeros(capacity, dtype=wp.int32, device=device),
            wp.zeros(capacity, dtype=wp.float32, device=device),
            wp.zeros(capacity, dtype=wp.int32, device=device),
            wp.zeros(1, dtype=wp.int32, device=device),
            wp.zeros(1, dtype=wp.int32, device=device),
            wp.zeros(1, dtype=wp.int32, device=device),
            wp.zeros(1, dtype=wp.int32, device=device),
            capacity,
            next(SERIALS),
            [],
        )

    def know_size(self, count: int) -> None:
        """Know how many a GPU has made them (taking_over.py)."""
        self.size = count
        self.most = max(self.most, count)

    def append(self, found: Found, count: int) -> None:
        """Add the first `count` stencils of what was found; grows when there is no room for them."""
        wanted = self.size + count
        self.most = max(self.most, wanted)
        if wanted > self.capacity:
            grown = self.of_room(room_for(wanted))
            if self.size:
                grown.take_over(self, self.size)
            self.__dict__.update(grown.__dict__)
        if count:
            self.take_over(found, count)

    def of_room(self, room: int) -> Candidates:
        """Another for the same searches, empty."""
        other = Candidates.allocate(room, str(self.ids.device))
        other.found, other.searches = self.found, self.searches
        other.most, other.fillings, other.quiet = self.most, self.fillings, self.quiet
        return other

    def look_back(self) -> None:
        """Count another step or search after which there may be none."""
        self.quiet = 0 if self.size else self.quiet + 1

    @property
    def idle(self) -> bool:
        """Is there none, and nothing to be launched for any? On a GPU, whose graphs are recorded anew for it, only
        where there was none for a while."""
        return self.size == 0 and (wp.get_device(self.count.device).is_cpu or self.quiet > QUIET)

    def clear(self) -> None:
        """No stencils, once `count` is zero. Room that FILLINGS lists did not need is given back."""
        self.size = 0
        self.fillings += 1
        if self.fillings > FILLINGS:
            room, self.most, self.fillings = room_for(self.most), 0, 0
            self.found = [one.with_less_room() for one in self.found]
            if room < self.capacity:
                self.__dict__.update(self.of_room(room).__dict__)

    def begin_anew(self) -> None:
        """What needed room until now is over, and how much is needed is asked soon: SOON lists from now. Garments that
        are put on have forty times the stencils of worn ones."""
        self.most, self.fillings = 0, FILLINGS - SOON
        for one in self.found:
            one.most = NONE

    @property
    def places(self) -> tuple[object, ...]:
        """Others where the list's arrays or the broad phase's scratch are others."""
        return self.serial, *(one.serial for one in self.found)

    @property
    def threads(self) -> int:
        """Threads of a launch over all of them: in a graph, which outlives the list, for whatever may become of it."""
        in_graph = wp.get_device(self.count.device).is_capturing
        return min(self.capacity if in_graph else self.size, MOST_THREADS)

    def entries(self, near: bool) -> tuple[int, list[object]]:
        """Threads of a launch over the near list, or over all, and its kernel's first arguments, `near`, `listed`,
        `some` and `threads`: each thread takes every so-manieth of the `listed` entries, as `candidate_at` reads them.
        """
        threads = min(self.near_size, MOST_THREADS) if near else self.threads
        return threads, [self.near, self.near_count if near else self.count, int(near), threads]

    def size_near_list(self) -> None:
        """Know how many are near; in a graph, which can't be read from, there is no telling."""
        if wp.get_device(self.near_count.device).is_capturing:
            self.near_size = self.capacity
        else:
            self.near_size = int(read(self.near_count)[0][0])

    def take_over(self, other: Candidates | Found, count: int) -> None:
        """Copy the other's first `count` stencils behind those on the list; there must be room."""
        for name in ("ids", "kind", "distance"):
            wp.copy(getattr(self, name), getattr(other, name), dest_offset=self.size, count=count)
        self.size += count
        self.count.fill_(self.size)


@wp.func
def candidate_at(near: wp.array(dtype=wp.int32), some: int, entry: int) -> int:
    """The candidate that an entry of the near list names, or of the list of all."""
    if some == 1:
        return near[entry]
    return entry


@wp.kernel
def follow_kernel(
    near: wp.array(dtype=wp.int32),
    listed: wp.array(dtype=wp.int32),
    some: int,
    threads: int,
    ids: wp.array(dtype=wp.vec4i),
    kind: wp.array(dtype=wp.int32),
    x_before: wp.array(dtype=wp.vec3),
    x: wp.array(dtype=wp.vec3),
    distance: wp.array(dtype=wp.float32),
):
    for entry in range(wp.tid(), listed[0], threads):
        c = candidate_at(near, some, entry)
        v = ids[c]
        u0 = x[v[0]] - x_before[v[0]]
        u1 = x[v[1]] - x_before[v[1]]
        u2 = x[v[2]] - x_before[v[2]]
        u3 = x[v[3]] - x_before[v[3]]
        distance[c] = distance[c] - approach(kind[c], u0, u1, u2, u3)


def follow(candidates: Candidates, x_before: wp.array, x: wp.array, near: bool) -> None:
    """Lower the distances by what the way from x_before to x, (A,) m each, can have brought each stencil together.

    With `near`, those of the near list alone.
    """
    count, entries = candidates.entries(near)
    launch(
        follow_kernel,
        count,
        [*entries, candidates.ids, candidates.kind, x_before, x],
        [candidates.distance],
        device=x.device,
    )


@wp.kernel
def measure_kernel(
    count: wp.array(dtype=wp.int32),
    threads: int,
    ids: wp.array(dtype=wp.vec4i),
    kind: wp.array(dtype=wp.int32),
    x: wp.array(dtype=wp.vec3),
    distance_out: wp.array(dtype=wp.float32),
):
    for c in range(wp.tid(), count[0], threads):
        v = ids[c]
        x0 = x[v[0]]
        x1 = x[v[1]]
        x2 = x[v[2]]
        x3 = x[v[3]]
        distance_out[c] = wp.length(stencil_vector(stencil_weights(kind[c], x0, x1, x2, x3), x0, x1, x2, x3))


def measure(candidates: Candidates, x: wp.array) -> None:
    """Have the distances of all of them at x (A,) m, in place of bounds that get lower from move to move."""
    threads = candidates.threads
    inputs = [candidates.count, threads, candidates.ids, candidates.kind, x]
    launch(measure_kernel, threads, inputs, [candidates.distance], device=x.device)


MOST_USED = 1.25  # a stencil whose gap is this many times what a move can use up of it needs no filter


@wp.kernel
def travel_kernel(direction: wp.array(dtype=wp.vec3), travel_out: wp.array(dtype=wp.float32)):
    i = wp.tid()
    travel_out[i] = wp.length(direction[i])


def measure_travel(direction: wp.array, travel_out: wp.array) -> None:
    """The longest way each vertex may take by `direction`, both (A,) m."""
    launch(travel_kernel, len(direction), [direction], [travel_out], device=direction.device)


@wp.kernel
def list_near_kernel(
    count: wp.array(dtype=wp.int32),
    ids: wp.array(dtype=wp.vec4i),
    kind: wp.array(dtype=wp.int32),
    x: wp.array(dtype=wp.vec3),
    travel: wp.array(dtype=wp.float32),
    cloth_count: int,
    sizes: ContactSizes,
    settled: int,
    threads: int,
    distance: wp.array(dtype=wp.float32),
    near_out: wp.array(dtype=wp.int32),
    near_count: wp.array(dtype=wp.int32),
):
    for c in range(wp.tid(), count[0], threads):
        v = ids[c]
        t1 = travel[v[1]]
        t2 = travel[v[2]]
        t3 = travel[v[3]]
        together = travel[v[0]] + wp.max(t1, wp.max(t2, t3))
        if kind[c] == 1:
            together = wp.max(travel[v[0]], t1) + wp.max(t2, t3)
        xi = offset(v, cloth_count, sizes)
        far = xi + wp.max(MOST_USED * together, sizes.d_hat + together)
        d = distance[c]
        if d <= far and settled == 0:
            x0 = x[v[0]]
            x1 = x[v[1]]
            x2 = x[v[2]]
            x3 = x[v[3]]
            d = wp.length(stencil_vector(stencil_weights(kind[c], x0, x1, x2, x3), x0, x1, x2, x3))
            distance[c] = d
        if d <= far:
            near_out[next_slot(near_count, 0)] = c
        elif settled == 1:
            distance[c] = d - together


def list_near(
    candidates: Candidates, x: wp.array, travel: wp.array, cloth_count: int, sizes: ContactSizes, settled: bool
) -> None:
    """List the stencils for which a move of each vertex from x by at most `travel` (A,) m matters.

    All others use up no more than 1/MOST_USED of their gap above their offset and stay out of the barrier's reach,
    wherever in that range their vertices go. If it is `settled` that this move will be taken, or less of it, their
    distances become what is left then; those of the near ones, which a list that is not settled measures, must have
    been measured at x by one for what the move was before.
    """
    clear(candidates.near_count)
    threads = candidates.threads
    launch(
        list_near_kernel,
        threads,
        [candidates.count, candidates.ids, candidates.kind, x, travel, cloth_count, sizes, int(settled), threads],
        [candidates.distance, candidates.near, candidates.near_count],
        device=travel.device,
    )
    candidates.size_near_list()


@wp.kernel
def list_closing_kernel(
    count: wp.array(dtype=wp.int32),
    ids: wp.array(dtype=wp.vec4i),
    kind: wp.array(dtype=wp.int32),
    distance: wp.array(dtype=wp.float32),
    displacement: wp.array(dtype=wp.vec3),
    xi: float,
    threads: int,
    near_out: wp.array(dtype=wp.int32),
    near_count: wp.array(dtype=wp.int32),
):
    for c in range(wp.tid(), count[0], threads):
        v = ids[c]
        closer = approach(kind[c], displacement[v[0]], displacement[v[1]], displacement[v[2]], displacement[v[3]])
        if distance[c] <= xi + MOST_USED * closer:
            near_out[next_slot(near_count, 0)] = c


def list_closing(candidates: Candidates, displacement: wp.array, xi: float) -> None:
    """List as near the stencils that `displacement` (A,) m, taken as it is, could use up 1/MOST_USED of the gap of."""
    clear(candidates.near_count)
    threads = candidates.threads
    launch(
        list_closing_kernel,
        threads,
        [candidates.count, candidates.ids, candidates.kind, candidates.distance, displacement, xi, threads],
        [candidates.near, candidates.near_count],
        device=displacement.device,
    )
    candidates.size_near_list()
