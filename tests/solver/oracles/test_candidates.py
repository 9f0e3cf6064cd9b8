"""The broad phase against all pairs: nothing that comes within reach is missing, nothing appears twice."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp
from reference_distances import stencil_distances, stencil_keys
from small_scenes import device_vectors, fabric, layers, turn
from tangles import Tangle

from tryon_solver.contact import bounds, broad_phase, candidates, found
from tryon_solver.contact.found import CrowdedError, Found
from tryon_solver.contact.region import Region
from tryon_solver.scene import Scene, SelfContact
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build
from tryon_solver.stepping import search
from tryon_solver.stepping.search import scope

SAMPLES = 8


@pytest.fixture(scope="module")
def tangle():
    return Tangle(columns=7, size=0.15)


@pytest.fixture(scope="module")
def fine_tangle():
    """Of cloth that would reach beyond its own triangles, if it felt itself from as far off as the body."""
    tangle = Tangle(columns=7, size=0.018)
    assert tangle.sim.rest.reach.numpy().max() < 0.7 * tangle.sim.cloth.reach.farthest
    return tangle


def crumple(tangle, rng):
    """Positions whose layers interleave: a broad phase has to be complete there too."""
    bumps = 0.004 * rng.standard_normal(tangle.x.shape)
    return (tangle.x + bumps).astype(np.float32).astype(np.float64)


def stray(rng, budget):
    """(A, 3) m: a way of random direction and of the given length (A,) for everybody."""
    away = rng.standard_normal((len(budget), 3))
    return budget[:, None] * away / np.linalg.norm(away, axis=1, keepdims=True)


@pytest.mark.parametrize(
    ("speed", "slack"),
    [
        (0.0, 0.002),
        (0.02, 1e-6),
        *(
            pytest.param(*both, marks=pytest.mark.long)
            for both in ((0.0, 1e-6), (0.004, 1e-6), (0.004, 0.002), (0.02, 0.002))
        ),
    ],
)
def test_complete_for_the_motion_and_any_way_within_the_budgets(tangle, rng, speed, slack):
    """What the kinematic search promises: all take their displacement together, each straying by its budget."""
    move_and_stray(tangle, rng, speed, slack)


@pytest.mark.parametrize("slack", [1e-6, 2e-4])
def test_fine_cloth_is_searched_as_far_as_it_feels_itself(fine_tangle, rng, slack):
    """And no further: flat, it finds none of its neighbours, which another search did."""
    move_and_stray(fine_tangle, rng, 0.004, slack)
    sim, flat = fine_tangle.sim, fine_tangle.x
    fine_tangle.set_motion(flat, 0 * flat)
    with_slack(sim, 1e-6, lambda: search.search_around(sim, sim.state.x, sim.work.direction))
    _, ids = fine_tangle.stencils
    own = (ids < fine_tangle.cloth).all(axis=1)
    lower = (ids < fine_tangle.cloth // 2).sum(axis=1)
    one_sheet = fine_tangle.keys[own & ((lower == 0) | (lower == 4))]
    close = fine_tangle.distances(flat) < sim.cloth.reach.farthest
    assert (own & close).sum() > 300
    assert not np.isin(one_sheet, fine_tangle.candidate_keys()).any()


def move_and_stray(tangle, rng, speed, slack):
    sim = tangle.sim
    x, motion = crumple(tangle, rng), tangle.throw(rng, speed)
    tangle.set_motion(x, motion)
    solved = stray(rng, rng.uniform(0, 4 * slack, len(x)))
    sim.expected.assign(solved.astype(np.float32))
    sim.region.budget.fill_(np.nan)
    with_slack(sim, slack, lambda: search.search_along(sim, sim.state.x, sim.work.direction, 1.0))
    sim.expected.zero_()
    found = tangle.candidate_keys()
    assert len(found) == sim.candidates.size
    budget = sim.region.budget.numpy().astype(np.float64)
    assert (budget[: tangle.cloth] >= slack).all()
    for beside in (0.0, 1.0):  # neither without what the solve did last nor with it a vertex leaves
        far = x + motion + beside * solved - sim.region.anchor.numpy()
        assert (np.linalg.norm(far, axis=1) < budget).all()
    closest = np.full(len(tangle.stencils[0]), np.inf)
    for time in np.linspace(0, 1, SAMPLES):
        there = x + time * motion + 0.5 * solved + stray(rng, rng.uniform(0, 1, len(x)) * budget)
        closest = np.minimum(closest, tangle.distances(there))
    check_complete(tangle, found, closest)


def with_slack(sim, slack, action):
    """Run the action with another search slack [m] in the settings."""
    kept = sim.settings
    sim.settings = replace(kept, search_slack=slack)
    try:
        action()
    finally:
        sim.settings = kept


def check_complete(tangle, found, closest):
    """Every stencil whose smallest distance is within reach was found, and nothing that is no stencil."""
    _, ids = tangle.stencils
    offset = offsets(tangle, ids)
    wanted = closest < reaches(tangle, ids) - 1e-6
    assert wanted[offset > offset.min()].sum() > 20, "of the body"
    assert wanted[offset == offset.min()].sum() > 20, "of the cloth"
    assert np.isin(tangle.keys[wanted], found).all()
    assert np.isin(found, tangle.keys).all()


def reaches(tangle, ids):
    """(S,) m: from how far off stencils of these vertices are felt (pairs.py)."""
    reach = offsets(tangle, ids) + tangle.sim.settings.d_hat
    own = np.append(tangle.sim.rest.reach.numpy(), np.full(len(tangle.x) - tangle.cloth, np.inf))
    return np.where((ids >= tangle.cloth).any(axis=1), reach, np.minimum(reach, own[ids].min(axis=1)))


def offsets(tangle, ids):
    """(S,) m: how thick is what stencils of these vertices touch; the body's is more."""
    sizes = tangle.sim.contact.sizes
    assert sizes.xi_body > sizes.xi_self
    return np.where((ids >= tangle.cloth).any(axis=1), sizes.xi_body, sizes.xi_self)


def turned(x, degrees):
    """(A, 3) m turned about the vertical through (0.3, 0, 0.1) m, and raised by a metre."""
    rotation, centre = turn((0, degrees, 0)), np.array([0.3, 0.0, 0.1])
    return (x - centre) @ rotation.T + centre + np.array([0.0, 1.0, 0.0])


def test_a_list_serves_the_next_step_while_every_vertex_is_in_its_ball(tangle, rng):
    """All turned with the root, anchors too: it is complete for whatever is in the balls, and its distances are those
    there. Where one vertex is outside, on the way or now, it is no good."""
    sim = tangle.sim
    x = crumple(tangle, rng)
    tangle.set_motion(x, 0 * x)
    with_slack(sim, 0.002, lambda: search.search_around(sim, sim.state.x, sim.work.direction))
    found, size = tangle.candidate_keys(), sim.candidates.size
    budget = sim.region.budget.numpy().astype(np.float64)
    sim.region.anchor.assign(turned(sim.region.anchor.numpy().astype(np.float64), 40).astype(np.float32))
    here, there = (turned(x, 40) + stray(rng, 0.99 * budget) for _ in range(2))
    tangle.set_motion(here, there - here)
    sim.candidates.distance.fill_(np.nan)
    assert search.list_holds(sim, sim.state.x, sim.work.direction)
    assert sim.candidates.size == size
    ids, kinds = sim.candidates.ids.numpy()[:size], sim.candidates.kind.numpy()[:size]
    exact = stencil_distances(kinds, here.astype(np.float32).astype(np.float64)[ids])[0]
    np.testing.assert_allclose(sim.candidates.distance.numpy()[:size], exact, atol=2e-6)
    closest = np.minimum.reduce([tangle.distances((1 - t) * here + t * there) for t in np.linspace(0, 1, SAMPLES)])
    check_complete(tangle, found, closest)
    for end in (0, 1):
        ends = [here.copy(), there.copy()]
        ends[end][17] = sim.region.anchor.numpy()[17] + 1.02 * stray(rng, budget)[17]
        tangle.set_motion(ends[0], ends[1] - ends[0])
        assert not search.list_holds(sim, sim.state.x, sim.work.direction), f"outside at end {end}"


def test_a_list_serves_so_many_steps_at_most(tangle, rng):
    sim = tangle.sim
    tangle.set_motion(crumple(tangle, rng), 0 * tangle.x)
    search.search_around(sim, sim.state.x, sim.work.direction)
    served = [search.list_holds(sim, sim.state.x, sim.work.direction) for _ in range(search.LONGEST_SERVED + 1)]
    assert served == [True] * search.LONGEST_SERVED + [False]
    search.search_around(sim, sim.state.x, sim.work.direction)
    assert search.list_holds(sim, sim.state.x, sim.work.direction)


def test_complete_for_any_shortening_and_any_way_within_the_slack(tangle, rng):
    """What the search for one move promises: vertices may stop anywhere along their way, and stray by the slack."""
    sim = tangle.sim
    slack = sim.settings.search_slack
    x, motion = crumple(tangle, rng), tangle.throw(rng, 0.008)
    tangle.set_motion(x, motion)
    search.search_around(sim, sim.state.x, sim.work.direction)
    found = tangle.candidate_keys()
    assert len(found) == sim.candidates.size
    closest = np.full(len(tangle.stencils[0]), np.inf)
    anchor, budget = sim.region.anchor.numpy(), sim.region.budget.numpy()
    for _ in range(SAMPLES):
        there = x + rng.uniform(0, 1, (len(x), 1)) * motion + stray(rng, np.full(len(x), slack))
        assert (np.linalg.norm(there - anchor, axis=1) < budget + 1e-6).all()
        closest = np.minimum(closest, tangle.distances(there))
    check_complete(tangle, found, closest)


@pytest.mark.parametrize(("largest", "granted"), [(0.01, True), (0.3, True), (0.6, False)])
def test_what_is_far_apart_is_granted_half_of_what_is_between_unless_somebody_may_go_further(largest, granted):
    """Cloth 1 m above the skin, and one vertex of it 5 cm further up, that may go as far as `largest` m: with 0.6 it
    could meet who is granted half of the metre."""
    count, reach = 4, 0.05
    region = Region.allocate(2 * count, "cpu")
    x = np.zeros((2 * count, 3), np.float32)
    x[:, 0] = np.tile(np.arange(count), 2)
    x[:count, 1] = 1.0
    x[0, 1] = 1.05
    budget = np.full(2 * count, 0.002, np.float32)
    budget[0] = largest
    region.centre.assign(x)
    region.budget.assign(budget)
    region.part(count, reach, wp.full(5, wp.vec3(np.nan), dtype=wp.vec3, device="cpu"))
    after = region.budget.numpy()
    if granted:
        np.testing.assert_allclose(after, 0.5 * (1.0 - reach), rtol=3e-3)
    else:
        np.testing.assert_array_equal(after, budget)
    between = np.linalg.norm(x[:count, None] - x[None, count:], axis=2)
    assert (after[:count, None] + after[None, count:] + reach <= between).all()


@pytest.mark.parametrize("which", ["tangle", "fine_tangle"])
def test_a_list_that_is_extended_is_complete_and_has_nothing_twice(which, rng, request):
    """A few vertices, of the cloth and of the ball, are granted more, twice; the rest keep what they have."""
    tangle = request.getfixturevalue(which)
    sim = tangle.sim
    x = crumple(tangle, rng)
    tangle.set_motion(x, tangle.throw(rng, 0.004))
    search.search_along(sim, sim.state.x, sim.work.direction, 0.0)
    anchor = sim.region.anchor.numpy().astype(np.float64)
    before = sim.candidates.size
    for chosen in (rng.choice(tangle.cloth, 6), rng.choice(len(x), 30)):
        motion = anchor - x
        motion[chosen] += stray(rng, np.full(len(chosen), 0.012))
        sim.work.direction.assign(motion.astype(np.float32))
        sim.work.alpha.fill_(1.0)
        assert bounds.leaving(sim.state.x, sim.work.direction, sim.work.alpha, sim.region, sim.work.hits) > 0
        search.search_further(sim, sim.work.direction, sim.work.alpha)
        assert bounds.leaving(sim.state.x, sim.work.direction, sim.work.alpha, sim.region, sim.work.hits) == 0
        assert sim.candidates.size > before
        before = sim.candidates.size
    found = tangle.candidate_keys()
    assert len(found) == sim.candidates.size
    budget = sim.region.budget.numpy().astype(np.float64)
    closest = np.full(len(tangle.stencils[0]), np.inf)
    for _ in range(2 * SAMPLES):
        closest = np.minimum(closest, tangle.distances(anchor + stray(rng, budget)))
    check_complete(tangle, found, closest)


def test_no_list_is_taken_for_one_before_it():
    """Though it is as long, and may lie where that lay: graphs are kept by what tells them apart."""
    listed = candidates.Candidates.allocate(64, "cpu")
    rooms = 64, 64, 64
    listed.found = [Found.allocate(rooms, "cpu"), Found.allocate(rooms, "cpu")]
    assert listed.found[0].with_room(rooms) is listed.found[0]
    told = {listed.places}
    for k in range(8):
        if k % 2:
            listed.found[1] = Found.allocate(rooms, "cpu")
        else:
            listed = listed.of_room(64)
        told.add(listed.places)
    assert len(told) == 9


@pytest.mark.parametrize("settled", [False, True])
def test_what_is_not_listed_as_near_keeps_its_gap(tangle, rng, settled):
    """However the vertices use the travel they are allowed; and the distances stay below the true ones."""
    sim = tangle.sim
    x = crumple(tangle, rng)
    tangle.set_motion(x, np.zeros_like(x))
    search.search_around(sim, sim.state.x, sim.work.direction)
    travel = rng.uniform(0, 0.002, len(x))
    sim.filtering.travel.assign(travel.astype(np.float32))
    c = sim.candidates
    candidates.list_near(c, sim.state.x, sim.filtering.travel, tangle.cloth, sim.contact.sizes, settled)
    listed = np.zeros(c.size, bool)
    listed[c.near.numpy()[: c.near_size]] = True
    assert 100 < listed.sum() < c.size - 100
    kind, ids = c.kind.numpy()[: c.size], c.ids.numpy()[: c.size]
    start, _ = stencil_distances(kind, x[ids])
    xi = offsets(tangle, ids)
    known = c.distance.numpy()[: c.size]
    for _ in range(2 * SAMPLES):
        there, _ = stencil_distances(kind, (x + stray(rng, travel))[ids])
        assert (there - xi > sim.settings.d_hat - 1e-6)[~listed].all()
        assert (start - there < (start - xi) / candidates.MOST_USED + 1e-6)[~listed].all()
        if settled:
            assert (known < there + 1e-6)[~listed].all()
    assert (known < start + 1e-6).all()


def test_distance_stored_with_a_candidate_is_its_own(tangle, rng):
    sim = tangle.sim
    x = crumple(tangle, rng)
    tangle.set_motion(x, np.zeros_like(x))
    sim.candidates.distance.fill_(np.nan)
    search.search_around(sim, sim.state.x, sim.work.direction)
    c = sim.candidates
    expected, _ = stencil_distances(c.kind.numpy()[: c.size], x[c.ids.numpy()[: c.size]])
    np.testing.assert_allclose(c.distance.numpy()[: c.size], expected, rtol=0, atol=1e-7)


def listed(tangle, x):
    """Keys of the stencils that a search finds of the cloth at x."""
    tangle.set_motion(x, np.zeros_like(x))
    search.search_around(tangle.sim, tangle.sim.state.x, tangle.sim.work.direction)
    return tangle.candidate_keys()


def test_overflow_grows_the_list_and_drops_nothing(tangle, rng):
    """With room for sixteen stencils the search finds as many as with room for all."""
    sim = tangle.sim
    x = crumple(tangle, rng)
    everything = listed(tangle, x)
    assert len(everything) > 16
    sim.candidates.__dict__.update(candidates.Candidates.allocate(16, "cpu").__dict__)
    np.testing.assert_array_equal(listed(tangle, x), everything)


def test_room_that_many_lists_did_not_need_is_given_back_and_found_again(tangle, rng, monkeypatch):
    monkeypatch.setattr(candidates, "FILLINGS", 3)
    monkeypatch.setattr(found, "LEAST", 16)
    sim = tangle.sim
    crumpled = crumple(tangle, rng)
    apart = tangle.x + 1.0 * np.arange(len(tangle.x))[:, None]  # nothing is near anything
    everything = listed(tangle, crumpled)
    room = sim.candidates.capacity
    assert len(everything) > 16
    for _ in range(8):
        assert len(listed(tangle, apart)) == 0
    assert sim.candidates.capacity == 16 < room
    assert max(len(one.ids) for one in sim.candidates.found) == 16
    np.testing.assert_array_equal(listed(tangle, crumpled), everything)
    assert sim.candidates.capacity > 16


def test_room_that_is_not_needed_any_more_is_given_back_soon_where_that_is_known(tangle, rng, monkeypatch):
    monkeypatch.setattr(candidates, "SOON", 3)
    monkeypatch.setattr(found, "LEAST", 16)
    sim = tangle.sim
    apart = tangle.x + 1.0 * np.arange(len(tangle.x))[:, None]  # nothing is near anything
    assert len(listed(tangle, crumple(tangle, rng))) > 16
    for _ in range(8):
        listed(tangle, apart)
    assert sim.candidates.capacity > 16, "it may be needed again"
    sim.candidates.begin_anew()
    for _ in range(4):
        listed(tangle, apart)
    assert sim.candidates.capacity == max(len(one.ids) for one in sim.candidates.found) == 16


def test_vertices_to_be_sewn_together_are_no_candidates(rng):
    """Two corners of one group: stencils with both are left out, all others stay."""
    tangle = Tangle(columns=5, size=0.1)
    sim = tangle.sim
    x = crumple(tangle, rng)
    tangle.set_motion(x, np.zeros_like(x))
    search.search_around(sim, sim.state.x, sim.work.direction)
    kinds, ids = (each.copy() for each in tangle.candidates())
    a, b = 0, tangle.cloth // 2
    group = sim.group.numpy()
    group[b] = group[a]
    sim.group.assign(group)
    tangle.set_motion(x, np.zeros_like(x))
    search.search_around(sim, sim.state.x, sim.work.direction)
    together = (ids == a).any(axis=1) & (ids == b).any(axis=1)
    assert together.any()
    assert np.isin(stencil_keys(kinds, ids)[~together], tangle.candidate_keys()).all()
    assert not opposite(*tangle.candidates(), a, b).any()


@pytest.mark.parametrize("corner", range(3))
@pytest.mark.parametrize("faces", [(0, 2), (0, 3), (1, 2), (1, 3)])
def test_vertices_to_be_sewn_that_are_still_apart_hide_nothing(faces, corner):
    """Triangles that share the two are told apart by a plane through the one: here the other lies beyond it."""
    tangle = Tangle(columns=2, size=0.01)
    sim = tangle.sim
    above, below = (np.roll(sim.scene.garment.faces[face], -corner) for face in faces)
    group = sim.group.numpy()
    group[below[0]] = group[above[0]]
    sim.group.assign(group)
    x = tangle.x.copy()
    x[: tangle.cloth] = [[0.1 * k, 1.0, 0.0] for k in range(tangle.cloth)]
    x[above] = 1e-3 * np.array([[0, 0, 0], [20, 0, 10], [-20, 0, 10]])
    x[below] = 1e-3 * np.array([[20, 1, 10], [-30, 0, -10], [10, 0, -10]])
    x[tangle.cloth :] += [0.0, -1.0, 0.0]
    tangle.set_motion(x, np.zeros_like(x))
    search.search_around(sim, sim.state.x, sim.work.direction)
    near = tangle.distances(x) < sim.cloth.reach.farthest
    wanted = near & ~opposite(*tangle.stencils, above[0], below[0])
    assert wanted.any()
    assert np.isin(tangle.keys[wanted], tangle.candidate_keys()).all()


def opposite(kinds, ids, a, b):
    """(S,) bool: is vertex a on one side of the stencil and b on the other?"""
    side = np.arange(4) < np.where(kinds == 0, 1, 2)[:, None]
    is_a, is_b = ids == a, ids == b
    return np.logical_or(
        (is_a & side).any(axis=1) & (is_b & ~side).any(axis=1),
        (is_b & side).any(axis=1) & (is_a & ~side).any(axis=1),
    )


def test_a_far_direction_widens_the_search_by_a_few_edges_at_a_time_and_is_shortened_to_that(tangle, rng):
    """All at once a metre further: more would be in reach than any memory holds, in a finer mesh."""
    sim = tangle.sim
    tangle.set_motion(tangle.x, np.zeros_like(tangle.x))
    search.search_along(sim, sim.state.x, sim.work.direction, 0.0)
    before = sim.region.budget.numpy().copy()
    far = stray(rng, np.ones(len(tangle.x)))
    sim.work.direction.assign(far.astype(np.float32))
    sim.work.alpha.fill_(1.0)
    most = search.a_few_edges(sim, 1)
    search.search_further(sim, sim.work.direction, sim.work.alpha, most)
    assert np.allclose(sim.region.budget.numpy(), before + most)
    sim.work.alpha.fill_(1.0)
    bounds.stay_in_region(sim.state.x, sim.work.direction, sim.region, sim.work.alpha)
    gone = sim.work.alpha.numpy() * np.linalg.norm(far, axis=1)
    assert (gone <= before + most + 1e-6).all()
    assert gone.max() > 0.9 * most


@pytest.mark.parametrize("counted", [(1 << 29, 8, 8), (8, 1 << 29, 8), (8, 8, 1 << 29), (8, -5, 8), (8, 8, -5)])
def test_more_contacts_than_any_memory_holds_are_refused_with_what_to_change(counted):
    with pytest.raises(CrowdedError, match="shorter steps, a slower motion or a coarser mesh"):
        Found.allocate((8, 8, 8), "cpu").with_room(counted)


def test_an_extended_list_lacks_nothing_far_from_the_origin():
    """What is searched for anew, with budgets that were raised since, finds nothing that the extended list has not: a
    stencil at the edge of what the first search was of is not taken for listed."""
    garment, x = layers(3, 17, 17, 0.32, 9e-3)
    rng = np.random.default_rng(1)
    x = x + 1e-3 * rng.normal(size=x.shape) + [30.0, 300.0, 30.0]
    sim = build(Scene(garment, x, None, fabric(), (SelfContact(),)), PRESETS["live"], "cpu", tangled=True)
    still, searched = device_vectors(np.zeros((len(x), 3))), 0
    for _ in range(12):
        sim.state.x.assign((x + 1e-3 * rng.normal(size=x.shape)).astype(np.float32))
        sim.region.accompany(len(x), sim.state.x, still, sim.solved, 0.0, 2e-3)
        sim.candidates.clear()
        broad_phase.find(sim.candidates, scope(sim, sim.state.x))
        budgets = sim.region.budget.numpy()
        grown = rng.random(len(x)) < 0.3
        budgets[grown] += rng.uniform(0.002, 0.02, grown.sum()).astype(np.float32)
        sim.region.budget.assign(budgets)
        broad_phase.launch_extension(sim.candidates, scope(sim, sim.state.x))
        broad_phase.settle(sim.candidates, scope(sim, sim.state.x), found.counted(sim.candidates.found))
        extended = named(sim.candidates)
        sim.candidates.clear()
        broad_phase.find(sim.candidates, scope(sim, sim.state.x))
        anew = named(sim.candidates)
        assert np.isin(anew, extended).all()
        searched += len(anew)
    assert searched > 1_000_000


def named(listed):
    """Stencils by their vertices and kind, each once: (S,) int64."""
    ids, kind = listed.ids.numpy()[: listed.size], listed.kind.numpy()[: listed.size]
    assert ids.max() < 1000
    return np.unique(np.column_stack([kind, ids]) @ 1000 ** np.arange(5))
