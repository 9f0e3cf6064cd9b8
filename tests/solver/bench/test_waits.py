"""The bench counts what the host waits for."""

import sys
from pathlib import Path

import warp as wp

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "solver" / "bench"))

from waits import Waits  # noqa: E402

from tryon_solver.linalg import read_back  # noqa: E402
from tryon_solver.linalg.launch import launch  # noqa: E402

wp.set_module_options({"enable_backward": False})


@wp.kernel
def count_down_kernel(left: wp.array(dtype=wp.int32)):
    left[0] = left[0] - 1


def a_frame(device):
    """Two readings, an array read by itself, and a loop of three turns; what became of them."""
    left = wp.array([3], dtype=wp.int32, device=device)
    first, second = read_back.read(left)[0], read_back.read(left, left)[1]
    alone = left.numpy().copy()
    wp.capture_while(left, lambda: launch(count_down_kernel, 1, [], [left], device=device))
    return [int(value[0]) for value in (first, second, alone)]


def test_what_is_waited_for_is_counted_and_the_next_frame_begins_at_none(device):
    """Of a GPU readings, whatever their number of arrays, the array, and a look before each turn and after the last."""
    waits = Waits(device)
    own = read_back.wait, wp.array.numpy, wp.capture_while
    for _ in range(2):
        with waits.counted():
            assert a_frame(device) == [3, 3, 3]
        assert waits.count == (0 if device == "cpu" else 2 + 1 + 4)
    assert (read_back.wait, wp.array.numpy, wp.capture_while) == own


def test_loops_and_readings_are_told_apart_from_what_a_processor_does():
    """As of a GPU, with a processor's arrays, which nobody waits for."""
    waits = Waits("cpu")
    waits._on_gpu = True
    with waits.counted():
        assert a_frame("cpu") == [3, 3, 3]
    assert waits.count == 2 + 4
