"""Distinct rows are numpy's, in numpy's order."""

import numpy as np
import pytest

from tryon_solver.geometry.distinct import distinct


@pytest.mark.parametrize("width", [2, 3])
@pytest.mark.parametrize("count", [0, 1, 500])
def test_as_numpy_has_them(width, count):
    rows = np.random.default_rng(width).integers(0, 9, (count, width)).astype(np.int32)
    asked = {"return_index": True, "return_inverse": True, "return_counts": True}
    wanted = np.unique(rows, axis=0, **asked)
    for one, other in zip(distinct(rows), wanted):
        np.testing.assert_array_equal(one, other.reshape(one.shape))
    assert distinct(rows).rows.dtype == rows.dtype


def test_what_63_bits_do_not_tell_apart_is_refused():
    with pytest.raises(OverflowError, match="too large"):
        distinct(np.array([[2**40, 0, 2**40]]))
