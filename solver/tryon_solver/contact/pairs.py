"""Contact pairs: the candidates within reach of the barrier, with all that the solve needs of them.

Of a pair the potential is e kappa b(d - xi) (barrier.py), e the mollifier of nearly parallel edges. Gradient:
lam_i (e kappa b') n for vertex i. Hessian, positive semidefinite Gauss-Newton part: lam_i lam_j (e kappa b'') n n^T;
what is dropped carries b' <= 0 and would only soften it.

e is lagged: recomputed with the pairs, its own derivative left out. That derivative is a torque that turns nearly
parallel edges away from each other, larger than the weight of the cloth on our meshes and without a bounded Hessian;
with it a garment at rest keeps trembling (METHOD.md section 5).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from tryon_solver.contact.barrier import barrier, barrier_curvature, barrier_gradient, mollifier
from tryon_solver.contact.candidates import Candidates, ContactSizes, candidate_at, offset, same_garment
from tryon_solver.contact.distances import stencil_vector, stencil_weights
from tryon_solver.contact.nearest import Fans, share_of_stencil
from tryon_solver.linalg.clear import clear
from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.order_free import OrderFreeSums, add, add_matrix
from tryon_solver.linalg.read_back import read
from tryon_solver.linalg.slots import next_slot

wp.set_module_options({"enable_backward": False})

GAP_FLOOR = 0.03  # of xi, or of the activation distance if that is less: below it the barrier's force grows linearly


@dataclass
class ContactPairs:
    """Pairs within reach at `x_ref`, one entry each.

    `ids` vec4i; `lam` vec4 weights; `normal` vec3 unit; `slope` e kappa b' [N], <= 0; `curvature` e kappa b'' [N/m];
    `energy` [J]; `gap` vec3: g, the activation distance g_hat and the barrier's floor [m]. `beside` mat33 N/m: the
    stiffness of all that acts in the pair beside the barrier, apart from it because it can be smaller than what
    rounding leaves of e kappa b'' n n^T. `counters` (2,) int32: how many, and how many of them at d <= xi. Here `size`,
    what launches cover, and `overlapping` are the same; in a graph, which can't be read from, `size` is the capacity.
    """

    ids: wp.array
    lam: wp.array
    normal: wp.array
    slope: wp.array
    curvature: wp.array
    energy: wp.array
    gap: wp.array
    beside: wp.array
    counters: wp.array
    smallest_gap: wp.array
    capacity: int
    size: int = 0
    overlapping: int = 0

    @staticmethod
    def allocate(capacity: int, device: str) -> ContactPairs:
        def zeros(dtype: type) -> wp.array:
            return wp.zeros(capacity, dtype=dtype, device=device)

        return ContactPairs(
            zeros(wp.vec4i),
            zeros(wp.vec4),
            zeros(wp.vec3),
            zeros(wp.float32),
            zeros(wp.float32),
            zeros(wp.float32),
            zeros(wp.vec3),
            zeros(wp.mat33),
            wp.zeros(2, dtype=wp.int32, device=device),
            wp.zeros(2, dtype=wp.float32, device=device),
            capacity,
        )

    def make_room(self, count: int) -> None:
        """For so many: where there is less, all that is known of any is lost."""
        if count > self.capacity:
            grown = ContactPairs.allocate(1 << (count - 1).bit_length(), str(self.counters.device))
            self.__dict__.update(grown.__dict__)

    def cover_in_graph(self) -> bool:
        """Let launches cover whatever number of pairs there may come to be, if a graph is being captured: is one?"""
        capturing = bool(wp.get_device(self.counters.device).is_capturing)
        if capturing:
            self.size = self.capacity
        return capturing

    def stop_when_full(self, going_on: wp.array, wants_room: wp.array) -> None:
        """For the device: end the loop of the condition `going_on` (1,), and tell `wants_room` (1,) why, where there
        should be more pairs than there is room for."""
        told = [self.counters, self.capacity]
        launch(stop_when_full_kernel, 1, told, [going_on, wants_room], device=self.counters.device)

    def read_size(self) -> int:
        """Know how many pairs there are; returns how many there should be. Waits for the device."""
        return self.know_size(read(self.counters)[0])

    def know_size(self, counters: np.ndarray) -> int:
        """The same of `counters` (2,) that have been read."""
        found, self.overlapping = (int(k) for k in counters)
        self.size = min(found, self.capacity)
        return found


@wp.kernel
def stop_when_full_kernel(
    counters: wp.array(dtype=wp.int32),
    room: int,
    going_on: wp.array(dtype=wp.int32),
    wants_room: wp.array(dtype=wp.int32),
):
    if counters[0] > room:
        going_on[0] = 0
        wants_room[0] = 1


@wp.struct
class ContactModel:
    """Stiffness of the contact potential.

    `pressure_stiffness` N/m^3: kappa is this times the stencil's share of cloth area; `eps_body`, `eps_self` m^4:
    mollifier thresholds 1e-3 |ea|^2 |eb|^2 at the meshes' mean edge lengths.
    """

    pressure_stiffness: float
    eps_body: float
    eps_self: float


@wp.kernel
def collect_kernel(
    near: wp.array(dtype=wp.int32),
    listed: wp.array(dtype=wp.int32),
    some: int,
    threads: int,
    candidate_ids: wp.array(dtype=wp.vec4i),
    candidate_kind: wp.array(dtype=wp.int32),
    cloth_count: int,
    sizes: ContactSizes,
    model: ContactModel,
    area: wp.array(dtype=wp.float32),
    reach_self: wp.array(dtype=wp.float32),
    starts: wp.array(dtype=wp.int32),
    corners: wp.array(dtype=wp.vec2i),
    x: wp.array(dtype=wp.vec3),
    candidate_distance: wp.array(dtype=wp.float32),
    ids_out: wp.array(dtype=wp.vec4i),
    lam_out: wp.array(dtype=wp.vec4),
    normal_out: wp.array(dtype=wp.vec3),
    slope_out: wp.array(dtype=wp.float32),
    curvature_out: wp.array(dtype=wp.float32),
    energy_out: wp.array(dtype=wp.float32),
    gap_out: wp.array(dtype=wp.vec3),
    counters_out: wp.array(dtype=wp.int32),
    smallest_gap_out: wp.array(dtype=wp.float32),
):
    for entry in range(wp.tid(), listed[0], threads):
        c = candidate_at(near, some, entry)
        v = candidate_ids[c]
        kind = candidate_kind[c]
        xi = offset(v, cloth_count, sizes)
        if candidate_distance[c] > xi + sizes.d_hat:
            continue
        x0 = x[v[0]]
        x1 = x[v[1]]
        x2 = x[v[2]]
        x3 = x[v[3]]
        lam = stencil_weights(kind, x0, x1, x2, x3)
        difference = stencil_vector(lam, x0, x1, x2, x3)
        d = wp.length(difference)
        candidate_distance[c] = d
        g_hat = sizes.d_hat
        cloth_vertices = float(0.0)
        cloth_area = float(0.0)
        touches_body = bool(False)
        reach = float(1.0)
        for k in range(4):
            if v[k] < cloth_count:
                cloth_vertices += 1.0
                cloth_area += area[v[k]]
                reach = wp.min(reach, reach_self[v[k]])
            else:
                touches_body = True
        eps = model.eps_body
        if not touches_body:
            if same_garment(v, sizes):
                g_hat = wp.min(g_hat, reach - xi)
            eps = model.eps_self
        g = d - xi
        if g >= g_hat:
            continue
        share = share_of_stencil(kind, v, lam, difference, x, starts, corners)
        if share == 0.0:
            continue
        wp.atomic_min(smallest_gap_out, wp.where(touches_body, 0, 1), g)
        if g <= 0.0:
            wp.atomic_add(counters_out, 1, 1)
        slot = next_slot(counters_out, 0)
        if slot >= ids_out.shape[0]:
            continue
        floor = GAP_FLOOR * wp.min(xi, g_hat)
        # a patch of cloth meets several stencils: a third of its vertices' area goes to each
        kappa = model.pressure_stiffness * cloth_area / (3.0 * cloth_vertices)
        e = share
        if kind == 1:
            e *= mollifier(wp.length_sq(wp.cross(x1 - x0, x3 - x2)), eps)
        ids_out[slot] = v
        lam_out[slot] = lam
        normal_out[slot] = wp.normalize(difference)
        slope_out[slot] = e * kappa * barrier_gradient(g, g_hat, floor)
        curvature_out[slot] = e * kappa * barrier_curvature(g, g_hat, floor)
        energy_out[slot] = e * kappa * barrier(g, g_hat, floor)
        gap_out[slot] = wp.vec3(g, g_hat, floor)


@wp.kernel
def add_gradient_kernel(
    counters: wp.array(dtype=wp.int32),
    ids: wp.array(dtype=wp.vec4i),
    lam: wp.array(dtype=wp.vec4),
    normal: wp.array(dtype=wp.vec3),
    slope: wp.array(dtype=wp.float32),
    curvature: wp.array(dtype=wp.float32),
    x_ref: wp.array(dtype=wp.vec3),
    x: wp.array(dtype=wp.vec3),
    gradient_out: wp.array(dtype=wp.vec3),
    whole: wp.array(dtype=wp.int64),
):
    """Gradient at x of the quadratic model made at x_ref; at x = x_ref that of the potential itself.

    The model of a one-sided force is kept one-sided: where it would pull, it is silent.
    """
    c = wp.tid()
    if c >= counters[0]:
        return
    v = ids[c]
    w = lam[c]
    n = normal[c]
    moved = float(0.0)
    for k in range(4):
        moved += w[k] * wp.dot(n, x[v[k]] - x_ref[v[k]])
    f = wp.min(slope[c] + curvature[c] * moved, 0.0) * n
    for k in range(4):
        if v[k] < gradient_out.shape[0] and w[k] != 0.0:
            add(gradient_out, whole, v[k], w[k] * f)


@wp.kernel
def add_product_kernel(
    counters: wp.array(dtype=wp.int32),
    ids: wp.array(dtype=wp.vec4i),
    lam: wp.array(dtype=wp.vec4),
    normal: wp.array(dtype=wp.vec3),
    curvature: wp.array(dtype=wp.float32),
    beside: wp.array(dtype=wp.mat33),
    p: wp.array(dtype=wp.vec3),
    product_out: wp.array(dtype=wp.vec3),
    whole: wp.array(dtype=wp.int64),
):
    """product += C p"""
    c = wp.tid()
    if c >= counters[0]:
        return
    v = ids[c]
    w = lam[c]
    n = normal[c]
    u = wp.vec3()
    for k in range(4):
        u += w[k] * p[v[k]]
    f = (curvature[c] * wp.dot(n, u)) * n + beside[c] * u
    for k in range(4):
        if v[k] < product_out.shape[0] and w[k] != 0.0:
            add(product_out, whole, v[k], w[k] * f)


@wp.kernel
def add_diagonal_kernel(
    counters: wp.array(dtype=wp.int32),
    ids: wp.array(dtype=wp.vec4i),
    lam: wp.array(dtype=wp.vec4),
    normal: wp.array(dtype=wp.vec3),
    curvature: wp.array(dtype=wp.float32),
    beside: wp.array(dtype=wp.mat33),
    blocks_out: wp.array(dtype=wp.mat33),
    whole: wp.array(dtype=wp.int64),
):
    """Adds each pair's 3x3 diagonal blocks."""
    c = wp.tid()
    if c >= counters[0]:
        return
    v = ids[c]
    own = curvature[c] * wp.outer(normal[c], normal[c]) + beside[c]
    for k in range(4):
        if lam[c][k] != 0.0:
            add_matrix(blocks_out, whole, v[k], lam[c][k] * lam[c][k] * own)


@dataclass(frozen=True)
class ContactParameters:
    """What turns a candidate into a pair: sizes, stiffness, area per cloth vertex, activation near fine triangles."""

    cloth_count: int
    sizes: ContactSizes
    model: ContactModel
    area: wp.array
    reach_self: wp.array
    fans: Fans


def collect(
    pairs: ContactPairs, candidates: Candidates, parameters: ContactParameters, x: wp.array, near: bool = False
) -> None:
    """Rebuild `pairs` from the candidates within reach at x; grows it when full, drops nothing.

    With `near`, only the near list is looked at; it must have been made for the move to x.
    The candidates' distances are lower bounds at x; those that are looked at become exact. In a graph nothing can grow:
    who launched it must look whether the first counter is above the capacity. Where candidates are idle nobody waits
    for the device.
    """
    while True:
        look_for(pairs, candidates, parameters, x, near)
        if candidates.idle:
            pairs.size, pairs.overlapping = 0, 0
            return
        if pairs.cover_in_graph():
            return
        found = pairs.read_size()
        if found <= pairs.capacity:
            return
        pairs.make_room(found)


def look_for(
    pairs: ContactPairs, candidates: Candidates, parameters: ContactParameters, x: wp.array, near: bool = False
) -> None:
    """The same, but that `pairs` is not grown and does not know its size: its counters have to be read for that."""
    count, entries = candidates.entries(near)
    clear(pairs.counters)
    pairs.smallest_gap.fill_(parameters.sizes.d_hat)
    launch(
        collect_kernel,
        count,
        [
            *entries,
            candidates.ids,
            candidates.kind,
            parameters.cloth_count,
            parameters.sizes,
            parameters.model,
            parameters.area,
            parameters.reach_self,
            parameters.fans.starts,
            parameters.fans.corners,
            x,
        ],
        [
            candidates.distance,
            pairs.ids,
            pairs.lam,
            pairs.normal,
            pairs.slope,
            pairs.curvature,
            pairs.energy,
            pairs.gap,
            pairs.counters,
            pairs.smallest_gap,
        ],
        device=x.device,
    )


def add_gradient(
    pairs: ContactPairs, x_ref: wp.array, x: wp.array, gradient_out: wp.array, sums: OrderFreeSums
) -> None:
    """gradient += gradient at x of the model of the contact potential made at x_ref [N], of as many vertices as
    `gradient_out` is long, once `sums` settle there."""
    launch(
        add_gradient_kernel,
        pairs.size,
        [pairs.counters, pairs.ids, pairs.lam, pairs.normal, pairs.slope, pairs.curvature, x_ref, x],
        [gradient_out, sums.vectors],
        device=x.device,
    )


def add_product(pairs: ContactPairs, p: wp.array, product_out: wp.array, sums: OrderFreeSums) -> None:
    """product += C p, block (i, j) of a pair's C being lam_i lam_j (e kappa b'' n n^T + `beside`); of as many vertices
    as `product_out` is long."""
    launch(
        add_product_kernel,
        pairs.size,
        [pairs.counters, pairs.ids, pairs.lam, pairs.normal, pairs.curvature, pairs.beside, p],
        [product_out, sums.vectors],
        device=p.device,
    )
    sums.settle(product_out)


def add_diagonal(pairs: ContactPairs, blocks_out: wp.array, sums: OrderFreeSums) -> None:
    """blocks += the 3x3 diagonal blocks of C."""
    launch(
        add_diagonal_kernel,
        pairs.size,
        [pairs.counters, pairs.ids, pairs.lam, pairs.normal, pairs.curvature, pairs.beside],
        [blocks_out, sums.blocks],
        device=blocks_out.device,
    )
    sums.settle_blocks(blocks_out)
