"""Packets of triangles: each triangle is in one of them, near the others, and they find what single triangles do."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp
from tangles import Tangle

from tryon_solver.contact.found import PAIRS
from tryon_solver.contact.packets import packets_of
from tryon_solver.contact.triangle_pairs import walk
from tryon_solver.linalg.warps import WARP
from tryon_solver.stepping import search


def strips(rng):
    """Centres (F, 2) m and pieces (F,) of two pieces of unlike size and shape, in no order; one has one triangle."""
    long = rng.uniform([0.0, 0.0], [1.0, 0.05], (3000, 2))
    square = rng.uniform([0.2, 0.2], [0.5, 0.5], (2000, 2))
    centres, piece = np.vstack([long, square, [[0.3, 0.3]]]), np.repeat([0, 1, 2], [3000, 2000, 1])
    order = rng.permutation(len(centres))
    return centres[order], piece[order]


def test_each_triangle_is_in_one_packet_with_others_of_its_piece_near_it(rng):
    centres, piece = strips(rng)
    packets = packets_of(centres, piece)
    assert packets.shape[1] == WARP
    there = packets >= 0
    np.testing.assert_array_equal(np.sort(packets[there]), np.arange(len(centres)))
    assert there.any(axis=1).all()
    assert there.mean() > 0.5
    for packet, held in zip(packets, there):
        of_it = packet[held]
        assert len(set(piece[of_it])) == 1
        area = {0: 0.05 / 3000, 1: 0.09 / 2000, 2: 0.0}[piece[of_it[0]]]
        assert np.ptp(centres[of_it], axis=0).max(initial=0.0) <= 1.01 * np.sqrt(WARP * area)


def test_triangles_at_one_place_are_in_packets_too():
    packets = packets_of(np.zeros((70, 2)), np.zeros(70, int))
    np.testing.assert_array_equal(np.sort(packets[packets >= 0]), np.arange(70))


@pytest.mark.gpu
@pytest.mark.parametrize("anew", [True, False])
def test_packets_find_the_pairs_that_single_triangles_do(rng, anew):
    """Of layers that interleave, with themselves and with the body, all anew or where a third has gained."""
    wp.init()
    if not wp.is_cuda_available():
        pytest.skip("no CUDA device on this machine")
    tangle = Tangle(columns=12, size=0.2, device="cuda:0")
    sim = tangle.sim
    tangle.set_motion(tangle.x + 0.004 * rng.standard_normal(tangle.x.shape), np.zeros_like(tangle.x))
    search.search_along(sim, sim.state.x, sim.work.direction, 1.0)
    packets = sim.cloth.packets
    assert packets is not None
    for surface in sim.touching:
        for one in {id(each): each for each in (sim.cloth, surface)}.values():
            budget = one.budget.numpy()
            gained = rng.random(len(budget)) < 0.3
            one.known.assign(np.where(gained, budget - 1e-4, budget).astype(np.float32))
            one.gained.fill_(1)
        found = [pairs_of(replace(sim.cloth, packets=each), sim.cloth, surface, anew) for each in (packets, None)]
        assert len(found[0]) > 100
        assert found[0] == found[1]


def pairs_of(cloth, own, other, anew):
    """The pairs that a walk finds, each counted: as a sorted list."""
    other = cloth if other is own else other
    triangles = wp.full(1 << 20, wp.vec2i(-1, -1), dtype=wp.vec2i, device="cuda:0")
    counts = wp.zeros(8, dtype=wp.int32, device="cuda:0")
    walk(cloth, other, cloth.side, other.side, anew, triangles, counts)
    count = int(counts.numpy()[int(PAIRS)])
    return sorted(map(tuple, triangles.numpy()[:count].tolist()))
