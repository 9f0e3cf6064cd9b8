"""Contacts that hold what they touch aside: a force against slip, up to a strength, that remembers what has given.

For a pair with tangential slip u = (I - n n^T)(g + sum_i lam_i (x_i - x_start_i)), which includes the body's own
motion, the force on vertex i is

    -lam_i F f1(|u|) u/|u|,   f1(y) = (2 - y/s) y/s for y < s, else 1,   s the presliding,

F the most it resists with: friction's mu N (friction.py), or what sticks (adhesion.py). g is what the contact had given
by the end of the last step (presliding.py), at most s, as Cundall and Strack 1979 remember it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import warp as wp

from tryon_solver.contact.pairs import ContactPairs
from tryon_solver.effects.presliding import Presliding, recall
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.order_free import OrderFreeSums, add
from tryon_solver.plan import ContactTerm
from tryon_solver.state import State

wp.set_module_options({"enable_backward": False})

FIRST_ROOM = 1 << 10  # contacts; it grows with the list of pairs


@wp.func
def slip(
    v: wp.vec4i,
    w: wp.vec4,
    n: wp.vec3,
    given: wp.vec3,
    x: wp.array(dtype=wp.vec3),
    x_start: wp.array(dtype=wp.vec3),
) -> wp.vec3:
    """u = (I - n n^T) (g + sum_i lam_i (x_i - x_start_i)) [m]."""
    u = given
    for k in range(4):
        u += w[k] * (x[v[k]] - x_start[v[k]])
    return u - wp.dot(u, n) * n


@wp.func
def f1(y: float, e: float) -> float:
    """Share of the Coulomb force at slip y [-]."""
    if y >= e:
        return 1.0
    return (2.0 - y / e) * y / e


@wp.func
def resistance(y: float, e: float, kinetic: float) -> float:
    """The same where of what slides the share `kinetic` is left."""
    if y > e:
        return kinetic + (1.0 - kinetic) * wp.max(2.0 - y / e, 0.0)
    return f1(y, e)


@wp.func
def hold(u: wp.vec3, before: wp.vec3, most: float, presliding: float, kinetic: float, settled: bool):
    """Of a contact that resists with up to `most` N, and with the share `kinetic` of it once it slides, at the slip u:
    force over slip [N/m], and (t, what the stiffness along t = u/|u| has beyond that). `before`: its slip at the last
    iterate, where it is `settled`."""
    y = wp.length(u)
    weight = most * resistance(y, presliding, kinetic) / wp.max(y, presliding)
    if y < presliding:
        weight = most * (2.0 - y / presliding) / presliding
    if not settled or y == 0.0:
        return weight, wp.vec4()
    stiffness = 2.0 * most * wp.max(1.0 - y / presliding, 0.0) / presliding
    y_before = wp.length(before)
    turned = wp.dot(u, before) < 0.0
    if not turned and y > presliding and y < y_before:
        return weight, wp.vec4()
    if turned:
        together = resistance(y, presliding, kinetic) + resistance(y_before, presliding, kinetic)
        stiffness = most * together / (y + y_before)
    t = u / y
    return weight, wp.vec4(t[0], t[1], t[2], stiffness - weight)


@wp.kernel
def add_gradient_kernel(
    counters: wp.array(dtype=wp.int32),
    ids: wp.array(dtype=wp.vec4i),
    lam: wp.array(dtype=wp.vec4),
    normal: wp.array(dtype=wp.vec3),
    weight: wp.array(dtype=wp.float32),
    given: wp.array(dtype=wp.vec3),
    x: wp.array(dtype=wp.vec3),
    x_start: wp.array(dtype=wp.vec3),
    gradient_out: wp.array(dtype=wp.vec3),
    whole: wp.array(dtype=wp.int64),
):
    c = wp.tid()
    if c >= counters[0]:
        return
    v = ids[c]
    w = lam[c]
    f = weight[c] * slip(v, w, normal[c], given[c], x, x_start)
    for k in range(4):
        if v[k] < gradient_out.shape[0] and w[k] != 0.0:
            add(gradient_out, whole, v[k], w[k] * f)


@wp.kernel
def give_kernel(
    counters: wp.array(dtype=wp.int32),
    ids: wp.array(dtype=wp.vec4i),
    lam: wp.array(dtype=wp.vec4),
    normal: wp.array(dtype=wp.vec3),
    presliding: float,
    x: wp.array(dtype=wp.vec3),
    x_start: wp.array(dtype=wp.vec3),
    table: wp.array(dtype=wp.int32),
    known_ids: wp.array(dtype=wp.vec4i),
    known: wp.array(dtype=wp.vec3),
    given_out: wp.array(dtype=wp.vec3),
):
    """The slip at the end of a step is what the next one begins with; of what slides, as much as it resists."""
    c = wp.tid()
    if c >= wp.min(counters[0], given_out.shape[0]):
        return
    v = ids[c]
    u = slip(v, lam[c], normal[c], recall(v, table, known_ids, known), x, x_start)
    y = wp.length(u)
    if y > presliding:
        u = (presliding / y) * u
    given_out[c] = u


@wp.kernel
def add_stiffness_kernel(
    counters: wp.array(dtype=wp.int32),
    normal: wp.array(dtype=wp.vec3),
    weight: wp.array(dtype=wp.float32),
    along: wp.array(dtype=wp.vec4),
    beside: wp.array(dtype=wp.mat33),
):
    c = wp.tid()
    if c >= counters[0]:
        return
    n = normal[c]
    t = wp.vec3(along[c][0], along[c][1], along[c][2])
    tangential = weight[c] * (wp.identity(n=3, dtype=wp.float32) - wp.outer(n, n)) + along[c][3] * wp.outer(t, t)
    beside[c] = beside[c] + tangential


class SlipOfPairs:
    """Per contact pair, for one that there is room for: `given` vec3 m, how far it had given when the step began;
    `weight` float32 N/m and `along` vec4, see `hold`. `known` holds the contacts that the step began with,
    `ended` (count, ids, given) those it ended with, as in Presliding."""

    def __init__(self, capacity: int, presliding: float, sums: OrderFreeSums, device: str) -> None:
        self.presliding, self.sums, self.device = presliding, sums, device
        self._allocate(capacity)

    def _allocate(self, capacity: int) -> None:
        self.known = Presliding.allocate(capacity, self.device)
        self.ended = (
            wp.zeros(1, dtype=wp.int32, device=self.device),
            wp.zeros(capacity, dtype=wp.vec4i, device=self.device),
            wp.zeros(capacity, dtype=wp.vec3, device=self.device),
        )
        self.given = wp.zeros(capacity, dtype=wp.vec3, device=self.device)
        self.weight = wp.zeros(capacity, dtype=wp.float32, device=self.device)
        self.along = wp.zeros(capacity, dtype=wp.vec4, device=self.device)

    def room(self) -> int:
        """For how many pairs."""
        return len(self.weight)

    def make_room(self, capacity: int) -> None:
        """For so many pairs, a power of two; what is known stays so."""
        if self.room() >= capacity:
            return
        known, ended = self.known, self.ended
        self._allocate(capacity)
        self.known.replace_by(known.count, known.ids, known.given)
        self.end_with(*ended)

    def end_with(self, count: wp.array, ids: wp.array, given: wp.array) -> None:
        """The next step begins with these contacts: arrays as in Presliding, not longer than there is room for."""
        kept_count, kept_ids, kept_given = self.ended
        wp.copy(kept_count, count, count=1)
        wp.copy(kept_ids, ids, count=len(ids))
        wp.copy(kept_given, given, count=len(given))

    def kept(self) -> tuple[np.ndarray, np.ndarray]:
        """(P, 4) int32 vertices of the contacts that the next step begins with, (P, 3) float32 m how far each has
        given."""
        count, ids, given = self.ended
        known = int(count.numpy()[0])
        return ids.numpy()[:known], given.numpy()[:known]

    def restore(self, ids: np.ndarray, given: np.ndarray) -> None:
        """Let the next step begin with what `kept` returned."""
        self.make_room(1 << max(len(ids) - 1, 0).bit_length())
        count: wp.array = wp.array([len(ids)], dtype=wp.int32, device=self.device)
        entries: wp.array = wp.array(ids, dtype=wp.vec4i, device=self.device)
        self.end_with(count, entries, wp.array(given, dtype=wp.vec3, device=self.device))

    def begin(self, _state: State) -> None:
        """A step begins with what the last one ended with."""
        self.known.replace_by(*self.ended)

    def add_gradient(self, pairs: ContactPairs, state: State, x: wp.array, gradient: wp.array) -> None:
        """As in ContactTerm."""
        model = [pairs.counters, pairs.ids, pairs.lam, pairs.normal, self.weight, self.given, x, state.x_start]
        launch(add_gradient_kernel, pairs.size, model, [gradient, self.sums.vectors], device=self.device)

    def add_stiffness(self, pairs: ContactPairs) -> None:
        """As in ContactTerm."""
        model = [pairs.counters, pairs.normal, self.weight, self.along]
        launch(add_stiffness_kernel, pairs.size, model, [pairs.beside], device=self.device)

    def tangential(self, pairs: ContactPairs) -> np.ndarray:
        """(size,) float64 N/m, the force over the slip."""
        return self.weight.numpy()[: pairs.size].astype(np.float64)

    def remember(self, pairs: ContactPairs, state: State) -> None:
        """As in ContactTerm."""
        self.make_room(pairs.capacity)
        if not pairs.size:
            self.ended[0].zero_()
            return
        known = self.known
        model = [pairs.counters, pairs.ids, pairs.lam, pairs.normal, self.presliding, state.x, state.x_start]
        launch(
            give_kernel,
            pairs.size,
            [*model, known.table, known.ids, known.given],
            [self.given],
            device=self.device,
        )
        self.end_with(pairs.counters, pairs.ids, self.given)

    def term(self, prepare: Callable[[ContactPairs, State, wp.array, wp.array | None], None]) -> ContactTerm:
        """Of these contacts alone; `prepare` writes `given`, `weight` and `along`."""
        return ContactTerm(
            lambda pairs: self.make_room(pairs.capacity),
            self.room,
            prepare,
            self.add_gradient,
            self.add_stiffness,
            self.tangential,
            self.remember,
            self.kept,
            self.restore,
        )
