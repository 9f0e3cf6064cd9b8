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

Cloth of several pieces is not turned, since each has a turn of its own: a sheet at rest was set turning by one that it
never touched. Nor is cloth that contact holds in every direction, as on a body: it goes where that lets it, and what
is left is contact's that has not come to an end. Two balloons around a ball were turned to and fro by a centimetre.
Ours.
"""

from __future__ import annotations

import warp as wp

from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.paired_matrix import PairedMatrix
from tryon_solver.linalg.pcg import ConjugateGradients
from tryon_solver.linalg.turning import (
    ACROSS,
    BOTH,
    LEFT,
    MOVES,
    SUMS,
    TURNS,
    AsOne,
    in_blocks,
    sum_up_as_one,
    turned,
)

wp.set_module_options({"enable_backward": False})

SMALL = wp.constant(wp.float64(1e-4))  # an angle whose square is nothing beside 1
ENCLOSED = wp.constant(wp.float64(0.02))  # of its mean stiffness cubed; 1 where that is the same in all directions
FLAT = wp.constant(wp.float64(1e-9))  # of its mean stiffness cubed: what has less turns about a line for nothing

MOVE = wp.constant(0)  # places in `AsOne.found`
TURN = wp.constant(1)
CENTRE = wp.constant(2)


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


@wp.func
def row(values: wp.mat33d, n: int) -> wp.vec3d:
    return wp.vec3d(values[n, 0], values[n, 1], values[n, 2])


@wp.kernel
def add_parts_kernel(parts: wp.array2d(dtype=wp.mat33d), count: int):
    """A block for each k: parts[0, k] = the sum of the first `count`, in a fixed order"""
    stride = wp.block_dim()
    k = wp.tid() // stride
    total = wp.mat33d()
    for n in range(wp.tid() % stride, count, stride):
        total += parts[n, k]
    whole = wp.tile_sum(wp.tile(total, preserve_type=True))[0]
    if wp.tid() % stride == 0:
        parts[0, k] = whole


@wp.kernel
def find_best_kernel(
    of_cloth: wp.array2d(dtype=wp.mat33d),
    of_pairs: wp.array2d(dtype=wp.mat33d),
    turns: int,
    found_out: wp.array(dtype=wp.vec3d),
):
    """(U^T A U)^-1 U^T r"""
    left = of_cloth[0, LEFT]
    first = row(left, 0)
    force = row(left, 1)
    centre = first / of_cloth[0, MOVES][0, 0]
    moves = of_cloth[0, MOVES] + of_pairs[0, MOVES]
    both = turned(first) + of_pairs[0, BOTH]
    half = wp.float64(0.5) * of_cloth[0, TURNS]  # rounded, and not symmetric
    turn = wp.vec3d()
    if turns == 1 and not encloses(of_pairs[0, ACROSS]):
        turn = best_turn(moves, both, half + wp.transpose(half) + of_pairs[0, TURNS], force, row(left, 2))
    found_out[MOVE] = wp.inverse(moves) * (force - both * turn) + wp.cross(turn, centre)
    found_out[TURN] = turn
    found_out[CENTRE] = centre


@wp.kernel
def add_move_kernel(found: wp.array(dtype=wp.vec3d), x: wp.array(dtype=wp.vec3), solution: wp.array(dtype=wp.vec3)):
    """solution += c + w x r, but that the turn goes round the centre, and not straight ahead"""
    i = wp.tid()
    r = wp.vec3d(x[i]) - wp.vec3d(x[0]) - found[CENTRE]
    w = found[TURN]
    angle = wp.length(w)
    along = wp.cross(w, r)
    ahead = wp.float64(1.0)
    inward = wp.float64(0.5)
    if angle > SMALL:
        ahead = wp.sin(angle) / angle
        inward = (wp.float64(1.0) - wp.cos(angle)) / (angle * angle)
    solution[i] = solution[i] + wp.vec3(found[MOVE] + ahead * along + inward * wp.cross(w, along))


def move_as_one(
    cg: ConjugateGradients,
    matrix: PairedMatrix,
    x: wp.array,
    moving: int,
    turns: bool,
    scratch: AsOne,
    solution: wp.array,
) -> None:
    """Improve what `pcg.solve` just found of `matrix`, of cloth at x (A,) m, by the best common move of the first
    `moving` unknowns, and if it `turns`, turn.

    What holds single unknowns is left out of what resists. The residual that `cg` keeps is not renewed.
    """
    device = wp.get_device(solution.device)
    of_cloth, of_pairs = sum_up_as_one(matrix, cg.residual, x, moving, scratch)
    _, block = in_blocks(1, device)
    for parts, count in ((scratch.of_cloth, of_cloth), (scratch.of_pairs, of_pairs)):
        if count > 1:
            launch(add_parts_kernel, int(SUMS) * block, [parts, count], [], block_dim=block, device=device)
    sums = [scratch.of_cloth, scratch.of_pairs, int(turns)]
    launch(find_best_kernel, 1, sums, [scratch.found], device=device)
    launch(add_move_kernel, moving, [scratch.found, x], [solution], device=device)
