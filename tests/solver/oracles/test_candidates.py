"""The broad phase against all pairs: nothing that comes within reach is missing, nothing appears twice."""

import numpy as np
import pytest
from reference_distances import stencil_distances
from tangles import Tangle, keys

from tryon_solver.contact import candidates
from tryon_solver.stepping import move_body, search

SAMPLES = 8


@pytest.fixture(scope="module")
def tangle():
    return Tangle(columns=7, size=0.15)


def crumple(tangle, rng):
    """Positions whose layers interleave: a broad phase has to be complete there too."""
    bumps = 0.004 * rng.standard_normal(tangle.x.shape)
    return (tangle.x + bumps).astype(np.float32).astype(np.float64)


def smallest_distances(tangle, x, motion, shares):
    """(S,) m: smallest distance of each stencil over sampled times, vertex i moving shares[:, i] of its motion."""
    smallest = np.full(len(tangle.stencils[0]), np.inf)
    for share in shares:
        smallest = np.minimum(smallest, tangle.distances(x + share[:, None] * motion))
    return smallest


@pytest.mark.parametrize("speed", [0.0, 0.004, 0.02])
def test_complete_for_the_motion_itself(tangle, rng, speed):
    """With `relative` set: every stencil that comes within reach while all vertices take their whole displacement."""
    reach = 0.003
    x, motion = crumple(tangle, rng), tangle.throw(rng, speed)
    tangle.set_motion(x, motion)
    sim = tangle.sim
    candidates.sweep(sim.boxes, sim.state.x, sim.work.direction, 0.5 * reach)
    move_body.find(sim, reach, 0.0, relative=True)
    found = tangle.candidate_keys()
    assert len(found) == sim.candidates.size
    times = np.linspace(0, 1, SAMPLES)
    closest = smallest_distances(tangle, x, motion, np.tile(times[:, None], (1, len(x))))
    wanted = closest < reach - 1e-6
    assert wanted.sum() > 100
    kinds, ids = tangle.stencils
    assert set(keys(kinds[wanted], ids[wanted])) <= found
    assert found <= set(keys(kinds, ids))


def test_complete_for_any_shortening_and_any_way_within_the_slack(tangle, rng):
    """What the correction's search promises: vertices may stop anywhere along their way, and stray by the slack."""
    sim = tangle.sim
    slack = sim.settings.search_slack
    x, motion = crumple(tangle, rng), tangle.throw(rng, 0.008)
    tangle.set_motion(x, motion)
    search.search_around(sim, sim.state.x, sim.work.direction)
    found = tangle.candidate_keys()
    assert len(found) == sim.candidates.size
    closest = np.full(len(tangle.stencils[0]), np.inf)
    lower, upper = sim.inner.lower.numpy(), sim.inner.upper.numpy()
    for _ in range(SAMPLES):
        stray = rng.standard_normal(x.shape)
        stray *= slack / np.linalg.norm(stray, axis=1, keepdims=True)
        there = x + rng.uniform(0, 1, (len(x), 1)) * motion + stray
        assert (there > lower - 1e-6).all()
        assert (there < upper + 1e-6).all()
        closest = np.minimum(closest, tangle.distances(there))
    wanted = closest < sim.reach - 1e-6
    assert wanted.sum() > 100
    kinds, ids = tangle.stencils
    assert set(keys(kinds[wanted], ids[wanted])) <= found


def test_distance_stored_with_a_candidate_is_its_own(tangle, rng):
    sim = tangle.sim
    x = crumple(tangle, rng)
    tangle.set_motion(x, np.zeros_like(x))
    sim.candidates.distance.fill_(np.nan)
    search.search_around(sim, sim.state.x, sim.work.direction)
    c = sim.candidates
    expected, _ = stencil_distances(c.kind.numpy()[: c.size], x[c.ids.numpy()[: c.size]])
    np.testing.assert_allclose(c.distance.numpy()[: c.size], expected, rtol=0, atol=1e-7)


def test_overflow_grows_the_list_and_drops_nothing(tangle, rng):
    """With room for sixteen stencils the search finds as many as with room for all."""
    sim = tangle.sim
    x = crumple(tangle, rng)
    tangle.set_motion(x, np.zeros_like(x))
    search.search_around(sim, sim.state.x, sim.work.direction)
    everything = tangle.candidate_keys()
    assert len(everything) > 16
    sim.candidates.__dict__.update(candidates.Candidates.allocate(16, "cpu").__dict__)
    tangle.set_motion(x, np.zeros_like(x))
    search.search_around(sim, sim.state.x, sim.work.direction)
    assert tangle.candidate_keys() == everything


def test_vertices_to_be_sewn_together_are_no_candidates(rng):
    """Two corners of one group: stencils with both are left out, all others stay."""
    tangle = Tangle(columns=5, size=0.1)
    sim = tangle.sim
    x = crumple(tangle, rng)
    tangle.set_motion(x, np.zeros_like(x))
    search.search_around(sim, sim.state.x, sim.work.direction)
    before = tangle.candidate_keys()
    a, b = 0, tangle.cloth // 2
    group = sim.group.numpy()
    group[b] = group[a]
    sim.group.assign(group)
    tangle.set_motion(x, np.zeros_like(x))
    search.search_around(sim, sim.state.x, sim.work.direction)
    after = tangle.candidate_keys()
    together = {k for k in before if a in k[1:] and b in k[1:]}
    assert together
    assert before - together <= after
    assert not [k for k in after if opposite(k, a, b)]


def opposite(key, a, b):
    """Is vertex a on one side of the stencil and b on the other?"""
    kind, *ids = key
    side = ids[:1] if kind == 0 else ids[:2]
    other = ids[1:] if kind == 0 else ids[2:]
    return (a in side and b in other) or (b in side and a in other)
