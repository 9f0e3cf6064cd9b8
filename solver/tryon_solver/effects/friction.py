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

import numpy as np
import warp as wp

from tryon_solver.contact.barrier import barrier_gradient
from tryon_solver.contact.pairs import ContactPairs
from tryon_solver.effects.base import BuildContext
from tryon_solver.effects.presliding import recall
from tryon_solver.effects.slip import FIRST_ROOM, SlipOfPairs, hold, slip
from tryon_solver.linalg.launch import launch
from tryon_solver.materials.fabric import between_fabrics
from tryon_solver.plan import Contribution
from tryon_solver.scene import Friction, Scene
from tryon_solver.state import State

wp.set_module_options({"enable_backward": False})

SETTLED = 0.5  # share that the normal force of a pair keeps, or kept, from an iteration to the next to be relied on


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
    before = wp.vec3()
    if settled:
        before = slip(v, lam[c], normal[c], given, x_before, x_start)
    weight, along = hold(u, before, coulomb, presliding, kinetic, settled)
    weight_out[c] = weight
    along_out[c] = along


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


def bind(spec: Friction, context: BuildContext) -> Contribution | None:
    """None when all is frictionless."""
    device = context.device
    table = coefficients_of(spec, context.scene)
    if not table.any():
        return None
    material: wp.array = wp.array(materials_of(spec, context.scene), dtype=wp.int32, device=device)
    coefficients: wp.array = wp.array(table, dtype=wp.vec2, device=device)
    held = SlipOfPairs(FIRST_ROOM, spec.presliding, context.sums, device)

    def prepare(pairs: ContactPairs, state: State, x: wp.array, x_before: wp.array | None) -> None:
        held.make_room(pairs.capacity)
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

    values = {"coefficients": coefficients}
    return Contribution("friction", start_step=held.begin, contact=held.term(prepare), values=values)
