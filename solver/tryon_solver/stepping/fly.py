"""Cloth that flies beside a body or another piece that it may touch: a piece that nothing but itself touches takes its
way as one.

What holds of cloth that may touch itself alone (coast.py) holds of each piece of cloth for as long as nothing else
touches it: of the incremental potential E, along a motion that its vertices i have in common, there is left what acts
from outside, and forces balance after

    c = -sum_i dE/dx_i / sum_i d_i.

With a body or other pieces about, that way may not lead through them. So it is taken with the body's motion
(move_body.py), if there is one, in place of what the field that carries cloth beside it has for these vertices: the
search follows all ways at once, and finds what is met on them; where something is, the piece stops short of it, as one,
so that what lands is not pressed together on its way. The rest of the step begins there. Left to the solve, each vertex
would be granted its way to any side: a ball of 642 vertices that fell at ten edges a step searched through 700,000
candidates and was braked to six edges.

A piece flies in a step if at its start no contact pair has a vertex of it and one of the body or another piece, and if
it goes by more than the SHARE of what the search has to spare, as fast as it is and by c, seen from the body's root,
which takes along all that does not fly: what rests or hangs in the room stays where it is while a body goes by. What is
slower so is carried along with what it hangs beside, and the solve takes it the rest of the way; so is what the body
leads, or a closed fastener joins to another. Pieces that stitches join are one here: what they pull by is none of d.

In a step in which the cloth comes along (leap.py) there flies only what has fallen from the body: what is worn may be
untouched for a moment, as a dress is in a jump, and would be left behind by a body that is led to another stance. So
what is within FALLEN of the box around the body counts as touched then. It does so, too, in the first step of a
simulation, of which nobody knows who is touched. Of what is farther off than that contact pairs tell, which are
collected where such a step begins: a garment that fell metres below who wears it, and goes on in another mesh, would
be carried with the turn of the body's root, at 27 m by metres a step. Ours.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import warp as wp
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from tryon_solver.contact.filtering import NUMBER
from tryon_solver.contact.pairs import collect
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.order_free import OrderFreeSums, add, add_number
from tryon_solver.linalg.read_back import read
from tryon_solver.linalg.rigid_motion import displaced, mat34
from tryon_solver.linalg.vectors import slip_of
from tryon_solver.stepping.carry_once import shorten
from tryon_solver.stepping.coast import SHARE
from tryon_solver.stepping.gradient import elastic_gradient
from tryon_solver.stepping.leap import FALLEN
from tryon_solver.stepping.predict import predict_as_frozen
from tryon_solver.stepping.search import list_holds, search_along, search_slack

if TYPE_CHECKING:
    from tryon_solver.contact.pairs import ContactPairs
    from tryon_solver.plan import Contribution
    from tryon_solver.simulation import Simulation

wp.set_module_options({"enable_backward": False})


@wp.func
def piece_at(v: int, piece_of: wp.array(dtype=wp.int32)) -> int:
    """Which piece a vertex is of; -1 of the body's."""
    if v < piece_of.shape[0]:
        return piece_of[v]
    return -1


@wp.kernel
def note_touched_kernel(
    counters: wp.array(dtype=wp.int32),
    ids: wp.array(dtype=wp.vec4i),
    piece_of: wp.array(dtype=wp.int32),
    touched: wp.array(dtype=wp.int32),
):
    """Of either kind of stencil, the first and the last vertex are on different sides (candidates.py: offset)."""
    c = wp.tid()
    if c >= counters[0]:
        return
    a = piece_at(ids[c][0], piece_of)
    b = piece_at(ids[c][3], piece_of)
    if a != b:
        if a >= 0:
            touched[a] = 1
        if b >= 0:
            touched[b] = 1


@wp.kernel
def bound_kernel(x: wp.array(dtype=wp.vec3), box: wp.array(dtype=wp.vec3)):
    """Largest way from the first of x (B,) m to another, along each axis, and backwards."""
    way = x[wp.tid()] - x[0]
    wp.atomic_max(box, 0, way)
    wp.atomic_max(box, 1, -way)


@wp.kernel
def note_near_kernel(
    cloth_count: int,
    far: float,
    x: wp.array(dtype=wp.vec3),
    box: wp.array(dtype=wp.vec3),
    piece_of: wp.array(dtype=wp.int32),
    touched: wp.array(dtype=wp.int32),
):
    """No point of the body is nearer to a vertex than the box around it is."""
    i = wp.tid()
    way = x[i] - x[cloth_count]
    outside = wp.max(wp.max(way - box[0], -way - box[1]), wp.vec3())
    if wp.length(outside) <= far:
        touched[piece_of[i]] = 1


@wp.kernel
def add_velocity_kernel(
    piece_of: wp.array(dtype=wp.int32),
    touched: wp.array(dtype=wp.int32),
    v: wp.array(dtype=wp.vec3),
    total: wp.array(dtype=wp.vec3),
    whole: wp.array(dtype=wp.int64),
):
    i = wp.tid()
    piece = piece_of[i]
    if touched[piece] == 0:
        add(total, whole, piece, v[i])


@wp.kernel
def set_off_kernel(
    least: float,
    root: wp.array(dtype=mat34),
    x: wp.array(dtype=wp.vec3),
    first: wp.array(dtype=wp.int32),
    count: wp.array(dtype=wp.float32),
    dt: wp.array(dtype=wp.float32),
    led: wp.array(dtype=wp.int32),
    touched: wp.array(dtype=wp.int32),
    total: wp.array(dtype=wp.vec3),
    along_out: wp.array(dtype=wp.vec3),
    stiffness_out: wp.array(dtype=wp.float32),
    flies_out: wp.array(dtype=wp.int32),
    any_out: wp.array(dtype=wp.int32),
):
    """Who goes by more than `least` m, so fast, seen from the root, of who is neither touched nor led; clears what is
    summed and noted next."""
    piece = wp.tid()
    along_out[piece] = displaced(root[0], x[first[piece]])
    goes = wp.length(dt[0] * total[piece] - count[piece] * along_out[piece]) > least * count[piece]
    flies_out[piece] = 0
    if touched[piece] == 0 and led[piece] == 0 and goes:
        flies_out[piece] = 1
        any_out[0] = 1
    touched[piece] = 0
    total[piece] = wp.vec3()
    stiffness_out[piece] = 0.0


@wp.kernel
def add_forces_kernel(
    piece_of: wp.array(dtype=wp.int32),
    flies: wp.array(dtype=wp.int32),
    gradient: wp.array(dtype=wp.vec3),
    diagonal: wp.array(dtype=wp.float32),
    total: wp.array(dtype=wp.vec3),
    whole: wp.array(dtype=wp.int64),
    stiffness: wp.array(dtype=wp.float32),
    whole_numbers: wp.array(dtype=wp.int64),
):
    i = wp.tid()
    piece = piece_of[i]
    if flies[piece] == 1:
        add(total, whole, piece, gradient[i])
        add_number(stiffness, whole_numbers, piece, diagonal[i])


@wp.kernel
def find_way_kernel(
    least: float,
    total: wp.array(dtype=wp.vec3),
    stiffness: wp.array(dtype=wp.float32),
    along: wp.array(dtype=wp.vec3),
    flies: wp.array(dtype=wp.int32),
    way_out: wp.array(dtype=wp.vec3),
):
    """c; who is held back to no more than `least` m of it, seen from the root, does not fly."""
    piece = wp.tid()
    if flies[piece] == 1:
        way = -total[piece] / stiffness[piece]
        way_out[piece] = way
        if wp.length(way - along[piece]) <= least:
            flies[piece] = 0
    total[piece] = wp.vec3()


@wp.kernel
def feel_beside_kernel(
    piece_of: wp.array(dtype=wp.int32),
    flies: wp.array(dtype=wp.int32),
    hardest: float,
    dt: wp.array(dtype=wp.float32),
    x_start: wp.array(dtype=wp.vec3),
    x: wp.array(dtype=wp.vec3),
    carried_by: wp.array(dtype=wp.vec3),
    felt: wp.array(dtype=wp.vec3),
    felt_out: wp.array(dtype=wp.vec3),
):
    i = wp.tid()
    if flies[piece_of[i]] == 1:
        carried = (x[i] + carried_by[i] - x_start[i]) / dt[0]
        felt_out[i] = carried - slip_of(carried - felt[i], hardest)


@wp.kernel
def take_way_kernel(
    piece_of: wp.array(dtype=wp.int32),
    flies: wp.array(dtype=wp.int32),
    way: wp.array(dtype=wp.vec3),
    x_start: wp.array(dtype=wp.vec3),
    x: wp.array(dtype=wp.vec3),
    direction: wp.array(dtype=wp.vec3),
    solved: wp.array(dtype=wp.vec3),
):
    """From x, where everybody has gone along with the root, to where the way ends; the solve is expected to add none
    to it."""
    i = wp.tid()
    piece = piece_of[i]
    if flies[piece] == 1:
        direction[i] = x_start[i] + way[piece] - x[i]
        solved[i] = wp.vec3()


@wp.kernel
def keep_start_kernel(
    piece_of: wp.array(dtype=wp.int32),
    flies: wp.array(dtype=wp.int32),
    felt_beside: wp.array(dtype=wp.vec3),
    x_committed: wp.array(dtype=wp.vec3),
    x_start: wp.array(dtype=wp.vec3),
    felt: wp.array(dtype=wp.vec3),
):
    i = wp.tid()
    if flies[piece_of[i]] == 1:
        x_start[i] = x_committed[i]
        felt[i] = felt_beside[i]


@wp.kernel
def rest_kernel(piece_of: wp.array(dtype=wp.int32), flies: wp.array(dtype=wp.int32), v: wp.array(dtype=wp.vec3)):
    i = wp.tid()
    if flies[piece_of[i]] == 0:
        v[i] = wp.vec3()


@wp.kernel
def go_along_kernel(
    piece_of: wp.array(dtype=wp.int32),
    flies: wp.array(dtype=wp.int32),
    felt: wp.array(dtype=wp.vec3),
    v: wp.array(dtype=wp.vec3),
):
    i = wp.tid()
    if flies[piece_of[i]] == 0:
        v[i] = v[i] + felt[i]


@wp.kernel
def find_least_kernel(
    piece_of: wp.array(dtype=wp.int32), alpha: wp.array(dtype=wp.float32), least: wp.array(dtype=wp.float32)
):
    i = wp.tid()
    wp.atomic_min(least, piece_of[i], alpha[i])


@wp.kernel
def level_kernel(
    piece_of: wp.array(dtype=wp.int32),
    flies: wp.array(dtype=wp.int32),
    least: wp.array(dtype=wp.float32),
    passes: wp.array(dtype=wp.int32),
    alpha: wp.array(dtype=wp.float32),
    changed: wp.array(dtype=wp.int32),
):
    i = wp.tid()
    piece = piece_of[i]
    if flies[piece] == 1 and alpha[i] > least[piece]:
        alpha[i] = least[piece]
        changed[i] = passes[NUMBER]


@wp.kernel
def stop_short_kernel(
    piece_of: wp.array(dtype=wp.int32),
    flies: wp.array(dtype=wp.int32),
    alpha: wp.array(dtype=wp.float32),
    direction: wp.array(dtype=wp.vec3),
):
    i = wp.tid()
    if flies[piece_of[i]] == 1:
        direction[i] = alpha[i] * direction[i]


def without(matrix: csr_matrix, joined: Sequence[np.ndarray]) -> csr_matrix:
    """Ones where `matrix` (N, N) has entries, but for those of the pairs `joined` (K, 2) each."""
    ones = csr_matrix((np.ones(matrix.nnz, np.int8), matrix.indices, matrix.indptr), shape=matrix.shape, copy=True)
    for pairs in joined:
        ones[pairs[:, 0], pairs[:, 1]] = 0
        ones[pairs[:, 1], pairs[:, 0]] = 0
    ones.eliminate_zeros()
    return ones


class Flight:
    """Of P pieces, of which vertex i is of `piece_of`[i], `count` (P,) how many each has: `flies` (P,) int32 tells who
    flies in this step, `any` (1,) int32 whether one does, `way` (P,) m is theirs.

    `led` (P,) int32 is who the body leads, `touched` (P,) int32 who is touched as the step begins, as far as it is
    `known`; else beside a body all that are near it. `along` (P,) m is where the root takes the `first` (P,) vertex of
    each. `felt` (N,) m/s is what who flies feels of the body's motion. `total`, `stiffness` and `least` (P,) are
    scratch, and so is the body's `box` (2,) m, as of `bound_kernel`.
    """

    def __init__(self, matrix: csr_matrix, contributions: Sequence[Contribution], body: bool, device: str) -> None:
        """`matrix` (N, N) has an entry wherever two vertices act on each other; there may be a `body`."""
        joins = [(c.joined, c.note_joined) for c in contributions if c.joined is not None and c.note_joined is not None]
        pieces, piece_of = connected_components(without(matrix, [pairs for pairs, _ in joins]), directed=False)
        self.joins = [note_joined for _, note_joined in joins]
        led = np.concatenate([np.zeros(0, np.int64), *(c.led for c in contributions if c.led is not None)])
        self.pieces = int(pieces)
        self.piece_of: wp.array = wp.array(piece_of, dtype=wp.int32, device=device)
        self.count: wp.array = wp.array(np.bincount(piece_of), dtype=wp.float32, device=device)
        of_led = np.isin(np.arange(pieces), piece_of[led.astype(np.int64)])
        self.led: wp.array = wp.array(of_led, dtype=wp.int32, device=device)
        first = np.unique(piece_of, return_index=True)[1]
        self.first: wp.array = wp.array(first, dtype=wp.int32, device=device)
        self.still = wp.zeros(1, dtype=mat34, device=device)
        self.touched = wp.zeros(self.pieces, dtype=wp.int32, device=device)
        self.known = not body
        self.box = wp.zeros(2, dtype=wp.vec3, device=device)
        self.flies = wp.zeros(self.pieces, dtype=wp.int32, device=device)
        self.any = wp.zeros(1, dtype=wp.int32, device=device)
        self.way, self.along = (wp.zeros(self.pieces, dtype=wp.vec3, device=device) for _ in range(2))
        self.felt = wp.zeros(len(piece_of), dtype=wp.vec3, device=device)
        self.total = wp.zeros(self.pieces, dtype=wp.vec3, device=device)
        self.stiffness, self.least = (wp.zeros(self.pieces, dtype=wp.float32, device=device) for _ in range(2))

    def note_touched(self, pairs: ContactPairs) -> None:
        """Note who is touched by these pairs, collected where the step begins."""
        inputs = [pairs.counters, pairs.ids, self.piece_of]
        launch(note_touched_kernel, pairs.size, inputs, [self.touched], device=self.any.device)

    def begin_as(self, worn: Flight, pairs: ContactPairs) -> None:
        """Begin where cloth that is `worn` has ended a step with these pairs, if it has."""
        if worn.known:
            self.known = True
            self.note_touched(pairs)

    def look_about(self, sim: Simulation) -> None:
        """Before the first step that begins at x, of which no step before tells who is touched: who is near the body
        counts as touched; if all are, nothing is to be found out. Of the others the pairs tell, which are collected
        then. Waits for the device."""
        if self.known:
            return
        self.known = True
        self._note_near(sim)
        if read(self.touched)[0].all():
            return
        x, direction = sim.state.x, sim.work.direction
        direction.zero_()
        if not list_holds(sim, x, direction):
            search_along(sim, x, direction, 0.0)
        collect(sim.pairs, sim.candidates, sim.contact, x)

    def _note_near(self, sim: Simulation) -> None:
        """For the device: count who is near the body among those that are touched."""
        x, first = sim.state.x, sim.cloth_count
        self.box.zero_()
        launch(bound_kernel, sim.body_count, [x[first:]], [self.box], device=sim.device)
        launch(note_near_kernel, first, [first, FALLEN, x, self.box, self.piece_of], [self.touched], device=sim.device)

    def set_off(self, sim: Simulation) -> None:
        """For the device: find who flies in the step that begins at x, and which way."""
        sums, total = sim.sums, self.total
        root = self.still if sim.body is None else sim.body.carry.root
        self.any.zero_()
        self.note_touched(sim.pairs)
        if sim.comes_along:
            self._note_near(sim)
        for note_joined in self.joins:
            note_joined(self.piece_of, self.touched)
        velocities = [self.piece_of, self.touched, sim.state.v]
        launch(add_velocity_kernel, sim.cloth_count, velocities, [total, sums.vectors], device=sim.device)
        sums.settle(total)
        gate = [SHARE * search_slack(sim), root, sim.state.x, self.first, self.count, sim.state.dt, self.led]
        outputs = [self.along, self.stiffness, self.flies, self.any]
        launch(set_off_kernel, self.pieces, [*gate, self.touched, total], outputs, device=sim.device)
        wp.capture_if(self.any, lambda: self._find_way(sim))

    def _find_way(self, sim: Simulation) -> None:
        work, sums = sim.work, sim.sums
        predict_as_frozen(sim)
        elastic_gradient(sim, sim.state.x, work.gradient)
        forces = [self.piece_of, self.flies, work.gradient, work.diagonal]
        outputs = [self.total, sums.vectors, self.stiffness, sums.numbers]
        launch(add_forces_kernel, sim.cloth_count, forces, outputs, device=sim.device)
        self._settle(sums)
        found = [SHARE * search_slack(sim), self.total, self.stiffness, self.along]
        launch(find_way_kernel, self.pieces, found, [self.flies, self.way], device=sim.device)

    def _settle(self, sums: OrderFreeSums) -> None:
        sums.settle(self.total)
        sums.settle_numbers(self.stiffness)

    def feel_beside(self, sim: Simulation) -> None:
        """For the device: `felt`, as if who flies were carried along by `direction` (leap.py): what a body that it
        comes to has done all the while is no jerk then. x is where everybody has gone along with the root."""
        state, body = sim.state, sim.body
        assert body is not None
        inputs = [sim.settings.hardest_kick, state.dt, state.x_start, state.x, sim.work.direction, body.felt]
        self._of_cloth(sim, feel_beside_kernel, inputs, [self.felt])

    def take_way(self, sim: Simulation) -> None:
        """For the device: let `direction` be the way of who flies."""
        inputs = [self.way, sim.state.x_start, sim.state.x]
        self._of_cloth(sim, take_way_kernel, inputs, [sim.work.direction, sim.solved])

    def keep_start(self, sim: Simulation) -> None:
        """For the device: who flies goes from where it was, and feels nothing of what it has come by."""
        state, body = sim.state, sim.body
        assert body is not None
        self._of_cloth(sim, keep_start_kernel, [self.felt, state.x_committed], [state.x_start, body.felt])

    def come_to_rest(self, sim: Simulation) -> None:
        """For the device: who does not fly is at rest."""
        launch(rest_kernel, sim.cloth_count, [self.piece_of, self.flies], [sim.state.v], device=sim.device)

    def go_along(self, sim: Simulation) -> None:
        """For the device: who does not fly has the velocity that it has felt, on top of its own."""
        body = sim.body
        assert body is not None
        inputs = [self.piece_of, self.flies, body.felt]
        launch(go_along_kernel, sim.cloth_count, inputs, [sim.state.v], device=sim.device)

    def _of_cloth(self, sim: Simulation, kernel: wp.Kernel, inputs: Sequence[Any], outputs: Sequence[Any]) -> None:
        """Launch it over the cloth where some of it flies; on a GPU wherever: a graph's condition takes longer."""

        def over_cloth() -> None:
            launch(kernel, sim.cloth_count, [self.piece_of, self.flies, *inputs], outputs, device=sim.device)

        if wp.get_device(sim.device).is_cuda:
            over_cloth()
        else:
            wp.capture_if(self.any, over_cloth)

    @property
    def under_way(self) -> bool:
        """Does any piece fly in this step? Waits for the device."""
        return bool(read(self.any)[0][0])

    def stop_short(self, sim: Simulation) -> bool:
        """Shorten the way of each piece that flies, as one, until the motion in `direction` is free by what was found
        along it: was any? What goes on past one that stops has to be searched for anew. Waits for the device."""
        work = sim.work
        self.least.fill_(1.0)
        work.alpha.fill_(1.0)
        # a place for each vertex: by fractions just made, a piece would be in its own way
        shorten(sim, before=sim.filtering.travel, level=lambda: self._level(sim))
        inputs = [self.piece_of, self.flies, work.alpha]
        launch(stop_short_kernel, sim.cloth_count, inputs, [work.direction], device=sim.device)
        flies, least = read(self.flies, self.least)
        return bool((least[flies == 1] < 1.0).any())

    def _level(self, sim: Simulation) -> None:
        """For the device: of the vertices of a piece that flies, all have the least fraction."""
        work, count, device = sim.work, sim.cloth_count, sim.device
        launch(find_least_kernel, count, [self.piece_of, work.alpha], [self.least], device=device)
        inputs = [self.piece_of, self.flies, self.least, sim.filtering.passes.state]
        launch(level_kernel, count, inputs, [work.alpha, sim.filtering.changed], device=device)
