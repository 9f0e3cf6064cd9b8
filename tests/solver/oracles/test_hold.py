"""What contact stops is held in the next direction, along what it lacks of its way, by how much of that it went, and
let go again."""

import numpy as np
import warp as wp
from newton_product import newton_product
from small_scenes import STILL, fabric, icosphere, rigid_body, sheet

from tryon_solver.contact.hold import KEPT, LEAST_SHARE, Holding
from tryon_solver.scene import WORN, Scene
from tryon_solver.settings import Settings
from tryon_solver.simulation import build
from tryon_solver.stepping import correct
from tryon_solver.stepping.newton import linearise

OWN = 40.0  # N/m, mean of the blocks' diagonals
WAY = np.array([1e-3, -2e-3, 2e-3])  # m, wanted
ASIDE = np.array([2e-3, 1e-3, 0.0])  # m, across the way: no part of it


def vectors(rows):
    return wp.array(np.asarray(rows, dtype=np.float32), dtype=wp.vec3, device="cpu")


def wanted(count):
    return vectors(np.tile(WAY, (count, 1)))


def held_after(shares, allowed=None):
    """Holding of vertices that went these shares of (1, -2, 2) mm and (2, 1, 0) mm aside, and how stiffly it holds."""
    count = len(shares)
    holding = Holding.over(wp.zeros(count, dtype=wp.vec3, device="cpu"))
    if allowed is not None:
        holding.allowed.assign(np.asarray(allowed, dtype=np.float32))
    moved = np.asarray(shares)[:, None] * WAY + ASIDE
    holding.measure(wanted(count), vectors(moved))
    lacking = (1.0 if allowed is None else np.asarray(allowed)[:, None]) * WAY - moved
    return holding, added(holding, lacking)


def added(holding, lacking):
    """(K,) N/m of what is added to blocks: one stiffness along what is lacking, and none across it."""
    count = len(holding.share)
    blocks = np.tile(np.diag([30.0, 40.0, 50.0]), (count, 1, 1)).astype(np.float32)
    device_blocks = wp.array(blocks, dtype=wp.mat33, device="cpu")
    holding.add(device_blocks)
    more = device_blocks.numpy().astype(np.float64) - blocks
    stiffness = np.trace(more, axis1=1, axis2=2)
    along = lacking / np.linalg.norm(lacking, axis=1, keepdims=True)
    one_way = stiffness[:, None, None] * along[:, :, None] * along[:, None, :]
    np.testing.assert_allclose(more, one_way, rtol=1e-3, atol=1e-3 * max(stiffness.max(), 1.0))
    held = holding.held.numpy().astype(np.float64)
    np.testing.assert_allclose(held[:, :, None] * held[:, None, :], more, rtol=1e-3, atol=1e-2)
    return stiffness


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
    holding = Holding.over(wp.zeros(4, dtype=wp.vec3, device="cpu"))
    nowhere = vectors([[9e-7, 0, 0], [-9e-7, 0, 0], [2e-6, 0, 0], [-2e-6, 0, 0]])
    holding.measure(nowhere, vectors(np.tile([1e-3, 0, 0], (4, 1))))
    most = OWN * (1 / LEAST_SHARE - 1)
    np.testing.assert_allclose(added(holding, np.tile([1.0, 0, 0], (4, 1))), [0, 0, 0, most], rtol=1e-4)


def test_what_is_free_again_is_let_go_by_and_by():
    """Along what it lacked when it was stopped."""
    holding, first = held_after([0.4, 0.2])
    lacked = WAY - np.array([[0.4], [0.2]]) * WAY - ASIDE
    holding.measure(wanted(2), wanted(2))
    np.testing.assert_allclose(added(holding, lacked), KEPT * first, rtol=1e-4)
    np.testing.assert_allclose(added(holding, lacked), KEPT**2 * first, rtol=1e-4)
    holding.release()
    assert not added(holding, lacked).any()


def test_what_is_stopped_more_firmly_another_way_is_held_that_way():
    """One way at a time: the firmer one."""
    holding, _ = held_after([0.4])
    holding.measure(wanted(1), vectors([WAY - [0.0, 0.0, 4e-3]]))
    added(holding, np.array([[0.0, 0.0, 1.0]]))
    holding.measure(wanted(1), vectors([0.49 * WAY]))
    added(holding, np.array([[0.0, 0.0, 1.0]]))


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
    """The product has h h^T p more for a held vertex, and the inverse block is that of the block with h h^T."""
    sim, held = laid_on_ball(), 60
    correct.look_around(sim, near=False)
    p = np.zeros((sim.all_count, 3))
    p[held] = [1e-3, 2e-3, 4e-3]
    products, blocks = [], []
    for share in (1.0, 0.25):
        sim.holding.release()
        shares = np.ones(sim.all_count, dtype=np.float32)
        shares[held] = share
        sim.holding.share.assign(shares)
        sim.holding.lacking.assign(vectors(np.tile(WAY, (sim.all_count, 1))))
        linearise(sim)
        out = wp.zeros(sim.all_count, dtype=wp.vec3, device="cpu")
        newton_product(sim, vectors(p), out)
        products.append(out.numpy().astype(np.float64))
        blocks.append(np.linalg.inv(sim.work.blocks.numpy().astype(np.float64)))
    stiffness = 3.0 * np.trace(blocks[0][held]) / 3.0
    assert stiffness > 1.0
    expected = stiffness * np.outer(WAY, WAY) / (WAY @ WAY)
    assert np.abs(expected @ p[held]).max() > 1e-3 * stiffness
    more = products[1] - products[0]
    np.testing.assert_allclose(more[held], expected @ p[held], rtol=1e-3, atol=1e-4 * stiffness * 1e-3)
    assert not np.delete(more, held, axis=0).any()
    np.testing.assert_allclose(blocks[1][held] - blocks[0][held], expected, rtol=1e-3, atol=1e-3 * stiffness)


def test_each_step_begins_with_nothing_held():
    """Whatever was held before, however firmly: the same bytes."""
    ends = []
    for held in (0.0, 3e4):
        sim = laid_on_ball()
        sim.holding.share.fill_(0.0)
        sim.holding.lacking.fill_(wp.vec3(1.0, 0.0, 0.0))
        sim.holding.held.fill_(wp.vec3(held, held, held))
        before = sim.cloth_positions().copy()
        sim.advance(STILL, 31 / 60)
        ends.append(sim.cloth_positions().copy())
        assert (ends[-1] != before).any()
    np.testing.assert_array_equal(*ends)
