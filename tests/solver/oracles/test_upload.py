"""What is written for the device is what it fetches, whenever it gets to it, and however often in a graph."""

import numpy as np
import pytest
import warp as wp

from tryon_solver.linalg.device_loop import KeptGraph
from tryon_solver.linalg.rigid_motion import mat34
from tryon_solver.linalg.side_by_side import side_by_side
from tryon_solver.linalg.upload import Upload

COUNT = 1000


@pytest.mark.parametrize(("kind", "shape"), [(mat34, (3, 4)), (wp.vec3d, (3,)), (wp.float32, ())])
def test_what_is_fetched_is_what_was_written(device, kind, shape):
    """Also into a part of an array, whose other part stays as it is."""
    whole = wp.full(COUNT + 1, -1.0 if not shape else kind(-1.0), dtype=kind, device=device)
    upload = Upload(whole[1:])
    for k in range(3):
        values = np.random.default_rng(k).normal(size=(COUNT, *shape)).astype(np.float32)
        upload.write(values)
        upload.fetch()
        np.testing.assert_array_equal(whole.numpy()[1:], values)
        assert (whole.numpy()[0] == -1.0).all()


def test_nothing_is_written_over_before_it_is_fetched(device):
    """By a graph that is launched again and again, with nobody who waits for it, and that comes to it long after a
    processor has gone on."""
    array = wp.zeros(COUNT, dtype=wp.float32, device=device)
    sums, upload, graph = wp.zeros(COUNT, dtype=wp.float32, device=device), Upload(array), KeptGraph()
    spun = wp.zeros(1, dtype=wp.float32, device=device)

    def body():
        wp.launch(spin_kernel, 1, [20000 if device != "cpu" else 1], [spun], device=device)  # some ms
        upload.fetch()
        wp.launch(add_kernel, COUNT, [array], [sums], device=device)

    for k in range(200):
        upload.write(np.full(COUNT, float(k), np.float32))
        graph.run(body, None, device)
    np.testing.assert_array_equal(sums.numpy(), np.full(COUNT, 200 * 199 / 2, np.float32))


def test_two_branches_follow_what_was_before_and_come_before_what_follows(device):
    """A thousand times in one graph."""
    a, b, both = (wp.zeros(COUNT, dtype=wp.float32, device=device) for _ in range(3))
    one = wp.full(COUNT, 1.0, dtype=wp.float32, device=device)

    def body():
        for _ in range(1000):
            side_by_side(device, lambda: add(both, a), lambda: add(one, b))
            wp.copy(both, b)

    def add(more, total):
        wp.launch(add_kernel, COUNT, [more], [total], device=device)

    KeptGraph().run(body, None, device)
    np.testing.assert_array_equal(b.numpy(), np.full(COUNT, 1000.0, np.float32))
    np.testing.assert_array_equal(a.numpy(), np.full(COUNT, 1000.0 * 999.0 / 2.0, np.float32))


@wp.kernel
def spin_kernel(times: int, out: wp.array(dtype=wp.float32)):
    total = out[0]
    for k in range(times):
        total = wp.sin(total) + float(k)
    out[0] = total


@wp.kernel
def add_kernel(more: wp.array(dtype=wp.float32), total: wp.array(dtype=wp.float32)):
    i = wp.tid()
    total[i] = total[i] + more[i]
