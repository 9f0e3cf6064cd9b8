"""Coulomb friction with presliding, on every contact pair.

For a pair with normal force N = -e kappa b' and tangential slip u = (I - n n^T)(g + sum_i lam_i (x_i - x_start_i)),
which includes the body's own motion, the force on vertex i is

    -lam_i mu N f1(|u|) u/|u|,   f1(y) = (2 - y/s) y/s for y < s, else 1,   s = `presliding`.

mu is that of the two materials that touch (Friction.static). Where their kinetic coefficient is less, f1 falls from 1
at s to mu_k/mu at 2 s and stays there: a contact sticks up to mu N, and resists with mu_k N once it slides by s or more
in a step, 6 mm/s at 1/60 s.

N and n are lagged per iteration. Source of the potential within a step: Li et al. 2020 (IPC), section 5. There g = 0
and s = eps_v dt: friction begins each step without force, and what sticks creeps. Here g is what the contact had given
by the end of the last step (presliding.py), at most s, as Cundall and Strack 1979 ("A discrete numerical model for
granular assemblies") remember it: what sticks has its force already and stays, and s may be a length that the solver
resolves easily. Two matrices are made of it, both positive semidefinite, with T = I - n n^T and t = u/|u|:

    a model that is used away from where it was made (the contact proxy):   mu N f1/y T
    an iteration of the correction:                                         mu N (f1/y (T - t t^T) + c t t^T)

The first bounds the potential from above, and iterated alone it leaves the static regime ever so slowly: along t the
force of what slides does not grow any more. So in the correction c is f1', zero beyond s. A slip that an iteration
turned round (u . u_before < 0) has passed the static regime, where f1' knows nothing of the resistance in between:
there c is the slope of the chord, (f1(y) + f1(y_before))/(y + y_before). A slip beyond s that an iteration shortened is
on its way back to it, and c = 0 would send it past again and again: there the secant stays, which shortens it steadily.
Of the pair's normal forces at this iterate and the last the smaller counts, and where they differ by more than SETTLED
the secant stays: a pair that fell deep into its barrier for one iteration would throw the cloth.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import warp as wp

from tryon_solver.contact.barrier import barrier_gradient
from tryon_solver.contact.pairs import ContactPairs
from tryon_solver.effects.base import BuildContext
from tryon_solver.effects.presliding import Presliding, recall
from tryon_solver.linalg.launch import launch
from tryon_solver.materials.fabric import Fabric
from tryon_solver.plan import ContactTerm, Contribution
from tryon_solver.scene import Friction, Scene
from tryon_solver.state import State

wp.set_module_options({"enable_backward": False})

FIRST_ROOM = 1 << 10  # contacts; it grows with the list of pairs
SETTLED = 0.5  # share that the normal force of a pair keeps, or kept, from an iteration to the next to be relied on


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
def force_before(
    v: wp.vec4i, w: wp.vec4, n: wp.vec3, gap: wp.vec3, x: wp.array(dtype=wp.vec3), x_before: wp.array(dtype=wp.vec3)
) -> float:
    """Contact force at x_before over that at x [-]."""
    g = gap[0]
    for k in range(4):
        g += w[k] * wp.dot(n, x_before[v[k]] - x[v[k]])
    return barrier_gradient(g, gap[1], gap[2]) / barrier_gradient(gap[0], gap[1], gap[2])


@wp.kernel
def prepare_kernel(
    counters: wp.array(dtype=wp.int32),
    ids: wp.array(dtype=wp.vec4i),
    lam: wp.array(dtype=wp.vec4),
    normal: wp.array(dtype=wp.vec3),
    slope: wp.array(dtype=wp.float32),
    gap: wp.array(dtype=wp.vec3),
    material: wp.array(dtype=wp.int32),
    coefficients: wp.array2d(dtype=wp.vec2),
    presliding: float,
    iterating: int,
    x: wp.array(dtype=wp.vec3),
    x_before: wp.array(dtype=wp.vec3),
    x_start: wp.array(dtype=wp.vec3),
    table: wp.array(dtype=wp.int32),
    known_ids: wp.array(dtype=wp.vec4i),
    known: wp.array(dtype=wp.vec3),
    given_out: wp.array(dtype=wp.vec3),
    weight_out: wp.array(dtype=wp.float32),
    along_out: wp.array(dtype=wp.vec4),
):
    """weight = mu N f1(|u|)/|u| [N/m]; along = (t, what the stiffness along t has beyond it [N/m]). `coefficients`
    (M, M) of mu and mu_k between the materials (A,) of a stencil's first and its last vertex, one of each side."""
    c = wp.tid()
    if c >= counters[0]:
        return
    v = ids[c]
    given = recall(v, table, known_ids, known)
    given_out[c] = given
    u = slip(v, lam[c], normal[c], given, x, x_start)
    y = wp.length(u)
    mu = coefficients[material[v[0]], material[v[3]]]
    coulomb = -mu[0] * slope[c]
    kinetic = float(1.0)
    if mu[0] > 0.0:
        kinetic = mu[1] / mu[0]
    settled = bool(False)
    if iterating == 1:
        ratio = force_before(v, lam[c], normal[c], gap[c], x, x_before)
        coulomb *= wp.min(ratio, 1.0)
        settled = ratio > SETTLED and ratio * SETTLED < 1.0
    weight = coulomb * resistance(y, presliding, kinetic) / wp.max(y, presliding)
    if y < presliding:
        weight = coulomb * (2.0 - y / presliding) / presliding
    weight_out[c] = weight
    along_out[c] = wp.vec4()
    if not settled or y == 0.0:
        return
    stiffness = 2.0 * coulomb * wp.max(1.0 - y / presliding, 0.0) / presliding
    before = slip(v, lam[c], normal[c], given, x_before, x_start)
    y_before = wp.length(before)
    turned = wp.dot(u, before) < 0.0
    if not turned and y > presliding and y < y_before:
        return
    if turned:
        together = resistance(y, presliding, kinetic) + resistance(y_before, presliding, kinetic)
        stiffness = coulomb * together / (y + y_before)
    t = u / y
    along_out[c] = wp.vec4(t[0], t[1], t[2], stiffness - weight)


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
):
    c = wp.tid()
    if c >= counters[0]:
        return
    v = ids[c]
    w = lam[c]
    f = weight[c] * slip(v, w, normal[c], given[c], x, x_start)
    for k in range(4):
        if v[k] < gradient_out.shape[0]:
            wp.atomic_add(gradient_out, v[k], w[k] * f)


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


class FrictionOfPairs:
    """Per contact pair, for one that there is room for: `given` vec3 m, how far it had given when the step began;
    `weight` float32 N/m and `along` vec4, see prepare_kernel. `known` holds the contacts that the step began with,
    `ended` (count, ids, given) those it ended with, as in Presliding."""

    def __init__(self, capacity: int, device: str) -> None:
        self.device = device
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


def materials_of(spec: Friction, scene: Scene) -> np.ndarray:
    """(A,) int32: each vertex's row of the coefficients: the body's is the last, a seam's that of its last panel. They
    are of panels where a table is given, of an outfit's garments where none is."""
    garment = scene.garment
    own = np.zeros(garment.vertex_count, np.int32)
    last = max(1, len(garment.layers))
    if spec.static is not None:
        own[garment.faces] = garment.panel_of_face[:, None]
        last = len(spec.static) - 1
    else:
        for number, layer in enumerate(garment.layers):
            own[layer.vertices] = number
    body = 0 if scene.body is None else len(scene.body.rest_vertices)
    return np.concatenate([own, np.full(body, last, np.int32)])


def coefficients_of(spec: Friction, scene: Scene) -> np.ndarray:
    """(M, M, 2) float32: mu and mu_k between materials.

    Two fabrics have the geometric mean of what each has against itself, unless a table says what it is.
    """
    static = between_fabrics(scene.fabric_of_garments()) if spec.static is None else spec.static
    kinetic = static if spec.kinetic is None else spec.kinetic
    return np.stack([static, kinetic], axis=2).astype(np.float32)


def between_fabrics(fabrics: Sequence[Fabric]) -> np.ndarray:
    """(K + 1, K + 1), without unit: between K fabrics and the body, which is last."""
    own = np.array([fabric.mu_self for fabric in fabrics])
    skin = np.array([fabric.mu_body for fabric in fabrics])
    table = np.zeros((len(fabrics) + 1, len(fabrics) + 1))
    table[:-1, :-1] = np.sqrt(np.outer(own, own))
    table[np.diag_indices(len(fabrics))] = own  # a root of a square may be off in its last digit
    table[:-1, -1] = table[-1, :-1] = skin
    return table


def bind(spec: Friction, context: BuildContext) -> Contribution | None:
    """None when all is frictionless."""
    device = context.device
    table = coefficients_of(spec, context.scene)
    if not table.any():
        return None
    material: wp.array = wp.array(materials_of(spec, context.scene), dtype=wp.int32, device=device)
    coefficients: wp.array = wp.array(table, dtype=wp.vec2, device=device)
    held = FrictionOfPairs(FIRST_ROOM, device)

    def begin(_state: State) -> None:
        held.known.replace_by(*held.ended)

    def make_room(pairs: ContactPairs) -> None:
        held.make_room(pairs.capacity)

    def prepare(pairs: ContactPairs, state: State, x: wp.array, x_before: wp.array | None) -> None:
        make_room(pairs)
        launch(
            prepare_kernel,
            pairs.size,
            [
                pairs.counters,
                pairs.ids,
                pairs.lam,
                pairs.normal,
                pairs.slope,
                pairs.gap,
                material,
                coefficients,
                spec.presliding,
                int(x_before is not None),
                x,
                x if x_before is None else x_before,
                state.x_start,
                held.known.table,
                held.known.ids,
                held.known.given,
            ],
            [held.given, held.weight, held.along],
            device=device,
        )

    def add_gradient(pairs: ContactPairs, state: State, x: wp.array, gradient: wp.array) -> None:
        launch(
            add_gradient_kernel,
            pairs.size,
            [
                pairs.counters,
                pairs.ids,
                pairs.lam,
                pairs.normal,
                held.weight,
                held.given,
                x,
                state.x_start,
            ],
            [gradient],
            device=device,
        )

    def add_stiffness(pairs: ContactPairs) -> None:
        launch(
            add_stiffness_kernel,
            pairs.size,
            [pairs.counters, pairs.normal, held.weight, held.along],
            [pairs.beside],
            device=device,
        )

    def tangential(pairs: ContactPairs) -> np.ndarray:
        return held.weight.numpy()[: pairs.size].astype(np.float64)

    def remember(pairs: ContactPairs, state: State) -> None:
        make_room(pairs)
        known = held.known
        launch(
            give_kernel,
            pairs.size,
            [
                pairs.counters,
                pairs.ids,
                pairs.lam,
                pairs.normal,
                spec.presliding,
                state.x,
                state.x_start,
                known.table,
                known.ids,
                known.given,
            ],
            [held.given],
            device=device,
        )
        held.end_with(pairs.counters, pairs.ids, held.given)

    term = ContactTerm(
        make_room, held.room, prepare, add_gradient, add_stiffness, tangential, remember, held.kept, held.restore
    )
    return Contribution("friction", start_step=begin, contact=term)
