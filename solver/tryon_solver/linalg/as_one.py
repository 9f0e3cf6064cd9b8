"""The total force and torque that conjugate gradients leave behind when they are cut short, met by moving each piece of
cloth as one.

Inner forces have no total, so whatever total is left is momentum that comes from nowhere: a budget of a few iterations
stopped a tube in mid-air, and a sheet that turned on a floor. So the solution p of A p = -g gets the best of all
uniform moves c of each piece, and of its turns w,

    u_i = c + w x r_i,   r_i = x_i - x_0:   U^T A U (c, w) = U^T r,   r = -g - A p,

a coarse level of six unknowns a piece, solved in float64. Rows of the cloth's matrices sum to zero, so uniform moves
meet the diagonal alone, and each pair's 3x3 block by the square of its weights' sum over the piece; turns meet the
matrices as well (turning.py). Where inertia alone resists, no total is left; on a floor none along it, however stiff
contact is across. One step along r's total, as long as is best, left cloth that slides down a slope what it had across
the slope for its length, and stopped it; so did the one turn that diagonal and pairs find best.

One piece's six are solved for at once. Pieces that touch couple through the pairs between them, and are solved for
together, by conjugate gradients to their end with each piece's own solution as preconditioner: where none touch, the
first iteration is the last. One iteration alone, which is each by itself and one length for all, stopped sheets that
slid while they stuck to each other; one move of all together took a sheet at rest along that nothing touched.

A piece that contact holds in every direction, as on a body, is not turned: it goes where that lets it, and what is
left is contact's that has not come to an end. Two balloons around a ball were turned to and fro by a centimetre. Nor is
cloth of over MOST_PIECES, which moves as one altogether. Ours.
"""

from __future__ import annotations

import warp as wp

from tryon_solver.linalg.launch import launch
from tryon_solver.linalg.paired_matrix import PairedMatrix
from tryon_solver.linalg.pcg import ConjugateGradients
from tryon_solver.linalg.turning import (
    ACROSS,
    BACK,
    BOTH,
    LEFT,
    MOVES,
    SUMS,
    TURNS,
    AsOne,
    in_blocks,
    origin_of,
    sum_up_as_one,
    turned,
)

wp.set_module_options({"enable_backward": False})

SMALL = wp.constant(wp.float64(1e-4))  # an angle whose square is nothing beside 1
ENCLOSED = wp.constant(wp.float64(0.02))  # of its mean stiffness cubed; 1 where that is the same in all directions
FLAT = wp.constant(wp.float64(1e-9))  # of its mean stiffness cubed: what has less turns about a line for nothing
SOLVED = wp.constant(wp.float64(1e-16))  # of <r, D^-1 r> at first: where pieces together are at their end

MOVE = wp.constant(0)  # places in `AsOne.found`
TURN = wp.constant(1)
CENTRE = wp.constant(2)
RESIDUAL = wp.constant(0)  # places in `AsOne.solving`, each of a force [N] or move [m], and of a torque [N m] or turn
PRECONDITIONED = wp.constant(2)
DIRECTION = wp.constant(4)
PRODUCT = wp.constant(6)


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
def add_parts_kernel(parts: wp.array3d(dtype=wp.mat33d), count: int, threads: int):
    """One block for each n: parts[n, 0, k] = the sum of the first `count` of each k, in a fixed order"""
    n = wp.tid() // threads
    thread = wp.tid() % threads
    for k in range(SUMS):
        total = wp.mat33d()
        for part in range(thread, count, threads):
            total += parts[n, part, k]
        whole = wp.tile_sum(wp.tile(total, preserve_type=True))[0]
        if thread == 0:
            parts[n, 0, k] = whole


@wp.func
def take_piece(of_cloth: wp.array3d(dtype=wp.mat33d), of_pairs: wp.array3d(dtype=wp.mat33d), p: int):
    """In `of_cloth` add to what vertices of piece p resist what its pairs do."""
    half = wp.float64(0.5) * of_cloth[p, 0, TURNS]  # rounded, and not symmetric
    of_cloth[p, 0, MOVES] = of_cloth[p, 0, MOVES] + of_pairs[p, 0, MOVES]
    of_cloth[p, 0, BOTH] = turned(row(of_cloth[p, 0, LEFT], 0)) + of_pairs[p, 0, BOTH]
    of_cloth[p, 0, TURNS] = half + wp.transpose(half) + of_pairs[p, 0, TURNS]


@wp.func
def precondition(
    whole: wp.array3d(dtype=wp.mat33d),
    of_pairs: wp.array3d(dtype=wp.mat33d),
    turns: int,
    p: int,
    solving: wp.array2d(dtype=wp.vec3d),
):
    """The best move and turn of piece p by itself for its `solving` RESIDUAL."""
    force = solving[p, RESIDUAL]
    moves = whole[p, 0, MOVES]
    both = whole[p, 0, BOTH]
    turn = wp.vec3d()
    if turns == 1 and not encloses(of_pairs[p, 0, ACROSS]):
        turn = best_turn(moves, both, whole[p, 0, TURNS], force, solving[p, RESIDUAL + 1])
    solving[p, PRECONDITIONED] = wp.inverse(moves) * (force - both * turn)
    solving[p, PRECONDITIONED + 1] = turn


@wp.func
def multiply(
    whole: wp.array3d(dtype=wp.mat33d),
    of_pairs: wp.array3d(dtype=wp.mat33d),
    couples: wp.array(dtype=wp.vec2i),
    solving: wp.array2d(dtype=wp.vec3d),
):
    """PRODUCT = U^T A U DIRECTION"""
    pieces = whole.shape[0]
    for p in range(pieces):
        c = solving[p, DIRECTION]
        w = solving[p, DIRECTION + 1]
        both = whole[p, 0, BOTH]
        solving[p, PRODUCT] = whole[p, 0, MOVES] * c + both * w
        solving[p, PRODUCT + 1] = wp.transpose(both) * c + whole[p, 0, TURNS] * w
    for n in range(pieces, couples.shape[0]):
        moves = of_pairs[n, 0, MOVES]
        if wp.trace(moves) != wp.float64(0.0) or wp.trace(of_pairs[n, 0, TURNS]) != wp.float64(0.0):
            p = couples[n][0]
            q = couples[n][1]
            both = of_pairs[n, 0, BOTH]
            back = of_pairs[n, 0, BACK]
            turns = of_pairs[n, 0, TURNS]
            c = solving[q, DIRECTION]
            w = solving[q, DIRECTION + 1]
            solving[p, PRODUCT] = solving[p, PRODUCT] + moves * c + both * w
            solving[p, PRODUCT + 1] = solving[p, PRODUCT + 1] + back * c + turns * w
            c = solving[p, DIRECTION]
            w = solving[p, DIRECTION + 1]
            solving[q, PRODUCT] = solving[q, PRODUCT] + wp.transpose(moves) * c + wp.transpose(back) * w
            other = wp.transpose(both) * c + wp.transpose(turns) * w
            solving[q, PRODUCT + 1] = solving[q, PRODUCT + 1] + other


@wp.func
def product_of(solving: wp.array2d(dtype=wp.vec3d), a: int, b: int) -> wp.float64:
    """<a, b> of two places."""
    total = wp.float64(0.0)
    for p in range(solving.shape[0]):
        total += wp.dot(solving[p, a], solving[p, b]) + wp.dot(solving[p, a + 1], solving[p, b + 1])
    return total


@wp.kernel
def find_best_kernel(
    of_cloth: wp.array3d(dtype=wp.mat33d),
    of_pairs: wp.array3d(dtype=wp.mat33d),
    couples: wp.array(dtype=wp.vec2i),
    turns: int,
    solving: wp.array2d(dtype=wp.vec3d),
    found_out: wp.array2d(dtype=wp.vec3d),
):
    """(U^T A U)^-1 U^T r: one piece's by elimination, of several by conjugate gradients."""
    pieces = found_out.shape[0]
    for p in range(pieces):
        left = of_cloth[p, 0, LEFT]
        found_out[p, CENTRE] = row(left, 0) / of_cloth[p, 0, MOVES][0, 0]
        take_piece(of_cloth, of_pairs, p)
        solving[p, RESIDUAL] = row(left, 1)
        solving[p, RESIDUAL + 1] = row(left, 2)
        precondition(of_cloth, of_pairs, turns, p, solving)
        for k in range(2):
            found_out[p, k] = wp.where(pieces == 1, solving[p, PRECONDITIONED + k], wp.vec3d())
            solving[p, DIRECTION + k] = solving[p, PRECONDITIONED + k]
    squared = product_of(solving, RESIDUAL, PRECONDITIONED)
    enough = SOLVED * squared
    left_over = wp.where(pieces == 1, 0, 6 * pieces)  # iterations, as many as unknowns
    while left_over > 0 and squared > enough:
        multiply(of_cloth, of_pairs, couples, solving)
        curvature = product_of(solving, DIRECTION, PRODUCT)
        step = wp.float64(0.0)
        if curvature > wp.float64(0.0):
            step = squared / curvature
        for p in range(pieces):
            for k in range(2):
                found_out[p, k] = found_out[p, k] + step * solving[p, DIRECTION + k]
                solving[p, RESIDUAL + k] = solving[p, RESIDUAL + k] - step * solving[p, PRODUCT + k]
            precondition(of_cloth, of_pairs, turns, p, solving)
        before = squared
        squared = product_of(solving, RESIDUAL, PRECONDITIONED)
        for p in range(pieces):
            for k in range(2):
                on = (squared / before) * solving[p, DIRECTION + k]
                solving[p, DIRECTION + k] = solving[p, PRECONDITIONED + k] + on
        left_over = left_over - 1
    for p in range(pieces):
        found_out[p, MOVE] = found_out[p, MOVE] + wp.cross(found_out[p, TURN], found_out[p, CENTRE])


@wp.kernel
def add_move_kernel(
    found: wp.array2d(dtype=wp.vec3d),
    x: wp.array(dtype=wp.vec3),
    of_vertex: wp.array(dtype=wp.int32),
    ordered: wp.array(dtype=wp.int32),
    starts: wp.array(dtype=wp.int32),
    solution: wp.array(dtype=wp.vec3),
):
    """solution += c + w x r, but that the turn goes round the centre, and not straight ahead"""
    i = wp.tid()
    p = of_vertex[i]
    r = wp.vec3d(x[i]) - origin_of(x, ordered, starts, p) - found[p, CENTRE]
    w = found[p, TURN]
    angle = wp.length(w)
    along = wp.cross(w, r)
    ahead = wp.float64(1.0)
    inward = wp.float64(0.5)
    if angle > SMALL:
        ahead = wp.sin(angle) / angle
        inward = (wp.float64(1.0) - wp.cos(angle)) / (angle * angle)
    solution[i] = solution[i] + wp.vec3(found[p, MOVE] + ahead * along + inward * wp.cross(w, along))


def move_as_one(
    cg: ConjugateGradients,
    matrix: PairedMatrix,
    diagonal: wp.array,
    x: wp.array,
    scratch: AsOne,
    solution: wp.array,
) -> None:
    """Improve what `pcg.solve` just found of `matrix`, of cloth at x (A,) m, by the best common move and turn of each
    of the pieces that the `scratch` is of.

    `diagonal` (A,) float32 N/m is here without what holds single vertices. The residual that `cg` keeps is not renewed.
    """
    device, pieces = wp.get_device(solution.device), scratch.pieces
    of_cloth, of_pairs = sum_up_as_one(matrix, diagonal, cg.residual, x, scratch)
    threads, block = in_blocks(1, 1, device)
    for parts, count in ((scratch.of_cloth, of_cloth), (scratch.of_pairs, of_pairs)):
        if count > 1:
            many = threads * parts.shape[0]
            launch(add_parts_kernel, many, [parts, count, threads], [], block_dim=block, device=device)
    sums = [scratch.of_cloth, scratch.of_pairs, scratch.couples, int(pieces.apart), scratch.solving]
    launch(find_best_kernel, 1, sums, [scratch.found], device=device)
    where = [scratch.found, x, pieces.of_vertex, pieces.ordered, pieces.starts]
    launch(add_move_kernel, pieces.vertices, where, [solution], device=device)
