"""Contacts that stick, and part when they are pulled far enough: a cohesive zone within the barrier's reach.

The barrier (contact/barrier.py) keeps surfaces apart by a gap g and ends at g_hat. In the outer part of its reach, of
the width w = 3 W/(2 S), a sticky contact pulls instead of pushing. With g0 = g_hat - w, where it is at rest,

    traction per area   t(g) = 4 S y (1 - y),   y = (g - g0)/w from 0 to 1                                  [Pa]

whose largest value is the strength S and whose integral the work W [J/m^2]. What the term adds to a pair is t and what
takes the barrier back to where it was at g0: so beyond g0 the two together are t, and before g0 the barrier without the
load that it has at g0; friction knows that load. An energy of g alone: where cloth parts, the same work is done
whatever the law's form (Griffith 1921), so a strip is peeled off at a right angle by W times its width (Kendall 1975),
and by a fifth to two thirds more where it is held sideways, too, for the peeled edge slips (METHOD.md, section 6).
Adhesion as a potential within the barrier's reach, with the barrier's load giving friction its normal force: after
augmented IPC (Fang, Li, Jiang, Kaufman 2023); the law is ours. It has no memory: what has parted sticks again as
before.

**Area.** Stencils overlap: a vertex is in several pairs, and has in each a share of its area by how hard the barrier
pushes there, N = -e kappa b' (what lies aside, or is nearly parallel, counts little),

    area of a pair = sum over its vertices of N |lam_i| A_i/s_i,   s_i = sum over all pairs of N |lam_i|

half of it where both sides are sticky cloth, so that all pairs together have the area that is in contact: all that is
around the vertices of what touches, by up to a cell more than there is at its border. The shares are taken with the
pairs. Where cloth feels cloth nearer than d_hat because its mesh is fine, g_hat is less, w shrinks with it and so does
the work.

In the matrix of a pair the barrier's curvature beyond g0 is replaced by t', where that is positive.

**Sideways** each m^2 holds with up to its shear strength T, as friction does with a Coulomb force, and remembers what
it has given (slip.py), whatever it is pressed with; what is being pulled off has lost its share of it:

    F = T area (1 - y) beyond g0,   T area before it

So what sticks neither creeps nor slips below T times its area, and slips with that resistance above, as tape does.
Where T is not told it is S, up to what the fabric bears (effect_specs.Adhesion.shear_in): cloth within its limit feels
no more of a bond, and beside its stiffness T/s conjugate gradients that are cut short see no fabric. The
idea is augmented IPC's tangential adhesion; there what has slipped resists no more within a step.

**What holds must be found first.** t falls beyond its peak, so a step may have two balances, stuck and parted, and
cloth that is stuck must stay with the first as long as there is one. In 1/60 s a load takes free cloth millimetres
away, past all of w. So the contact proxy goes on as a spring with the slope t' of where it is made, and the way to the
trial from which the correction begins is shortened, at vertices of pairs that hold, to where t has its peak
(`restrain`). From there Newton's method comes to the stuck balance from below, for t is concave; where there is none it
passes the peak.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import warp as wp

from tryon_solver.contact.barrier import barrier_gradient
from tryon_solver.contact.candidates import ContactSizes, offset
from tryon_solver.contact.pairs import ContactPairs
from tryon_solver.effects.base import BuildContext
from tryon_solver.effects.presliding import recall
from tryon_solver.effects.slip import FIRST_ROOM, SlipOfPairs, hold, slip
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.order_free import add, add_number
from tryon_solver.offsets import contact_sizes
from tryon_solver.plan import Contribution
from tryon_solver.scene import Adhesion
from tryon_solver.state import State

wp.set_module_options({"enable_backward": False})

WIDEST = 0.9  # of d_hat: what is left keeps surfaces apart


@wp.kernel
def count_shares_kernel(
    counters: wp.array(dtype=wp.int32),
    ids: wp.array(dtype=wp.vec4i),
    lam: wp.array(dtype=wp.vec4),
    slope: wp.array(dtype=wp.float32),
    shares: wp.array(dtype=wp.float32),
    whole: wp.array(dtype=wp.int64),
):
    """shares[i] += -e kappa b' |lam_i|"""
    c = wp.tid()
    if c >= counters[0]:
        return
    for k in range(4):
        if ids[c][k] < shares.shape[0]:
            add_number(shares, whole, ids[c][k], -slope[c] * wp.abs(lam[c][k]))


@wp.kernel
def prepare_kernel(
    counters: wp.array(dtype=wp.int32),
    ids: wp.array(dtype=wp.vec4i),
    lam: wp.array(dtype=wp.vec4),
    slope: wp.array(dtype=wp.float32),
    gap: wp.array(dtype=wp.vec3),
    sticky: wp.array(dtype=wp.float32),
    shares: wp.array(dtype=wp.float32),
    width: float,
    area_out: wp.array(dtype=wp.float32),
    load_out: wp.array(dtype=wp.float32),
):
    """Of each pair its area [m^2], and the barrier's force at g0 [N]; `sticky` (N,) m^2, `width` w/d_hat."""
    c = wp.tid()
    if c >= counters[0]:
        return
    one = float(0.0)
    other = float(0.0)
    for k in range(4):
        i = ids[c][k]
        if i < sticky.shape[0] and shares[i] > 0.0:
            part = -slope[c] * wp.abs(lam[c][k]) * sticky[i] / shares[i]
            if lam[c][k] > 0.0:
                one += part
            else:
                other += part
    area_out[c] = one + other
    if one > 0.0 and other > 0.0:
        area_out[c] = 0.5 * (one + other)
    g = gap[c]
    g0 = g[1] * (1.0 - width)
    load = slope[c]
    if g[0] < g0:
        load = slope[c] * barrier_gradient(g0, g[1], g[2]) / barrier_gradient(g[0], g[1], g[2])
    load_out[c] = -load


@wp.kernel
def add_gradient_kernel(
    counters: wp.array(dtype=wp.int32),
    ids: wp.array(dtype=wp.vec4i),
    lam: wp.array(dtype=wp.vec4),
    normal: wp.array(dtype=wp.vec3),
    slope: wp.array(dtype=wp.float32),
    curvature: wp.array(dtype=wp.float32),
    gap: wp.array(dtype=wp.vec3),
    area: wp.array(dtype=wp.float32),
    load: wp.array(dtype=wp.float32),
    cloth_count: int,
    sizes: ContactSizes,
    strength: float,
    width: float,
    share: wp.array(dtype=wp.float32),
    proxy: int,
    x: wp.array(dtype=wp.vec3),
    gradient_out: wp.array(dtype=wp.vec3),
    whole: wp.array(dtype=wp.int64),
):
    """At x, along the normals of where the pairs were collected; `share` scales all of it. The `proxy` is linear."""
    c = wp.tid()
    if c >= counters[0] or area[c] == 0.0:
        return
    v = ids[c]
    n = normal[c]
    g = -offset(v, cloth_count, sizes)
    for k in range(4):
        g += lam[c][k] * wp.dot(n, x[v[k]])
    reach = gap[c][1]
    w = width * reach
    y = (g - (reach - w)) / w
    pushed = wp.min(slope[c] + curvature[c] * (g - gap[c][0]), 0.0)  # by the barrier's one-sided model, pairs.py
    pull = load[c]
    if proxy == 1:
        z = (gap[c][0] - (reach - w)) / w
        pull = slope[c] + curvature[c] * (g - gap[c][0]) + load[c] - pushed
        if z > 0.0:
            pull = 4.0 * strength * area[c] * (z * (1.0 - z) + wp.max(1.0 - 2.0 * z, 0.0) * (y - z)) - pushed
    elif y >= 1.0:
        return
    elif y > 0.0:
        pull = 4.0 * strength * area[c] * y * (1.0 - y) - pushed
    for k in range(4):
        if v[k] < gradient_out.shape[0]:
            add(gradient_out, whole, v[k], (share[0] * lam[c][k] * pull) * n)


@wp.kernel
def add_stiffness_kernel(
    counters: wp.array(dtype=wp.int32),
    normal: wp.array(dtype=wp.vec3),
    curvature: wp.array(dtype=wp.float32),
    gap: wp.array(dtype=wp.vec3),
    area: wp.array(dtype=wp.float32),
    strength: float,
    width: float,
    share: wp.array(dtype=wp.float32),
    beside: wp.array(dtype=wp.mat33),
):
    c = wp.tid()
    if c >= counters[0] or area[c] == 0.0:
        return
    w = width * gap[c][1]
    y = (gap[c][0] - (gap[c][1] - w)) / w
    if y > 0.0:
        rising = 4.0 * strength * area[c] * wp.max(1.0 - 2.0 * y, 0.0) / w
        beside[c] = beside[c] + share[0] * (rising - curvature[c]) * wp.outer(normal[c], normal[c])


@wp.kernel
def allow_kernel(
    counters: wp.array(dtype=wp.int32),
    ids: wp.array(dtype=wp.vec4i),
    lam: wp.array(dtype=wp.vec4),
    normal: wp.array(dtype=wp.vec3),
    gap: wp.array(dtype=wp.vec3),
    area: wp.array(dtype=wp.float32),
    width: float,
    move: wp.array(dtype=wp.vec3),
    shares: wp.array(dtype=wp.float32),
):
    """Which share of its move a vertex may make so that no pair that holds is parted beyond the peak of t."""
    c = wp.tid()
    if c >= counters[0] or area[c] == 0.0:
        return
    w = width * gap[c][1]
    allowed = gap[c][1] - 0.5 * w - gap[c][0]
    parted = float(0.0)
    for k in range(4):
        parted += lam[c][k] * wp.dot(normal[c], move[ids[c][k]])
    if allowed > 0.0 and parted > allowed:
        for k in range(4):
            if ids[c][k] < shares.shape[0] and lam[c][k] != 0.0:
                wp.atomic_min(shares, ids[c][k], allowed / parted)


@wp.kernel
def shorten_kernel(shares: wp.array(dtype=wp.float32), move: wp.array(dtype=wp.vec3)):
    i = wp.tid()
    move[i] = shares[i] * move[i]


def zone_width(spec: Adhesion, d_hat: float) -> float:
    """w/d_hat. Raises ValueError for a zone that does not fit into the barrier's reach."""
    width = 1.5 * spec.work / spec.strength / d_hat
    if width > WIDEST:
        most = WIDEST * d_hat * spec.strength / 1.5
        raise ValueError(
            f"adhesion: work {spec.work} J/m^2 at a strength of {spec.strength} Pa acts over {width * d_hat:.2e} m, "
            f"and contact reaches {d_hat} m; lower work to {most:.3g} J/m^2, or raise strength or settings.d_hat"
        )
    return width


@wp.kernel
def hold_kernel(
    counters: wp.array(dtype=wp.int32),
    ids: wp.array(dtype=wp.vec4i),
    lam: wp.array(dtype=wp.vec4),
    normal: wp.array(dtype=wp.vec3),
    gap: wp.array(dtype=wp.vec3),
    area: wp.array(dtype=wp.float32),
    shear: float,
    width: float,
    share: wp.array(dtype=wp.float32),
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
    """What each pair is held aside with: `given` [m], `weight` and `along` as slip.py's `hold` has them."""
    c = wp.tid()
    if c >= counters[0]:
        return
    v = ids[c]
    given = recall(v, table, known_ids, known)
    w = width * gap[c][1]
    y = wp.max((gap[c][0] - (gap[c][1] - w)) / w, 0.0)
    most = share[0] * shear * area[c] * wp.max(1.0 - y, 0.0)
    u = slip(v, lam[c], normal[c], given, x, x_start)
    before = slip(v, lam[c], normal[c], given, x_before, x_start)
    weight, along = hold(u, before, most, presliding, 1.0, iterating == 1)
    given_out[c] = given
    weight_out[c] = weight
    along_out[c] = along


class AdhesionOfPairs:
    """Per contact pair, for one that there is room for: `area` float32 m^2, `load` float32 N; `shares` (N,) float32.
    `proxy`: was the last model made for the contact proxy?"""

    def __init__(self, cloth_count: int, device: str) -> None:
        self.device = device
        self.shares = wp.zeros(cloth_count, dtype=wp.float32, device=device)
        self.proxy = False
        self._allocate(FIRST_ROOM)

    def _allocate(self, capacity: int) -> None:
        self.area = wp.zeros(capacity, dtype=wp.float32, device=self.device)
        self.load = wp.zeros(capacity, dtype=wp.float32, device=self.device)

    def room(self) -> int:
        """For how many pairs."""
        return len(self.area)

    def make_room(self, pairs: ContactPairs) -> None:
        """For as many as `pairs` has room for."""
        if self.room() < pairs.capacity:
            self._allocate(pairs.capacity)


def bind(spec: Adhesion, context: BuildContext) -> Contribution | None:
    """Always something to do: a spec of what does not stick is idle."""
    settings, device, scene, sums = context.settings, context.device, context.scene, context.sums
    width = zone_width(spec, settings.d_hat)
    shear = spec.shear_in(scene)
    count = scene.garment.vertex_count
    held = AdhesionOfPairs(count, device)
    share = wp.ones(1, dtype=wp.float32, device=device)
    sticky = wp.zeros(count, dtype=wp.float32, device=device)
    body_count = 0 if scene.body is None else len(scene.body.rest_vertices)
    sizes = contact_sizes(scene, settings, body_count, device)

    def reshape() -> None:
        area = context.rest.spread.numpy().copy()
        if spec.vertices is not None:
            area[np.setdiff1d(np.arange(count), spec.vertices)] = 0
        sticky.assign(area)

    aside = SlipOfPairs(FIRST_ROOM, spec.presliding, sums, device)

    def make_room(pairs: ContactPairs) -> None:
        held.make_room(pairs)
        aside.make_room(pairs.capacity)

    def prepare(pairs: ContactPairs, state: State, x: wp.array, x_before: wp.array | None) -> None:
        make_room(pairs)
        held.proxy = x_before is None
        held.shares.zero_()
        weights = [pairs.counters, pairs.ids, pairs.lam, pairs.slope]
        launch(count_shares_kernel, pairs.size, weights, [held.shares, sums.numbers], device=device)
        sums.settle_numbers(held.shares)
        inputs = [*weights, pairs.gap, sticky, held.shares, width]
        launch(prepare_kernel, pairs.size, inputs, [held.area, held.load], device=device)
        model = [pairs.counters, pairs.ids, pairs.lam, pairs.normal, pairs.gap, held.area, shear, width, share]
        slips = [spec.presliding, int(x_before is not None), x, x if x_before is None else x_before, state.x_start]
        known = [aside.known.table, aside.known.ids, aside.known.given]
        outputs = [aside.given, aside.weight, aside.along]
        launch(hold_kernel, pairs.size, [*model, *slips, *known], outputs, device=device)

    def add_gradient(pairs: ContactPairs, state: State, x: wp.array, gradient: wp.array) -> None:
        model = [pairs.counters, pairs.ids, pairs.lam, pairs.normal, pairs.slope, pairs.curvature, pairs.gap]
        own = [held.area, held.load, count, sizes, spec.strength, width, share, int(held.proxy)]
        launch(add_gradient_kernel, pairs.size, [*model, *own, x], [gradient, sums.vectors], device=device)
        aside.add_gradient(pairs, state, x, gradient)

    def add_stiffness(pairs: ContactPairs) -> None:
        model = [pairs.counters, pairs.normal, pairs.curvature, pairs.gap]
        inputs = [*model, held.area, spec.strength, width, share]
        launch(add_stiffness_kernel, pairs.size, inputs, [pairs.beside], device=device)
        aside.add_stiffness(pairs)

    def restrain(pairs: ContactPairs, move: wp.array) -> None:
        held.shares.fill_(1.0)
        inputs = [pairs.counters, pairs.ids, pairs.lam, pairs.normal, pairs.gap, held.area, width, move]
        launch(allow_kernel, pairs.size, inputs, [held.shares], device=device)
        launch(shorten_kernel, count, [held.shares], [move], device=device)

    acting = {"add_gradient": add_gradient, "add_stiffness": add_stiffness, "restrain": restrain}
    term = replace(aside.term(prepare), make_room=make_room, **acting)
    return Contribution(
        "adhesion", start_step=aside.begin, contact=term, reshape=reshape, values={"share": share}
    )
