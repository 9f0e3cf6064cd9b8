"""A launch that was packed before does what it is told now, and holds nobody's memory."""

import gc
import weakref
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import warp as wp

from tryon_solver.linalg import launch as module
from tryon_solver.linalg.launch import launch, launch_blocks

wp.set_module_options({"enable_backward": False})


@wp.struct
class Line:
    slope: float
    offsets: wp.array(dtype=wp.float32)


@wp.kernel
def line_kernel(x: wp.array(dtype=wp.float32), line: Line, plus: int, out: wp.array(dtype=wp.float32)):
    i = wp.tid()
    out[i] = line.slope * x[i] + line.offsets[0] + float(plus)


@wp.kernel
def number_kernel(plus: int, out: wp.array2d(dtype=wp.int32)):
    block, thread = wp.tid()
    out[block, thread] = 10 * block + thread + plus


def line_of(slope, offset):
    line = Line()
    line.slope, line.offsets = slope, floats([offset])
    return line


def floats(values):
    return wp.array(np.asarray(values, np.float32), device="cpu")


def told(x, line, plus, out, dim=None):
    launch(line_kernel, len(x) if dim is None else dim, [x, line, plus], [out], device="cpu")
    return out.numpy().tolist()


def test_what_is_told_anew_counts():
    x, out, line = floats([1, 2, 3]), floats([np.nan] * 3), line_of(2.0, 0.5)
    assert told(x, line, 0, out) == [2.5, 4.5, 6.5]
    assert told(x, line, 1, out) == [3.5, 5.5, 7.5]
    line.slope = 0.0
    assert told(x, line, 1, out) == [1.5] * 3
    line.offsets = floats([7.0])
    assert told(x, line, 1, out) == [8.0] * 3
    assert told(x, line_of(1.0, 0.0), 0, out) == [1.0, 2.0, 3.0]
    out.fill_(-1.0)
    assert told(x, line, 1, out, dim=2) == [8.0, 8.0, -1.0]
    assert told(x, line, 2, out, dim=0) == [8.0, 8.0, -1.0]


@pytest.mark.parametrize("dims", [(1, 4, 2, 0, 3), ((3, 1), 2, (2, 2), 4, (4,)), (4, 2**31 + 1, 1), (4, -1, 1)])
def test_a_launch_of_other_threads_than_before_is_of_those(dims):
    """Whether there are more or fewer, in one dimension or in two, of which the kernel knows but one."""
    x, line = floats(range(4)), line_of(1.0, 0.0)
    out = floats([np.nan] * 4)
    for dim in dims:
        out.fill_(-1.0)
        if dim in (2**31 + 1, -1):
            with pytest.raises(ValueError, match=r"dim|extent"):
                told(x, line, 0, out, dim=dim)
            continue
        seen = told(x, line, 0, out, dim=dim)
        many = dim[0] if isinstance(dim, tuple) else dim
        assert seen == [0.0, 1.0, 2.0, 3.0][:many] + [-1.0] * (4 - many)


def test_other_arrays_and_parts_of_one_are_told_apart():
    every, out, line = floats(range(6)), floats([np.nan] * 2), line_of(1.0, 0.0)
    assert told(every[0:2], line, 0, out) == [0.0, 1.0]
    assert told(every[2:4], line, 0, out) == [2.0, 3.0]
    assert told(every[2:6:2], line, 0, out) == [2.0, 4.0]
    for value in range(50):  # each in memory that the one before had, or not
        assert told(floats([value, value]), line, 0, out) == [value, value]


def test_a_launch_is_packed_once_and_holds_no_array(monkeypatch):
    monkeypatch.setattr(module, "_packed", {})  # else arrays of a test before, in the same places, may have packed it
    x, out = floats([1.0, 2.0]), floats([0.0, 0.0])
    packed = []
    ordinary = wp.launch

    def counted(*arguments, **named):
        packed.append(arguments[0])
        return ordinary(*arguments, **named)

    monkeypatch.setattr(wp, "launch", counted)
    lines = [line_of(1.0, 0.0) for _ in range(5)]
    for plus, line in enumerate(lines):
        told(x, line, plus, out)
    assert packed == [line_kernel]
    seen = [weakref.ref(array) for array in (x, out, *(line.offsets for line in lines))]
    del x, out, line, lines
    gc.collect()
    assert [array() for array in seen] == 7 * [None]


def test_no_more_are_kept_than_said(monkeypatch):
    monkeypatch.setattr(module, "PACKS_KEPT", 8)
    monkeypatch.setattr(module, "_packed", {})
    x, line = floats(range(40)), line_of(1.0, 0.0)
    for k in range(30):
        out = floats([np.nan])
        assert told(x[k : k + 1], line, 0, out) == [k]
        assert len(module._packed) <= 8


def test_blocks_are_single_threads_on_a_processor():
    out = wp.full((3, 1), -1, dtype=wp.int32, device="cpu")
    launch_blocks(number_kernel, 3, [5], [out], device="cpu", block_dim=64)
    assert out.numpy().tolist() == [[5], [15], [25]]


@pytest.mark.parametrize("_round", range(3))
def test_two_threads_may_be_the_first_to_launch_a_kernel(_round):
    """Each of a module that was never loaded: what one loads must not be unloaded by the other."""

    def fresh():
        @wp.kernel(module="unique")
        def add_kernel(x: wp.array(dtype=wp.float32), plus: float, out: wp.array(dtype=wp.float32)):
            i = wp.tid()
            out[i] = x[i] + plus

        return add_kernel

    kernel, n = fresh(), 200_000
    x, outs = floats(np.arange(n)), [floats(np.full(n, np.nan)) for _ in range(2)]
    with ThreadPoolExecutor(2) as threads:
        list(threads.map(lambda k: launch(kernel, n, [x, float(k)], [outs[k]], device="cpu"), range(2)))
    for k in range(2):
        np.testing.assert_array_equal(outs[k].numpy(), np.arange(n, dtype=np.float32) + k)
