"""What is kept of each frame of a bench takes no memory while it is kept, and tells growth of the frames there were."""

import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "solver" / "bench"))

from frame_record import STAGES, FrameRecord  # noqa: E402
from measure import give_back_freed, memory  # noqa: E402

from tryon_solver.results import StepReport  # noqa: E402

READ_FROM_PROC = pytest.mark.skipif(
    not Path("/proc/self/statm").exists(), reason="what a process holds is read from /proc"
)


def report(k, **times):
    """Of frame k, each figure another."""
    return StepReport(
        time=0.1 * k,
        steps=1,
        substeps=1 + k % 2,
        iterations=2,
        newton_iterations=3 + k,
        residual=0.0,
        min_gap=1e-4 * (k + 1),
        max_stretch=1.0 + 0.01 * k,
        body_lag=1e-3 * k,
        pairs=100 * k,
        overlapping=0,
        retries=k // 2,
        debt=0.0,
        error=1e-5 * k,
        times_ms=times,
    )


def filled(count, room=10):
    """`count` frames, after each of which 2 MiB more are held of the one memory and 0.5 of the other."""
    held = {"process": 50.0, "device": 7.0}
    record = FrameRecord(room, lambda: held)
    for k in range(count):
        held.update(process=52.0 + 2 * k, device=7.5 + 0.5 * k)
        record.add(10.0 + k, k, report(k, move_body=1.0 + k))
    return record


def test_figures_come_back_frame_by_frame():
    record = filled(4)
    assert len(record) == 4
    assert record["time_ms"].tolist() == [10, 11, 12, 13]
    assert record["waits"].tolist() == [0, 1, 2, 3]
    assert record["newton_iterations"].tolist() == [3, 4, 5, 6]
    np.testing.assert_allclose(record["min_gap"], [1e-4, 2e-4, 3e-4, 4e-4])
    assert {name: times.tolist() for name, times in record.stages().items()} == {"move_body": [1, 2, 3, 4]}


def test_a_stage_that_comes_later_took_no_time_before():
    record = filled(2)
    record.add(12.0, 0, report(2, move_body=3.0, verify_commit=0.5))
    assert record.stages()["verify_commit"].tolist() == [0, 0, 0.5]


@pytest.mark.parametrize("played", [4, 5, 10])
def test_growth_is_that_of_the_frames_that_were_played(played):
    """Also where fewer were than there is room for."""
    record = filled(played)
    assert record.growth() == {"process": 2.0 * played, "device": 0.5 * played}
    late = played - played // 2
    assert record.late_growth() == {"process": 2.0 * late, "device": 0.5 * late}


def test_what_was_held_at_most_is_told_though_it_is_gone():
    held = {"process": 50.0}
    record = FrameRecord(3, lambda: held)
    for k, most in enumerate((51.0, 177.0, 40.0)):
        held["process"] = most
        record.add(10.0, 0, report(k))
    assert record.most_growth() == {"process": 127.0}
    assert record.growth() == {"process": -10.0}


def test_a_frame_alone_has_no_second_half():
    assert filled(1).growth() == {"process": 2.0, "device": 0.5}
    assert filled(1).late_growth() == {}


def test_keeping_frames_takes_no_memory():
    """As the bench tells the growth of who is measured, whatever stages come and go."""
    frames = 20_000
    record = FrameRecord(frames, lambda: {"process": 0.0})
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        for k in range(frames):
            record.add(1.0, 2, report(k % 7, **{f"stage_{k * STAGES // frames}": 1.0}))
        grown = tracemalloc.get_traced_memory()[0] - before
    finally:
        tracemalloc.stop()
    assert len(record.stages()) == STAGES
    assert grown < 64 * 1024  # a column alone has 160,000 bytes


@READ_FROM_PROC
def test_the_record_itself_is_no_growth():
    """Of what the process really holds, of which it takes 73 MB here."""
    record = FrameRecord(200_000, lambda: memory("cpu"))
    record.add(1.0, 2, report(0, move_body=1.0))
    assert abs(record.growth()["process"]) < 8


@READ_FROM_PROC
def test_growth_is_found_where_memory_was_free():
    """An allocator keeps what is freed, in which 40 MB of growth would have room."""
    freed = [bytes(4096) for _ in range(15_000)]
    above = bytes(4096)  # so that the heap doesn't shrink by itself
    del freed
    give_back_freed()
    record = FrameRecord(10, lambda: memory("cpu"))
    grown = [bytearray(4096) for _ in range(10_000)]
    record.add(1.0, 2, report(0, move_body=1.0))
    give_back_freed()
    assert 35 < record.growth()["process"] < 50
    del grown, above
    give_back_freed()
    assert record.growth()["process"] < 8
