"""A move that parts a pair only at first is shortened to where it parts it most; every other move stays as it is."""

import numpy as np
import pytest
import warp as wp
from reference_distances import EDGE_EDGE, POINT_TRIANGLE, stencil_distances

from tryon_solver.contact.candidates import Candidates, ContactSizes
from tryon_solver.contact.parting import part

XI, D_HAT = 1.8e-3, 2e-3
COUNT = 2000
KINDS = [pytest.param(POINT_TRIANGLE, id="point-triangle"), pytest.param(EDGE_EDGE, id="edge-edge")]


def pressed_together(rng, kind):
    """Stencils (S, 4, 3) m of 2 cm, 10 to 200 micrometres above xi, their unit normals (S, 3) and weights (S, 4)."""
    x = 0.02 * rng.standard_normal((COUNT, 4, 3))
    d, lam = stencil_distances(np.full(1, kind), x[:, None])
    n = np.einsum("si,sid->sd", lam[:, 0], x) / d
    first = [0] if kind == POINT_TRIANGLE else [0, 1]
    x[:, first] -= ((d - XI - rng.uniform(1e-5, 2e-4, (COUNT, 1))) * n)[:, None]
    x = x.astype(np.float32).astype(np.float64)
    d, lam = stencil_distances(np.full(1, kind), x[:, None])
    return x, d[:, 0], np.einsum("si,sid->sd", lam[:, 0], x) / d, lam[:, 0]


def parted(x, p, kind):
    """What `part` leaves of the displacements p (S, 4, 3) of stencils that share no vertex, and of alpha (4 S,)."""
    candidates = Candidates.allocate(COUNT, "cpu")
    candidates.ids.assign(np.arange(4 * COUNT, dtype=np.int32).reshape(-1, 4))
    candidates.kind.fill_(kind)
    candidates.distance.assign(stencil_distances(np.full(1, kind), x[:, None])[0][:, 0].astype(np.float32))
    candidates.near.assign(np.arange(COUNT, dtype=np.int32))
    candidates.near_count.fill_(COUNT)
    candidates.size = candidates.near_size = COUNT
    sizes = ContactSizes()
    sizes.xi_body, sizes.xi_self, sizes.d_hat = XI, XI, D_HAT
    moves = wp.array(p.reshape(-1, 3), dtype=wp.vec3, device="cpu")
    alpha = wp.full(4 * COUNT, 1.0, dtype=wp.float32, device="cpu")
    part(candidates, 4 * COUNT, sizes, wp.array(x.reshape(-1, 3), dtype=wp.vec3, device="cpu"), moves, alpha)
    return moves.numpy().reshape(-1, 4, 3).astype(np.float64), alpha.numpy()


def slopes(p, n, lam):
    """n . sum_i lam_i p_i (S,) m: by how much each pair would part along its normal."""
    return np.einsum("si,sid,sd->s", lam, p, n)


@pytest.mark.parametrize("kind", KINDS)
def test_it_goes_to_where_the_pair_parts_most(rng, kind):
    """Slides of millimetres that part by micrometres: 0.5 a / c of the way, and further apart there than at either
    end."""
    x, d, n, lam = pressed_together(rng, kind)
    p = 3e-3 * rng.standard_normal((COUNT, 4, 3))
    p += ((rng.uniform(1e-5, 2e-4, COUNT) - slopes(p, n, lam)) / (lam**2).sum(1))[:, None, None] * (
        lam[:, :, None] * n[:, None]
    )
    p = p.astype(np.float32).astype(np.float64)
    a = slopes(p, n, lam)
    end, there = stencil_distances(np.full(1, kind), (x + p)[:, None])
    facing = np.einsum("si,sid,sd->s", there[:, 0], x + p, n) > 0
    end = np.where(facing, end[:, 0], -end[:, 0])
    bent = d + a - end
    closes = end < d - 1e-4
    assert closes.mean() > 0.05
    left, alpha = parted(x, p, kind)
    assert (alpha == 1).all()
    share = (0.5 * a / bent)[closes]
    np.testing.assert_allclose(left[closes], share[:, None, None] * p[closes], rtol=0.05, atol=2e-7)
    apart = stencil_distances(np.full(1, kind), (x + left)[:, None])[0][closes, 0]
    assert (apart > end[closes]).all()
    assert np.mean(apart > d[closes]) > 0.95


@pytest.mark.parametrize("kind", KINDS)
def test_what_closes_or_parts_all_the_way_stays_as_it_is(rng, kind):
    x, _, n, lam = pressed_together(rng, kind)
    for along in (-1e-3, 1e-3):  # of the first side alone: straight, whatever way
        p = np.zeros((COUNT, 4, 3))
        p[:, [0] if kind == POINT_TRIANGLE else [0, 1]] = (along * n)[:, None]
        p = p.astype(np.float32).astype(np.float64)
        assert (np.sign(slopes(p, n, lam)) == np.sign(along)).all()
        left, _ = parted(x, p, kind)
        np.testing.assert_array_equal(left, p)


def test_what_is_out_of_the_barriers_reach_stays_as_it_is(rng):
    x, _, n, _ = pressed_together(rng, EDGE_EDGE)
    x[:, :2] += (1.1 * D_HAT * n)[:, None]
    p = (0.01 * rng.standard_normal((COUNT, 4, 3))).astype(np.float32).astype(np.float64)
    left, _ = parted(x, p, EDGE_EDGE)
    np.testing.assert_array_equal(left, p)
