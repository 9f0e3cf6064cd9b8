"""What one process hands over to another comes as it was, and is then each one's own."""

import os
from multiprocessing import Pipe
from threading import Thread

import numpy as np
import pytest

from tryon_server.runtime import handed_over

LARGE = 3_000_000  # numbers: many times what a pipe takes at once


def handed(value):
    here, there = Pipe()
    sending = Thread(target=handed_over.send, args=(there, value))
    sending.start()
    came = handed_over.receive(here)
    sending.join()
    here.close()
    there.close()
    return came


def test_arrays_of_any_kind_come_as_they_were():
    rng = np.random.default_rng(1)
    value = {
        "large": rng.standard_normal(LARGE),
        "odd": rng.integers(0, 200, 13).astype(np.uint8),
        "none": np.zeros((0, 3)),
        "by columns": np.asfortranarray(rng.standard_normal((5, 7))),
        "strided": rng.standard_normal((40, 4))[::3, 1:],
        "words": ("a", None, 3),
    }
    came = handed(value)
    assert came.keys() == value.keys()
    for name, array in value.items():
        if isinstance(array, np.ndarray):
            assert (came[name].dtype, came[name].shape) == (array.dtype, array.shape)
            np.testing.assert_array_equal(came[name], array)
    assert came["words"] == value["words"]
    assert came["large"].flags.aligned


@pytest.mark.parametrize("value", [None, 42, {"empty": np.zeros(0)}.copy])
def test_what_has_no_arrays_comes_too(value):
    if callable(value):
        assert handed(value())["empty"].shape == (0,)
    else:
        assert handed(value) == value


def test_what_is_written_to_it_stays_here():
    array = np.zeros(LARGE)
    came = handed(array)
    came[:] = 1.0
    assert not array.any()


def test_no_descriptor_is_left_open():
    handed(np.zeros(LARGE))
    before = len(os.listdir("/proc/self/fd"))
    kept = [handed(np.zeros(LARGE)) for _ in range(5)]
    assert len(os.listdir("/proc/self/fd")) == before + len(kept), "a map keeps one of its own"
    kept.clear()
    assert len(os.listdir("/proc/self/fd")) == before


def test_the_end_of_the_other_process_is_told():
    here, there = Pipe()
    there.send((b"", [8]))  # and no memory
    there.close()
    with pytest.raises(EOFError):
        handed_over.receive(here)
