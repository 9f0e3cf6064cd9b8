"""What contacts have given is found again by their vertices, and only there."""

import numpy as np
import pytest
import warp as wp

from tryon_solver.effects.presliding import Presliding, recall
from tryon_solver.effects.slip import SlipOfPairs
from tryon_solver.linalg.order_free import OrderFreeSums

UNKNOWN = [7, 8, 9, 1_000_000]


@wp.kernel
def recall_kernel(
    asked: wp.array(dtype=wp.vec4i),
    table: wp.array(dtype=wp.int32),
    ids: wp.array(dtype=wp.vec4i),
    given: wp.array(dtype=wp.vec3),
    out: wp.array(dtype=wp.vec3),
):
    i = wp.tid()
    out[i] = recall(asked[i], table, ids, given)


def recalled(known, asked):
    out = wp.full(len(asked), wp.vec3(np.nan), dtype=wp.vec3, device="cpu")
    entries = wp.array(asked, dtype=wp.vec4i, device="cpu")
    wp.launch(recall_kernel, len(asked), [entries, known.table, known.ids, known.given], [out], device="cpu")
    return out.numpy()


def contacts(rng, count):
    """Distinct contacts of few vertices, so that most differ in a number or in the order alone, and what they gave."""
    ids = np.unique(rng.integers(0, 12, (8 * count, 4)), axis=0)
    assert len(ids) >= count
    return rng.permutation(ids)[:count].astype(np.int32), rng.normal(size=(count, 3)).astype(np.float32)


def known_of(ids, given, capacity, count=None):
    known = Presliding.allocate(capacity, "cpu")
    number = wp.array([len(ids) if count is None else count], dtype=wp.int32, device="cpu")
    slip = wp.array(given, dtype=wp.vec3, device="cpu")
    known.replace_by(number, wp.array(ids, dtype=wp.vec4i, device="cpu"), slip)
    return known


@pytest.mark.parametrize("count", [1, 16, 1000, 1024])
def test_each_contact_has_its_own(rng, count):
    """As many as there is room for."""
    ids, given = contacts(rng, count)
    known = known_of(ids, given, 1024)
    order = rng.permutation(count)
    np.testing.assert_array_equal(recalled(known, ids[order]), given[order])
    np.testing.assert_array_equal(recalled(known, [UNKNOWN, ids[0][[1, 0, 2, 3]] + 12]), np.zeros((2, 3)))


def test_what_was_known_before_is_forgotten(rng):
    ids, given = contacts(rng, 200)
    known = known_of(ids[:100], given[:100], 128)
    count = wp.array([50], dtype=wp.int32, device="cpu")
    arrays = wp.array(ids[100:], dtype=wp.vec4i, device="cpu"), wp.array(given[100:], dtype=wp.vec3, device="cpu")
    known.replace_by(count, *arrays)
    np.testing.assert_array_equal(recalled(known, ids[100:150]), given[100:150])
    assert not recalled(known, ids[:100]).any()
    assert not recalled(known, ids[150:]).any()  # beyond the count


def test_the_order_of_entry_does_not_matter(rng):
    ids, given = contacts(rng, 500)
    order = rng.permutation(500)
    first, other = known_of(ids, given, 512), known_of(ids[order], given[order], 512)
    np.testing.assert_array_equal(recalled(first, ids), recalled(other, ids))


def test_of_two_with_the_same_numbers_that_counts_which_has_given_more(rng):
    """A vertex with a triangle, and two edges, whichever was entered first."""
    ids, given = contacts(rng, 300)
    twice, more = np.vstack([ids, ids]), np.vstack([given, 1.5 * given])
    for order in (rng.permutation(600), rng.permutation(600)):
        np.testing.assert_array_equal(recalled(known_of(twice[order], more[order], 1024), ids), more[300:])
    mirrored = given * np.float32([1, 1, -1])  # as long
    found = [recalled(known_of(twice, np.vstack(both), 1024), ids) for both in ((given, mirrored), (mirrored, given))]
    np.testing.assert_array_equal(*found)


def test_more_room_keeps_what_is_known(rng):
    ids, given = contacts(rng, 60)
    held = SlipOfPairs(64, 1e-4, OrderFreeSums(1, "cpu"), "cpu")
    held.restore(ids, given)
    held.known.replace_by(*held.ended)
    held.make_room(256)
    assert len(held.weight) == len(held.known.ids) == 256
    np.testing.assert_array_equal(recalled(held.known, ids), given)
    for kept, expected in zip(held.kept(), (ids, given)):
        np.testing.assert_array_equal(kept, expected)


def test_more_is_restored_than_there_was_room_for(rng):
    ids, given = contacts(rng, 300)
    held = SlipOfPairs(16, 1e-4, OrderFreeSums(1, "cpu"), "cpu")
    held.restore(ids, given)
    for kept, expected in zip(held.kept(), (ids, given)):
        np.testing.assert_array_equal(kept, expected)
    held.restore(ids[:0], given[:0])
    assert not len(held.kept()[0])
