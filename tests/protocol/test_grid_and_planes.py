"""Rounding to the grid, the moving origin, and the byte planes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from tryon_protocol import GRID, ProtocolError, check_grid
from tryon_protocol.grid import INT16_MAX, ORIGIN_STEP, follow, quantise
from tryon_protocol.planes import fits_int16, merge, split

ZERO = np.zeros(3)


@given(
    hnp.arrays(np.float64, st.tuples(st.integers(1, 9), st.just(3)), elements=st.floats(-1e5, 1e5)),
    hnp.arrays(np.float64, 3, elements=st.floats(-2e4, 2e4)),
)
def test_rounding_moves_no_coordinate_by_more_than_half_a_unit(positions: np.ndarray, shift: np.ndarray) -> None:
    given_positions = np.asfortranarray(positions)
    units = quantise(given_positions, GRID, shift, "cloth")
    assert units.dtype == np.int32
    np.testing.assert_array_equal(given_positions, positions)
    assert np.abs(GRID * units.T - (positions + shift)).max() <= GRID / 2 + 1e-9


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1.4e5, -1.4e5])
def test_a_position_off_the_grid_is_refused_by_its_number(value: float) -> None:
    positions = np.zeros((5, 3))
    positions[3, 1] = value
    with pytest.raises(ProtocolError) as caught:
        quantise(positions, GRID, ZERO, "cloth")
    assert (caught.value.code, caught.value.place) == ("unencodable_position", "cloth[3]")


@given(
    st.lists(
        st.tuples(st.integers(-(10**9), 10**9), st.integers(-(10**9), 10**9), st.integers(-(10**9), 10**9)),
        min_size=1,
        max_size=6,
    ),
    st.integers(0, 65000),
)
def test_the_origin_reaches_every_vertex_and_lies_on_its_steps(places: list[tuple[int, int, int]], span: int) -> None:
    origin = np.zeros(3, dtype=np.int64)
    for place in places:
        corner = np.array(place)[:, None]
        units = np.concatenate([corner, corner + np.array([[span], [span // 2], [0]])], axis=1).astype(np.int32)
        origin = follow(origin, units)
        assert (np.abs(units - origin[:, None]) <= INT16_MAX).all()
        assert not (origin % ORIGIN_STEP).any()


def test_the_origin_stays_while_the_garment_sways() -> None:
    origin = np.zeros(3, dtype=np.int64)
    for sway in (-9000, 9000, 0):
        units = np.array([[sway - 15000, sway + 15000]] * 3, dtype=np.int32)
        assert not follow(origin, units).any()
    moved = follow(origin, np.array([[20000, 30000]] * 3, dtype=np.int32))
    assert moved.tolist() == [24832, 24832, 24832]


def test_a_garment_wider_than_int16_is_refused_with_its_axis() -> None:
    units = np.array([[0, 5], [0, 70000], [0, 5]], dtype=np.int32)
    with pytest.raises(ProtocolError, match="along y") as caught:
        follow(np.zeros(3, dtype=np.int64), units)
    assert caught.value.code == "cloth_too_large"


def test_a_grid_that_could_close_the_gap_is_refused() -> None:
    check_grid(GRID, 5e-4)
    for grid, thickness in ((GRID, 1e-4), (GRID, np.sqrt(3) * GRID), (2e-4, 1e-2)):
        with pytest.raises(ProtocolError) as caught:
            check_grid(grid, thickness)
        assert caught.value.code == "grid_too_coarse"


@given(hnp.arrays(np.int32, st.tuples(st.just(3), st.integers(0, 20)), elements=st.integers(-32768, 32767)))
def test_planes_bring_back_every_number(values: np.ndarray) -> None:
    data = split(values)
    assert len(data) == 2 * values.size
    np.testing.assert_array_equal(merge(data, values.shape[1]), values)


def test_planes_are_laid_out_as_documented() -> None:
    values = np.array([[1, -1], [300, 0], [-32768, 32767]], dtype=np.int32)
    zigzag = [2, 1, 600, 0, 65535, 65534]
    assert split(values) == bytes(z & 255 for z in zigzag) + bytes(z >> 8 for z in zigzag)


def test_int16_is_told_from_more() -> None:
    assert fits_int16(np.array([[32767, -32767]], dtype=np.int32))
    assert not fits_int16(np.array([[32768]], dtype=np.int32))
    assert not fits_int16(np.array([[-40000]], dtype=np.int32))
