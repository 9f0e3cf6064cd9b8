"""What contact stops is held in the next direction, by how much of its way it went, and let go again."""

import numpy as np
import warp as wp
from newton_product import newton_product
from small_scenes import STILL, fabric, icosphere, rigid_body, sheet

from tryon_solver.scene import WORN, Scene
from tryon_solver.settings import Settings
from tryon_solver.simulation import build
from tryon_solver.stepping import correct
from tryon_solver.stepping.hold import KEPT, LEAST_SHARE, Holding
from tryon_solver.stepping.newton import linearise

OWN = 40.0  # N/m, mean of the blocks' diagonals


def vectors(rows):
    return wp.array(np.asarray(rows, dtype=np.float32), dtype=wp.vec3, device="cpu")


def held_after(shares, allowed=None):
    """Holding of vertices that went these shares of (1, -2, 2) mm, and what it added to blocks and diagonal."""
    count = len(shares)
    holding = Holding.allocate(count, "cpu")
    p = np.tile([1e-3, -2e-3, 2e-3], (count, 1))
    aside = np.tile([2e-3, 1e-3, 0.0], (count, 1))  # across the way: no part of it
    holding.wanted.assign(vectors(p))
    if allowed is not None:
        holding.allowed.assign(np.asarray(allowed, dtype=np.float32))
    holding.measure(vectors(np.asarray(shares)[:, None] * p + aside))
    return holding, added(holding)


def added(holding):
    count = len(holding.share)
    blocks = np.tile(np.diag([30.0, 40.0, 50.0]), (count, 1, 1)).astype(np.float32)
    device_blocks = wp.array(blocks, dtype=wp.mat33, device="cpu")
    holding.add(wp.full(count, 7.0, dtype=wp.float32, device="cpu"), device_blocks)
    more = device_blocks.numpy() - blocks
    np.testing.assert_allclose(more, more[:, :1, :1] * np.eye(3), atol=1e-5)
    np.testing.assert_allclose(holding.diagonal.numpy() - 7.0, more[:, 0, 0], rtol=1e-5, atol=1e-5)
    return more[:, 0, 0].astype(np.float64)


def test_what_went_less_of_its_way_is_held_more_firmly():
    _, stiffness = held_after([1.0, 0.55, 1.4, 0.4, 0.2, LEAST_SHARE, 0.0, -3.0])
    most = OWN * (1 / LEAST_SHARE - 1)
    np.testing.assert_allclose(stiffness, [0, 0, 0, 1.5 * OWN, 4 * OWN, most, most, most], rtol=1e-4)


def test_what_the_region_cuts_is_not_held():
    """Its border is where the candidates end, no contact."""
    _, stiffness = held_after([0.5, 0.1, 0.0], allowed=[0.5, 0.5, 0.0])
    np.testing.assert_allclose(stiffness, [0, 4 * OWN, 0], rtol=1e-4)


def test_what_wants_to_go_nowhere_is_not_held():
    """A vertex that contact pushes by a millimetre off a place it hardly leaves by itself: which way that is says
    rounding, and held or not must not hang on it."""
    holding = Holding.allocate(4, "cpu")
    holding.wanted.assign(vectors([[9e-7, 0, 0], [-9e-7, 0, 0], [2e-6, 0, 0], [-2e-6, 0, 0]]))
    holding.measure(vectors(np.tile([1e-3, 0, 0], (4, 1))))
    most = OWN * (1 / LEAST_SHARE - 1)
    np.testing.assert_allclose(added(holding), [0, 0, 0, most], rtol=1e-4)


def test_what_is_free_again_is_let_go_by_and_by():
    holding, first = held_after([0.4, 0.2])
    holding.measure(holding.wanted)
    np.testing.assert_allclose(added(holding), KEPT * first, rtol=1e-4)
    np.testing.assert_allclose(added(holding), KEPT**2 * first, rtol=1e-4)
    holding.release()
    assert not added(holding).any()


def laid_on_ball():
    """A square pressed on a ball."""
    garment, x = sheet(11, 11, 0.4, 0.4)
    ball, faces = icosphere(0.17, 2)
    scene = Scene(garment, x + np.array([0, 0.174, 0]), rigid_body(ball, faces), fabric(), WORN)
    sim = build(scene, Settings(), "cpu", STILL)
    for k in range(30):
        sim.advance(STILL, (k + 1) / 60)
    return sim


def test_matrix_and_its_preconditioner_hold_alike():
    """The product has lambda p more for a held vertex, and the inverse block is that of the block with lambda."""
    sim, held = laid_on_ball(), 60
    correct.look_around(sim, near=False)
    p = np.zeros((sim.all_count, 3))
    p[held] = [1e-3, 2e-3, -1e-3]
    products, blocks = [], []
    for share in (1.0, 0.25):
        sim.holding.release()
        shares = np.ones(sim.all_count, dtype=np.float32)
        shares[held] = share
        sim.holding.share.assign(shares)
        linearise(sim)
        out = wp.zeros(sim.all_count, dtype=wp.vec3, device="cpu")
        newton_product(sim, vectors(p), out)
        products.append(out.numpy().astype(np.float64))
        blocks.append(np.linalg.inv(sim.work.blocks.numpy().astype(np.float64)))
    stiffness = 3.0 * np.trace(blocks[0][held]) / 3.0
    assert stiffness > 1.0
    np.testing.assert_allclose(products[1] - products[0], stiffness * p, rtol=1e-3, atol=1e-4 * stiffness * 1e-3)
    more = blocks[1][held] - blocks[0][held]
    np.testing.assert_allclose(more, stiffness * np.eye(3), rtol=1e-3, atol=1e-3 * stiffness)


def test_each_step_begins_with_nothing_held():
    """Whatever was held before, however firmly: the same bytes."""
    ends = []
    for stiffness in (0.0, 1e9):
        sim = laid_on_ball()
        sim.holding.share.fill_(0.0)
        sim.holding.stiffness.fill_(stiffness)
        before = sim.cloth_positions().copy()
        sim.advance(STILL, 31 / 60)
        ends.append(sim.cloth_positions().copy())
        assert (ends[-1] != before).any()
    np.testing.assert_array_equal(*ends)
