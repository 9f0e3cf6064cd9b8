"""Conjugate gradients by all threads of a device, three kernels an iteration.

There an iteration's arithmetic is a microsecond or two, and what takes time is one launch waiting for the one before.
So p = z + b p is made where it is multiplied, rows and pairs are multiplied in one launch, and each launch leaves the
sum that the next one needs: a dot product is never a launch of its own. What a sum is added into has been cleared two
launches earlier, in a ring of four, and of the iteration's number each kernel has its own copy, written by the other.

Of the coarse level (aggregates.py) a block of threads has vertices of one aggregate alone and leaves their forces'
sum; in the next launch each aggregate has a block, which multiplies its rows of the inverse with all of these and
leaves the aggregate's move. Who reads a vertex's z adds it: a block that went through its vertices took 6.5 us for
4.8, of 20,000. (Added up by threads that meet at an aggregate's place the sums took three times as long as all else of
an iteration.)

What a thread reads lies side by side, or beside what its neighbours read at once: z, with the aggregate's number, and
the direction before of a vertex are sixteen bytes each in one sector of 32, and the blocks of a row are spread out
number by number, once for all iterations. (9 numbers of a block are 36 bytes, and a load of them by 32 threads goes to
36 sectors, nine times.)

Additions to one place wait for each other, those to a neighbouring one too. So a sum has as many places as it takes for
blocks of threads to seldom meet; what pairs add goes into `pulled`, a vector at once, of which there are several for
each vertex of the collision surface, since one can be in two hundred pairs. Who reads adds up.

Dot products are added in whole numbers, which come to the same in whatever order (order_free.py): as multiples of the
last <r, z> before them, however small these get. The first of all is added up in order by one block of threads. What
pairs add comes to the same in every run only where it goes into `pulled_whole`, number by number: a GPU adds four
floats in one operation and no whole numbers so, and an iteration takes two fifths longer.
"""

from __future__ import annotations

from collections.abc import Sequence

import warp as wp

from tryon_solver.linalg.aggregates import NOBODY, Aggregates
from tryon_solver.linalg.blocks import BLOCK, whole_blocks
from tryon_solver.linalg.in_fours import add_at_once, four_of, put_four, three_of
from tryon_solver.linalg.lanes import lanes_of, shares_of, sum_of_lanes
from tryon_solver.linalg.order_free import QUANTA, whole_of
from tryon_solver.linalg.paired_matrix import PairedMatrix, held_product, pair_count, pair_force

wp.set_module_options({"enable_backward": False})

TURNS = 5  # iterations between two looks at whether there is more to do

RING = wp.constant(4)
PLACES = wp.constant(8)  # of a sum in a ring
SQUARED = wp.constant(0)  # ring of <r, z>
CURVATURE = wp.constant(4)  # ring of <p, A p>
SUMS = wp.constant((CURVATURE + RING) * PLACES)  # places of both rings
BLOCK_SIZE = wp.constant(BLOCK)
COPIES = wp.constant(4)  # of what is pulled at a vertex beyond the cloth

TAKEN = wp.constant(0)  # iterations finished, for the multiplying kernel
NOW = wp.constant(1)  # the one that is multiplied, for the advancing kernel; -1: none
MORE = wp.constant(2)  # 1 while there is more to do


@wp.func
def whole_sum(sums: wp.array(dtype=wp.int64), ring: int, slot: int) -> float:
    """Of a sum's places, as a multiple of the <r, z> before."""
    total = wp.int64(0)
    for k in range(PLACES):
        total += sums[(ring + slot) * PLACES + k]
    return float(total) / QUANTA


@wp.func
def quanta_over(before: float) -> float:
    """What makes whole numbers of the parts of a dot product, `before` being the <r, z> before it."""
    if before > 0.0:
        return QUANTA / before
    return 0.0


@wp.func
def place_of(ring: int, slot: int, thread: int) -> int:
    """Where a block of threads adds to a sum."""
    return (ring + slot) * PLACES + (thread // BLOCK_SIZE) % PLACES


@wp.func
def direction_of(both: wp.array(dtype=wp.vec4), common: wp.array(dtype=wp.vec4), b: float, i: int) -> wp.vec3:
    """z + b p of vertex i, with its aggregate's move in z."""
    z = four_of(both, 2 * i)
    return wp.vec3(z[0], z[1], z[2]) + three_of(common, int(z[3])) + b * three_of(both, 2 * i + 1)


@wp.func
def neighbour(columns: wp.array2d(dtype=wp.int32), i: int, k: int) -> int:
    """The k-th of row i; beyond the row's end the row's own."""
    if k < columns.shape[1]:
        return columns[i, k]
    return i


@wp.func
def spread_block(spread: wp.array(dtype=wp.float32), i: int, k: int, width: int) -> wp.mat33:
    """Block k of row i, of `width` beside the one on the diagonal."""
    at = 9 * i * width + k
    return wp.mat33(
        spread[at],
        spread[at + width],
        spread[at + 2 * width],
        spread[at + 3 * width],
        spread[at + 4 * width],
        spread[at + 5 * width],
        spread[at + 6 * width],
        spread[at + 7 * width],
        spread[at + 8 * width],
    )


@wp.kernel
def spread_kernel(blocks: wp.array2d(dtype=wp.mat33), spread_out: wp.array(dtype=wp.float32)):
    """Number by number: of each row the first number of all blocks but the diagonal's, then the second, ..."""
    width = blocks.shape[1] - 1
    i = wp.tid() // width
    k = wp.tid() % width
    block = blocks[i, k + 1]
    for n in range(3):
        for m in range(3):
            spread_out[(9 * i + 3 * n + m) * width + k] = block[n, m]


@wp.kernel
def mark_kernel(m: PairedMatrix, threads: int, coupled_out: wp.array(dtype=wp.int32)):
    for c in range(wp.tid(), pair_count(m), threads):
        for k in range(4):
            coupled_out[m.ids[c][k]] = 1


@wp.func
def vertex_of(seats: wp.array(dtype=wp.int32), place: int, rows: int) -> int:
    """Whose turn it is: those with rows by their seats, the others after them; NOBODY in a free seat."""
    if place < seats.shape[0]:
        return seats[place]
    return rows + place - seats.shape[0]


@wp.func
def pool(seats: wp.array(dtype=wp.int32), thread: int, force: wp.vec3, pooled: wp.array(dtype=wp.vec3)):
    """Leave the sum of the forces of a block that has seats."""
    of_block = wp.tile_sum(wp.tile(force, preserve_type=True))[0]
    if thread % wp.block_dim() == 0 and thread < seats.shape[0]:
        pooled[thread // wp.block_dim()] = of_block


@wp.kernel
def start_kernel(
    m: PairedMatrix,
    inverse: wp.array(dtype=wp.mat33),
    gradient: wp.array(dtype=wp.vec3),
    coupled: wp.array(dtype=wp.int32),
    seats: wp.array(dtype=wp.int32),
    of: wp.array(dtype=wp.int32),
    nobody: int,
    threads: int,
    solution_out: wp.array(dtype=wp.vec3),
    residual_out: wp.array(dtype=wp.vec3),
    both_out: wp.array(dtype=wp.vec4),
    pulled_out: wp.array(dtype=wp.vec4),
    pulled_whole_out: wp.array(dtype=wp.int64),
    pooled_out: wp.array(dtype=wp.vec3),
    sums_out: wp.array(dtype=wp.int64),
    parts_out: wp.array(dtype=wp.float32),
    state_out: wp.array(dtype=wp.int32),
):
    """Each block leaves its parts of <g, D^-1 g>, and of the same over what is iterated on, in `parts_out`. `nobody` is
    the number of who is of no aggregate."""
    first = float(0.0)
    squared = float(0.0)
    rows = m.columns.shape[0]
    force = wp.vec3()
    for place in range(wp.tid(), seats.shape[0] + inverse.shape[0] - rows, threads):
        i = vertex_of(seats, place, rows)
        if i != NOBODY:
            r = -gradient[i]
            z = inverse[i] * r
            part = wp.dot(r, z)
            first += part
            number = nobody
            if i < rows:
                number = of[i]
            put_four(both_out, 2 * i + 1, wp.vec3(), 0.0)
            if i < rows or coupled[i] == 1:
                squared += part
                solution_out[i] = wp.vec3()
                residual_out[i] = r
                put_four(both_out, 2 * i, z, float(number))
                if i < rows:
                    force = r
            else:
                solution_out[i] = z
                residual_out[i] = wp.vec3()
                put_four(both_out, 2 * i, wp.vec3(), float(number))
    pool(seats, wp.tid(), force, pooled_out)
    for i in range(wp.tid(), pulled_out.shape[0], threads):
        pulled_out[i] = wp.vec4()
    for i in range(wp.tid(), pulled_whole_out.shape[0], threads):
        pulled_whole_out[i] = wp.int64(0)
    for i in range(wp.tid(), SUMS, threads):
        sums_out[i] = wp.int64(0)
    first_of_block = wp.tile_sum(wp.tile(first))[0]
    squared_of_block = wp.tile_sum(wp.tile(squared))[0]
    if wp.tid() % wp.block_dim() == 0:
        block = wp.tid() // wp.block_dim()
        parts_out[2 * block] = first_of_block
        parts_out[2 * block + 1] = squared_of_block
    if wp.tid() == 0:
        state_out[TAKEN] = 0
        state_out[MORE] = 1


@wp.kernel
def open_kernel(
    parts: wp.array(dtype=wp.float32),
    blocks: int,
    threads: int,
    first_out: wp.array(dtype=wp.float32),
    sums: wp.array(dtype=wp.int64),
):
    """One block: the first sums of all from their parts, in order."""
    first = float(0.0)
    squared = float(0.0)
    for k in range(wp.tid(), blocks, threads):
        first += parts[2 * k]
        squared += parts[2 * k + 1]
    whole_first = wp.tile_sum(wp.tile(first))[0]
    whole_squared = wp.tile_sum(wp.tile(squared))[0]
    if wp.tid() == 0:
        first_out[0] = whole_first
        sums[place_of(SQUARED, 0, 0)] = whole_of(whole_squared, quanta_over(whole_first))


@wp.func
def pooled_at(pooled: wp.array(dtype=wp.vec3), starts: wp.array(dtype=wp.int32), a: int) -> wp.vec3:
    """What the blocks of an aggregate left."""
    total = wp.vec3()
    for block in range(starts[a], starts[a + 1]):
        total += pooled[block]
    return total


@wp.kernel
def move_as_one_kernel(
    inverse: wp.array2d(dtype=wp.float32),
    starts: wp.array(dtype=wp.int32),
    pooled: wp.array(dtype=wp.vec3),
    at_most: int,
    common_out: wp.array(dtype=wp.vec4),
    sums: wp.array(dtype=wp.int64),
    first: wp.array(dtype=wp.float32),
    squares: wp.array(dtype=wp.float32),
    state: wp.array(dtype=wp.int32),
):
    """S^-1 P^T r of what was pooled of r, by which all of an aggregate's z are to go, and what <r, z> has of that: a
    block of threads for each aggregate."""
    stride = wp.block_dim()
    a = wp.tid() // stride
    lane = wp.tid() % stride
    number = state[TAKEN]
    if number >= at_most or state[MORE] == 0:  # what is added once the last one is done would count as left
        return
    slot = number % RING
    own = wp.vec3()
    for b in range(lane, starts.shape[0] - 1, stride):
        force = pooled_at(pooled, starts, b)
        for k in range(3):
            for n in range(3):
                own[k] = own[k] + inverse[3 * a + k, 3 * b + n] * force[n]
    move = wp.tile_sum(wp.tile(own, preserve_type=True))[0]
    if lane == 0:
        put_four(common_out, a, move, 0.0)
        before = first[0]
        if number > 0:
            before = squares[(slot + 3) % RING]
        part = wp.dot(move, pooled_at(pooled, starts, a))
        wp.atomic_add(sums, place_of(SQUARED, slot, a * stride), whole_of(part, quanta_over(before)))


@wp.func
def pull(pulled: wp.array(dtype=wp.vec4), whole: wp.array(dtype=wp.int64), place: int, force: wp.vec3):
    """Add to what is pulled there, in whichever of both has places."""
    if whole.shape[0] == 0:
        add_at_once(pulled, place, force)
    else:
        for k in range(3):
            wp.atomic_add(whole, 3 * place + k, whole_of(force[k], QUANTA))


@wp.kernel
def multiply_kernel(
    m: PairedMatrix,
    lanes: int,
    shares: int,
    at_most: int,
    tolerance: float,
    spread: wp.array(dtype=wp.float32),
    both: wp.array(dtype=wp.vec4),
    common: wp.array(dtype=wp.vec4),
    threads: int,
    direction_out: wp.array(dtype=wp.vec3),
    product_out: wp.array(dtype=wp.vec3),
    pulled: wp.array(dtype=wp.vec4),
    pulled_whole: wp.array(dtype=wp.int64),
    sums: wp.array(dtype=wp.int64),
    first: wp.array(dtype=wp.float32),
    squares: wp.array(dtype=wp.float32),
    state: wp.array(dtype=wp.int32),
):
    """p = z + b p, A p and <p, A p>, if there is anything left to do; of each vertex `both` has z, without what is
    `common` to its aggregate and with that one's number, and the p before.

    Each row of cloth is shared by `lanes` threads; there are `shares` of all (lanes.py).
    """
    thread = wp.tid()
    number = state[TAKEN]
    slot = number % RING
    b = float(0.0)
    squared = first[0] * whole_sum(sums, SQUARED, slot)
    if number > 0:
        b = whole_sum(sums, SQUARED, slot)
        squared = b * squares[(slot + 3) % RING]
    going_on = number < at_most and squared > tolerance * tolerance * first[0]
    if thread == 0:
        state[NOW] = wp.where(going_on, number, -1)
        state[MORE] = wp.where(going_on and number + 1 < at_most, 1, 0)  # this one goes on to its end
        squares[slot] = squared
    if thread < PLACES:
        sums[(SQUARED + (slot + 2) % RING) * PLACES + thread] = wp.int64(0)
        sums[(CURVATURE + (slot + 1) % RING) * PLACES + thread] = wp.int64(0)
    if not going_on:
        return
    rows = m.columns.shape[0]
    width = m.columns.shape[1] - 1
    far_width = m.far_columns.shape[1]
    others = both.shape[0] // 2 - rows
    part, quanta = wp.int64(0), quanta_over(squared)
    for e in range(thread, shares + others + pair_count(m), threads):
        if e < shares:
            i = e // lanes
            lane = e % lanes
            here = wp.vec3()
            row = wp.vec3()
            if i < rows:
                here = direction_of(both, common, b, i)
                # by differences, as in paired_matrix.py
                for k in range(lane, wp.max(width, far_width), 2 * lanes):
                    # all that is read before any of it is needed; what fills a row up is its own vertex, which adds 0
                    at0 = neighbour(m.columns, i, k + 1)
                    at1 = neighbour(m.columns, i, k + lanes + 1)
                    far0 = neighbour(m.far_columns, i, k)
                    far1 = neighbour(m.far_columns, i, k + lanes)
                    to0 = direction_of(both, common, b, at0) - here
                    to1 = direction_of(both, common, b, at1) - here
                    to_far0 = direction_of(both, common, b, far0) - here
                    to_far1 = direction_of(both, common, b, far1) - here
                    if at0 != i:
                        row += spread_block(spread, i, k, width) * to0
                    if at1 != i:
                        row += spread_block(spread, i, k + lanes, width) * to1
                    if far0 != i:
                        row += m.weights[i, k] * to_far0
                    if far1 != i:
                        row += m.weights[i, k + lanes] * to_far1
            row = wp.vec3(sum_of_lanes(row[0]), sum_of_lanes(row[1]), sum_of_lanes(row[2]))
            if lane == 0 and i < rows:
                row += m.diagonal[i] * here + held_product(m, i, here)
                direction_out[i] = here
                part += whole_of(wp.dot(here, row), quanta)
                product_out[i] = row
        elif e < shares + others:
            i = rows + e - shares
            here = direction_of(both, common, b, i)
            direction_out[i] = here
            row = m.diagonal[i] * here + held_product(m, i, here)
            part += whole_of(wp.dot(here, row), quanta)
            product_out[i] = row
        else:
            c = e - shares - others
            v = m.ids[c]
            w = m.lam[c]
            u = wp.vec3()
            for k in range(4):
                u += w[k] * direction_of(both, common, b, v[k])
            f = pair_force(m, c, u)
            part += whole_of(wp.dot(u, f), quanta)
            for k in range(4):
                place = v[k]
                if v[k] >= rows:
                    place += (thread % COPIES) * others
                pull(pulled, pulled_whole, place, w[k] * f)
    of_block = wp.tile_sum(wp.tile(part))[0]
    if thread % wp.block_dim() == 0:
        wp.atomic_add(sums, place_of(CURVATURE, slot, thread), of_block)


@wp.func
def taken_off(
    pulled: wp.array(dtype=wp.vec4), whole: wp.array(dtype=wp.int64), i: int, copies: int, others: int
) -> wp.vec3:
    """What was pulled at i, of so many copies, which are cleared."""
    total = wp.vec3()
    if whole.shape[0] == 0:
        for k in range(copies):
            at = i + k * others
            total += three_of(pulled, at)
            pulled[at] = wp.vec4()
    else:
        for axis in range(3):
            all_copies = wp.int64(0)  # as one whole number: which pair adds to which copy may be another in each run
            for k in range(copies):
                place = 3 * (i + k * others) + axis
                all_copies += whole[place]
                whole[place] = wp.int64(0)
            total[axis] = float(all_copies) / QUANTA
    return total


@wp.kernel
def advance_kernel(
    inverse: wp.array(dtype=wp.mat33),
    direction: wp.array(dtype=wp.vec3),
    rows: int,
    seats: wp.array(dtype=wp.int32),
    of: wp.array(dtype=wp.int32),
    nobody: int,
    threads: int,
    solution: wp.array(dtype=wp.vec3),
    residual: wp.array(dtype=wp.vec3),
    both_out: wp.array(dtype=wp.vec4),
    product: wp.array(dtype=wp.vec3),
    pulled: wp.array(dtype=wp.vec4),
    pulled_whole: wp.array(dtype=wp.int64),
    pooled_out: wp.array(dtype=wp.vec3),
    sums: wp.array(dtype=wp.int64),
    squares: wp.array(dtype=wp.float32),
    state: wp.array(dtype=wp.int32),
):
    """x += a p, r -= a A p, z = D^-1 r and <r, z>, with a = <r, z>/<p, A p>; pools r; clears what was pulled."""
    thread = wp.tid()
    number = state[NOW]
    if number < 0:
        return
    slot = number % RING
    a = float(0.0)
    curvature = whole_sum(sums, CURVATURE, slot)
    if curvature > 0.0:
        a = 1.0 / curvature
    others = inverse.shape[0] - rows
    part, quanta = wp.int64(0), quanta_over(squares[slot])
    force = wp.vec3()
    for place in range(thread, seats.shape[0] + others, threads):
        i = vertex_of(seats, place, rows)
        if i != NOBODY:
            p = direction[i]
            solution[i] = solution[i] + a * p
            more = taken_off(pulled, pulled_whole, i, wp.where(i < rows, 1, COPIES), others)
            r = residual[i] - a * (product[i] + more)
            z = inverse[i] * r
            residual[i] = r
            part += whole_of(wp.dot(r, z), quanta)
            own = nobody
            if i < rows:
                force = r
                own = of[i]
            put_four(both_out, 2 * i, z, float(own))
            put_four(both_out, 2 * i + 1, p, 0.0)
    pool(seats, thread, force, pooled_out)
    of_block = wp.tile_sum(wp.tile(part))[0]
    if thread % wp.block_dim() == 0:
        wp.atomic_add(sums, place_of(SQUARED, (slot + 1) % RING, thread), of_block)
    if thread == 0:
        state[TAKEN] = number + 1


def spread_out(matrix: PairedMatrix, spread: wp.array) -> None:
    """Spread the blocks of the matrix out into `spread`."""
    rows, width = matrix.blocks.shape
    wp.launch(spread_kernel, rows * (width - 1), [matrix.blocks], [spread], device=spread.device)


def pulled_of(count: int, rows: int) -> int:
    """How many vectors are pulled, for `count` unknowns of which `rows` are the cloth's."""
    return rows + int(COPIES) * (count - rows)


def parts_of(count: int) -> int:
    """How many parts of the first sums of `count` unknowns there are at most: two of each block, if of one thread."""
    return 2 * (whole_blocks(count) + BLOCK)


def solve(
    matrix: PairedMatrix,
    inverse: wp.array,
    aggregates: Aggregates,
    gradient: wp.array,
    solution_out: wp.array,
    residual: wp.array,
    direction: wp.array,
    both: wp.array,
    spread: wp.array,
    product: wp.array,
    pulled: wp.array,
    pulled_whole: wp.array,
    coupled: wp.array,
    sums: wp.array,
    parts: wp.array,
    first: wp.array,
    squares: wp.array,
    state: wp.array,
    at_most: int,
    tolerance: float,
) -> None:
    """As `pcg.solve`; the arrays behind the solution are its scratch: (A,), `both` (2 A,), `spread` (9 N (width - 1),),
    `pulled` (pulled_of(A, N),) or `pulled_whole` of three times that, int64, the other one of no length; `sums` (SUMS,)
    int64, `parts` (parts_of(A),), `squares` (RING,), `state` (3,); `first` (1,) is set."""
    device, count, pairs = gradient.device, len(gradient), len(matrix.ids)
    block = 1 if wp.get_device(device).is_cpu else BLOCK  # a processor's blocks are of one thread
    rows, lanes = len(matrix.columns), lanes_of(str(device))
    shares = shares_of(rows, lanes)
    all_threads = whole_blocks(shares + count - rows + pairs)
    seats = aggregates.seats
    threads = len(seats) + whole_blocks(count - rows)
    whose = seats, aggregates.of, aggregates.count

    def launch(kernel: wp.Kernel, dim: int, inputs: Sequence[object], outputs: Sequence[object]) -> None:
        wp.launch(kernel, dim, [*inputs, dim], outputs, block_dim=BLOCK, device=device)

    def take_along() -> None:
        inputs = [aggregates.inverse, aggregates.starts, aggregates.pooled, at_most]
        made = [aggregates.common, sums, first, squares, state]
        wp.launch(move_as_one_kernel, aggregates.count * block, inputs, made, block_dim=BLOCK, device=device)

    def turns(count: int) -> None:
        for _ in range(count):
            take_along()
            given = [matrix, lanes, shares, at_most, tolerance, spread, both, aggregates.common]
            made = [direction, product, pulled, pulled_whole, sums, first, squares, state]
            launch(multiply_kernel, all_threads, given, made)
            kept = [solution_out, residual, both, product, pulled, pulled_whole, aggregates.pooled]
            kept += [sums, squares, state]
            launch(advance_kernel, threads, [inverse, direction, rows, *whose], kept)

    coupled.zero_()
    spread_out(matrix, spread)
    launch(mark_kernel, whole_blocks(pairs), [matrix], [coupled])
    made = [solution_out, residual, both, pulled, pulled_whole, aggregates.pooled, sums, parts, state]
    launch(start_kernel, threads, [matrix, inverse, gradient, coupled, *whose], made)
    launch(open_kernel, block, [parts, threads // block], [first, sums])
    if at_most <= 2 * TURNS:  # of which a look would save less than it takes
        turns(at_most)
    else:
        wp.capture_while(state[int(MORE) : int(MORE) + 1], lambda: turns(TURNS))
