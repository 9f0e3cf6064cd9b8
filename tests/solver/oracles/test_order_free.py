"""Sums in whole numbers are the same in whatever order is added, and as near to the true ones as floats are."""

import numpy as np
import pytest
import warp as wp

from tryon_solver.linalg.order_free import (
    add,
    add_matrix,
    add_number,
    settle_blocks_kernel,
    settle_kernel,
    settle_numbers_kernel,
)

ADDED, PLACES = 4000, 7


@wp.kernel
def add_vectors_kernel(
    at: wp.array(dtype=wp.int32),
    values: wp.array(dtype=wp.vec3),
    sums: wp.array(dtype=wp.vec3),
    whole: wp.array(dtype=wp.int64),
):
    k = wp.tid()
    add(sums, whole, at[k], values[k])


@wp.kernel
def add_numbers_kernel(
    at: wp.array(dtype=wp.int32),
    values: wp.array(dtype=wp.float32),
    sums: wp.array(dtype=wp.float32),
    whole: wp.array(dtype=wp.int64),
):
    k = wp.tid()
    add_number(sums, whole, at[k], values[k])


@wp.kernel
def add_matrices_kernel(
    at: wp.array(dtype=wp.int32),
    values: wp.array(dtype=wp.mat33),
    sums: wp.array(dtype=wp.mat33),
    whole: wp.array(dtype=wp.int64),
):
    k = wp.tid()
    add_matrix(sums, whole, at[k], values[k])


KINDS = {
    "vectors": (wp.vec3, (3,), add_vectors_kernel, settle_kernel),
    "numbers": (wp.float32, (), add_numbers_kernel, settle_numbers_kernel),
    "matrices": (wp.mat33, (3, 3), add_matrices_kernel, settle_blocks_kernel),
}


def summed(kind, at, values, order, whole_places):
    """By a processor, in that order, on top of ones; `whole_places` for each sum, or none."""
    dtype, shape, adding, settling = KINDS[kind]
    sums = wp.array(np.ones((PLACES, *shape), np.float32), dtype=dtype, device="cpu")
    of_each = {(): 1, (3,): 3, (3, 3): 6}[shape]  # a matrix is symmetric
    whole = wp.zeros(PLACES * of_each * whole_places, dtype=wp.int64, device="cpu")
    given = wp.array(at[order], dtype=wp.int32, device="cpu"), wp.array(values[order], dtype=dtype, device="cpu")
    wp.launch(adding, ADDED, [*given, sums, whole], device="cpu")
    if whole_places:
        assert (sums.numpy() == 1).all()
        wp.launch(settling, PLACES, [whole, sums], device="cpu")
        assert not whole.numpy().any()
    return sums.numpy()


@pytest.mark.parametrize("kind", KINDS)
def test_no_order_matters(rng, kind):
    """Numbers of six magnitudes and both signs, with which floats end elsewhere."""
    shape = KINDS[kind][1]
    values = (rng.normal(size=(ADDED, *shape)) * 10.0 ** rng.uniform(-3, 3, (ADDED, *shape))).astype(np.float32)
    if kind == "matrices":
        values = values + values.transpose(0, 2, 1)
    at = rng.integers(0, PLACES, ADDED).astype(np.int32)
    orders = np.arange(ADDED), rng.permutation(ADDED)
    floats = [summed(kind, at, values, order, 0) for order in orders]
    whole = [summed(kind, at, values, order, 1) for order in orders]
    assert (floats[0] != floats[1]).any()
    np.testing.assert_array_equal(whole[0], whole[1])
    exact, size = np.ones((PLACES, *shape)), np.zeros((PLACES, *shape))
    np.add.at(exact, at, values.astype(np.float64))
    np.add.at(size, at, np.abs(values.astype(np.float64)))
    assert (np.abs(whole[0] - exact) <= 1e-6 * size).all()
    assert np.abs(whole[0] - exact).max() <= np.abs(floats[0] - exact).max()
