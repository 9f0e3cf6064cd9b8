"""The total force and torque that conjugate gradients leave behind when they are cut short, met by moving all of the
cloth as one.

Inner forces have no total, so whatever total is left is momentum that comes from nowhere: a budget of a few iterations
stopped a tube in mid-air, and a sheet that turned on a floor. So the solution p of A p = -g gets the best of all
uniform moves c of the cloth, and of its turns w,

    u_i = c + w x r_i,   r_i = x_i - x_0:   U^T A U (c, w) = U^T r,   r = -g - A p,

a coarse level of six unknowns, solved exactly, in float64. Rows of the cloth's matrices sum to zero, so uniform moves
meet the diagonal alone, and each pair's 3x3 block by the square of its weights' sum over the cloth; turns meet the
matrices as well (turning.py). Where inertia alone resists, no total is left; on a floor none along it, however stiff
contact is across. One step along r's total, as long as is best, left cloth that slides down a slope what it had across
the slope for its length, and stopped it; so did the one turn that diagonal and pairs find best.

Cloth that contact holds in every direction, as on a body, is not turned: it goes where that lets it, and what is left
is contact's that has not come to an end. Two balloons around a ball were turned to and fro by a centimetre. Ours.
"""

from __future__ import annotations

import warp as wp

from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.one_block import launch_one_block
from tryon_solver.linalg.paired_matrix import PairedMatrix, pair_count
from tryon_solver.linalg.pcg import ConjugateGradients
from tryon_solver.linalg.turning import AsOne, resist_turning

wp.set_module_options({"enable_backward": False})

QUANTA = wp.constant(wp.float64(2.0**20))  # in 1 N/m, N or N m: quanta of 1e-6, and exact sums up to 8.6e9
SMALL = wp.constant(wp.float64(1e-4))  # an angle whose square is nothing beside 1
ENCLOSED = wp.constant(wp.float64(0.02))  # of its mean stiffness cubed; 1 where that is the same in all directions
FLAT = wp.constant(wp.float64(1e-9))  # of its mean stiffness cubed: what has less turns about a line for nothing

MOVES = wp.constant(0)  # places in `AsOne.resistance`: what uniform moves meet,
BOTH = wp.constant(1)  # uniform moves of turns,
TURNS = wp.constant(2)  # and turns
FORCE = wp.constant(0)  # places in `AsOne.left`: force and move,
TORQUE = wp.constant(1)  # torque and turn,
CENTRE = wp.constant(2)  # and what is turned about: of the diagonal, from x_0


@wp.func
def turned(r: wp.vec3d) -> wp.mat33d:
    """S(r), S(r) w = w x r"""
    return wp.skew(-r)


@wp.func
def in_quanta(values: wp.mat33d) -> wp.mat33d:
    """Rounded to whole quanta."""
    rounded = wp.mat33d()
    for n in range(3):
        for k in range(3):
            rounded[n, k] = wp.rint(values[n, k] * QUANTA) / QUANTA
    return rounded


@wp.kernel
def add_diagonal_kernel(
    diagonal: wp.array(dtype=wp.float32),
    residual: wp.array(dtype=wp.vec3),
    x: wp.array(dtype=wp.vec3),
    moving: int,
    threads: int,
    resistance_out: wp.array(dtype=wp.mat33d),
    left_out: wp.array(dtype=wp.vec3d),
):
    """What the diagonal of the first `moving` resists, and force and torque of the residual."""
    origin = wp.vec3d(x[0])
    total = wp.float64(0.0)
    turns = wp.mat33d()
    vectors = wp.mat33d()  # rows: the diagonal times r, the residual, its torque
    for i in range(wp.tid(), moving, threads):
        d = wp.float64(diagonal[i])
        r = wp.vec3d(x[i]) - origin
        f = wp.vec3d(residual[i])
        torque = wp.cross(r, f)
        total += d
        turns += d * (wp.dot(r, r) * wp.identity(n=3, dtype=wp.float64) - wp.outer(r, r))
        for k in range(3):
            vectors[0, k] = vectors[0, k] + d * r[k]
            vectors[1, k] = vectors[1, k] + f[k]
            vectors[2, k] = vectors[2, k] + torque[k]
    of_all = wp.tile_sum(wp.tile(total))[0]
    turns_of_all = wp.tile_sum(wp.tile(turns, preserve_type=True))[0]
    vectors_of_all = wp.tile_sum(wp.tile(vectors, preserve_type=True))[0]
    if wp.tid() == 0:
        first = wp.vec3d(vectors_of_all[0, 0], vectors_of_all[0, 1], vectors_of_all[0, 2])
        resistance_out[MOVES] = of_all * wp.identity(n=3, dtype=wp.float64)
        resistance_out[BOTH] = turned(first)
        resistance_out[TURNS] = turns_of_all
        left_out[CENTRE] = first / of_all
        left_out[FORCE] = wp.vec3d(vectors_of_all[1, 0], vectors_of_all[1, 1], vectors_of_all[1, 2])
        left_out[TORQUE] = wp.vec3d(vectors_of_all[2, 0], vectors_of_all[2, 1], vectors_of_all[2, 2])


@wp.func
def encloses(across: wp.mat33d) -> bool:
    """Does contact that resists so hold the cloth against moves in every direction?"""
    mean = wp.trace(across) / wp.float64(3.0)
    return wp.determinant(across) > ENCLOSED * mean * mean * mean


@wp.func
def best_turn(moves: wp.mat33d, both: wp.mat33d, turns: wp.mat33d, force: wp.vec3d, torque: wp.vec3d) -> wp.vec3d:
    """The turn w that is best while uniform moves are what is best beside it."""
    through = wp.transpose(both) * wp.inverse(moves)
    meets = turns - through * both
    mean = wp.trace(meets) / wp.float64(3.0)
    w = wp.vec3d()
    if wp.determinant(meets) > FLAT * mean * mean * mean:
        w = wp.inverse(meets) * (torque - through * force)
    return w


@wp.kernel
def add_pairs_kernel(
    m: PairedMatrix,
    x: wp.array(dtype=wp.vec3),
    moving: int,
    parts: wp.array(dtype=wp.mat33d),
    part_count: int,
    threads: int,
    resistance: wp.array(dtype=wp.mat33d),
    left: wp.array(dtype=wp.vec3d),
):
    """Add C = curvature n n^T + beside of each pair: with s the sum of its weights over the first `moving` and b that
    of lam_k r_k, the pair meets s c + w x b. Then add the `parts` of what turns meet, and find the best of all.

    On a GPU pairs are listed in any order, and are rounded so that float64 adds them exactly."""
    origin = wp.vec3d(x[0])
    moves = wp.mat33d()
    both = wp.mat33d()
    turns = wp.mat33d()
    across = wp.mat33d()
    for c in range(wp.tid(), pair_count(m), threads):
        s = wp.float64(0.0)
        b = wp.vec3d()
        for k in range(4):
            i = m.ids[c][k]
            if i < moving:
                lam = wp.float64(m.lam[c][k])
                s += lam
                b += lam * (wp.vec3d(x[i]) - origin)
        n = wp.vec3d(m.normal[c])
        normal = wp.float64(m.curvature[c]) * wp.outer(n, n)
        own = normal + wp.mat33d(m.beside[c])
        own_across = s * s * normal
        arm = turned(b)
        met = own * arm
        own_moves = s * s * own
        own_both = s * met
        own_turns = wp.transpose(arm) * met
        if threads > 1:
            own_moves = in_quanta(own_moves)
            own_both = in_quanta(own_both)
            own_turns = in_quanta(own_turns)
            own_across = in_quanta(own_across)
        moves += own_moves
        across += own_across
        both += own_both
        turns += own_turns
    of_rows = wp.mat33d()
    for k in range(wp.tid(), part_count, threads):
        of_rows += parts[k]
    all_rows = wp.tile_sum(wp.tile(of_rows, preserve_type=True))[0]
    all_moves = wp.tile_sum(wp.tile(moves, preserve_type=True))[0]
    all_both = wp.tile_sum(wp.tile(both, preserve_type=True))[0]
    all_turns = wp.tile_sum(wp.tile(turns, preserve_type=True))[0]
    all_across = wp.tile_sum(wp.tile(across, preserve_type=True))[0]
    if wp.tid() == 0:
        resistance[MOVES] = resistance[MOVES] + all_moves
        resistance[BOTH] = resistance[BOTH] + all_both
        half = wp.float64(0.5) * all_rows  # rounded, and not symmetric
        resistance[TURNS] = resistance[TURNS] + all_turns + half + wp.transpose(half)
        w = wp.vec3d()
        if not encloses(all_across):
            w = best_turn(resistance[MOVES], resistance[BOTH], resistance[TURNS], left[FORCE], left[TORQUE])
        move = wp.inverse(resistance[MOVES]) * (left[FORCE] - resistance[BOTH] * w)
        left[FORCE] = move + wp.cross(w, left[CENTRE])
        left[TORQUE] = w


@wp.kernel
def add_move_kernel(left: wp.array(dtype=wp.vec3d), x: wp.array(dtype=wp.vec3), solution: wp.array(dtype=wp.vec3)):
    """solution += c + w x r, but that the turn goes round the centre, and not straight ahead"""
    i = wp.tid()
    r = wp.vec3d(x[i]) - wp.vec3d(x[0]) - left[CENTRE]
    w = left[TORQUE]
    angle = wp.length(w)
    along = wp.cross(w, r)
    ahead = wp.float64(1.0)
    inward = wp.float64(0.5)
    if angle > SMALL:
        ahead = wp.sin(angle) / angle
        inward = (wp.float64(1.0) - wp.cos(angle)) / (angle * angle)
    solution[i] = solution[i] + wp.vec3(left[FORCE] + ahead * along + inward * wp.cross(w, along))


def move_as_one(
    cg: ConjugateGradients,
    matrix: PairedMatrix,
    diagonal: wp.array,
    x: wp.array,
    moving: int,
    scratch: AsOne,
    solution: wp.array,
) -> None:
    """Improve what `pcg.solve` just found of `matrix`, of cloth at x (A,) m, by the best common move and turn of the
    first `moving` unknowns.

    `diagonal` (A,) float32 N/m is here without what holds single vertices. The residual that `cg` keeps is not renewed.
    """
    device, found = solution.device, (scratch.resistance, scratch.left)
    parts = resist_turning(matrix, x, moving, scratch)
    launch_one_block(add_diagonal_kernel, [diagonal, cg.residual, x, moving], found, device)
    launch_one_block(add_pairs_kernel, [matrix, x, moving, scratch.parts, parts], found, device)
    launch(add_move_kernel, moving, [scratch.left, x], [solution], device=device)
