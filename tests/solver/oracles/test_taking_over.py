"""What the broad phase has found is put on the list by the device as the host would, or not at all."""

import numpy as np
import pytest

from tryon_solver.contact.candidates import Candidates
from tryon_solver.contact.found import CLOSE, PAIRS, STENCILS, Found
from tryon_solver.contact.taking_over import take_over

LISTED, ROOM, CAPACITY = 5, 64, 128


def found(rng, stencils, pairs, device, close=ROOM // 2):
    """So many stencils with numbers of their own, of so many pairs of triangles, `close` of them."""
    one = Found.allocate((ROOM, ROOM // 2, ROOM), device)
    one.ids.assign(rng.integers(0, 99, (ROOM, 4)).astype(np.int32))
    one.kind.assign(rng.integers(0, 2, ROOM).astype(np.int32))
    one.distance.assign(rng.uniform(0, 1, ROOM).astype(np.float32))
    counts = np.zeros(3, np.int32)
    counts[int(PAIRS)], counts[int(CLOSE)], counts[int(STENCILS)] = pairs, close, stencils
    one.counts.assign(counts)
    return one


def lists(device):
    """A list that the host appends to, and one for the device, the same so far."""
    made = []
    for _ in range(2):
        candidates = Candidates.allocate(CAPACITY, device)
        candidates.append(found(np.random.default_rng(1), LISTED, LISTED, device), LISTED)
        made.append(candidates)
    return made


def rows(candidates, count):
    return [getattr(candidates, name).numpy()[:count] for name in ("ids", "kind", "distance")]


def test_the_device_appends_what_the_host_would(device, rng):
    by_host, by_device = lists(device)
    both = [found(rng, 40, 63, device), found(rng, 64, 64, device)]
    for one, count in zip(both, (40, 64), strict=True):
        by_host.append(one, count)
    take_over(by_device, both)
    assert by_device.fits.numpy()[0] == 1
    assert by_device.count.numpy()[0] == by_host.size == LISTED + 104
    for one, other in zip(rows(by_host, by_host.size), rows(by_device, by_host.size), strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("lacking", [(65, 10, 8), (10, 65, 8), (10, -3, 8), (-3, 10, 8), (10, 10, 33), (10, 10, -3)])
@pytest.mark.parametrize("which", [0, 1])
def test_of_what_lacks_room_nothing_is_taken(device, rng, lacking, which):
    """Room for its pairs of triangles, for its stencils, for pairs that are close, or one of them counted beyond what a
    counter holds."""
    _, by_device = lists(device)
    before = rows(by_device, CAPACITY)
    both = [found(rng, 10, 10, device), found(rng, 10, 10, device)]
    both[which] = found(rng, lacking[1], lacking[0], device, lacking[2])
    take_over(by_device, both)
    assert by_device.fits.numpy()[0] == 0
    assert by_device.count.numpy()[0] == LISTED
    for one, other in zip(before, rows(by_device, CAPACITY), strict=True):
        np.testing.assert_array_equal(one, other)


def test_of_more_than_the_list_holds_nothing_is_taken(device, rng):
    _, by_device = lists(device)
    take_over(by_device, [found(rng, 64, 64, device), found(rng, 60, 60, device)])
    assert by_device.fits.numpy()[0] == 0
    assert by_device.count.numpy()[0] == LISTED
