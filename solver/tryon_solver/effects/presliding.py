"""How far each contact has given tangentially, kept from step to step: what sticks stays where it is.

A contact is known again by the numbers of its four vertices, which are looked up in a hash table of open addressing on
the device. What is found there does not depend on the order in which it was entered: a vertex with a triangle and two
edges may have the same four numbers; they share a vertex's neighbourhood and slip alike, and what is known of them is
that of the one which has given more.
"""

from __future__ import annotations

from dataclasses import dataclass

import warp as wp

from tryon_solver.linalg.launch import launch

wp.set_module_options({"enable_backward": False})

PLACES = 4  # of the table for each contact that there is room for


@wp.func
def first_place(v: wp.vec4i, places: int) -> int:
    """Where in a table of so many places, a power of two, the search for a contact begins: as FNV-1a, bits mixed."""
    h = wp.uint32(374761393)
    for k in range(4):
        h = (h ^ wp.uint32(v[k])) * wp.uint32(16777619)
        h = h ^ (h >> wp.uint32(15))
    return int(h & wp.uint32(places - 1))


@wp.func
def comes_behind(a: wp.vec3, b: wp.vec3) -> bool:
    """By length, and where that is the same by their components: an order in which no two are alike."""
    if wp.length_sq(a) != wp.length_sq(b):
        return wp.length_sq(a) > wp.length_sq(b)
    if a[0] != b[0]:
        return a[0] > b[0]
    if a[1] != b[1]:
        return a[1] > b[1]
    return a[2] > b[2]


@wp.func
def recall(
    v: wp.vec4i, table: wp.array(dtype=wp.int32), ids: wp.array(dtype=wp.vec4i), given: wp.array(dtype=wp.vec3)
) -> wp.vec3:
    """How far the contact of these vertices has given [m]; zero for one that is new."""
    places = table.shape[0]
    place = first_place(v, places)
    most = wp.vec3()
    entry = table[place]
    while entry != 0:
        if ids[entry - 1] == v and comes_behind(given[entry - 1], most):
            most = given[entry - 1]
        place = (place + 1) & (places - 1)
        entry = table[place]
    return most


@wp.kernel
def enter_kernel(count: wp.array(dtype=wp.int32), ids: wp.array(dtype=wp.vec4i), table: wp.array(dtype=wp.int32)):
    c = wp.tid()
    if c >= count[0]:
        return
    places = table.shape[0]
    place = first_place(ids[c], places)
    while wp.atomic_cas(table, place, 0, c + 1) != 0:
        place = (place + 1) & (places - 1)


@dataclass(frozen=True)
class Presliding:
    """Room for C contacts, a power of two, `count` (1,) int32 of them known: `ids` (C,) vec4i; `given` (C,) vec3 m;
    `table` (PLACES C,) int32, the number of an entry plus 1, or 0."""

    count: wp.array
    ids: wp.array
    given: wp.array
    table: wp.array

    @staticmethod
    def allocate(capacity: int, device: str) -> Presliding:
        """Of no contact."""
        return Presliding(
            wp.zeros(1, dtype=wp.int32, device=device),
            wp.zeros(capacity, dtype=wp.vec4i, device=device),
            wp.zeros(capacity, dtype=wp.vec3, device=device),
            wp.zeros(PLACES * capacity, dtype=wp.int32, device=device),
        )

    def replace_by(self, count: wp.array, ids: wp.array, given: wp.array) -> None:
        """Know these contacts and no other: arrays as above, `ids` and `given` not longer than here."""
        wp.copy(self.count, count, count=1)
        wp.copy(self.ids, ids, count=len(ids))
        wp.copy(self.given, given, count=len(given))
        self.table.zero_()
        launch(enter_kernel, len(ids), [self.count, self.ids], [self.table], device=self.table.device)
