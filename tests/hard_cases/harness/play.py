"""Plays a case and has what is asked of it written down, frame by frame."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from frame_judge import principal_stretches

from harness.oracle import Oracle
from harness.recording import Recording
from harness.scene import Worn
from harness.subject import Subject
from harness.witness import Witness

Tell = Callable[[str], None]
Watch = Callable[[np.ndarray, np.ndarray], None]
Tracked = Callable[[], np.ndarray]


def play(
    subject: Subject,
    dt: float,
    seconds: float,
    every: int = 1,
    worn: Worn | None = None,
    noise: bool = False,
    tracked: Tracked | None = None,
    tell: Tell = print,
    watch: Watch | None = None,
) -> Recording:
    """Run for so long; ipctk is asked about every `every`-th frame, the way to it, and the last one.

    With `noise` the surface is kept as well, so that what noise does to both can be measured. `tracked` says where a
    tracker has told the skin (B, 3) m to be last; `watch` is shown cloth and surface of every frame.
    """
    x, surface = subject.cloth(), subject.surface()
    oracle = Oracle(subject.faces, subject.body_faces, x, surface)
    limits = subject.strain_limits
    varied = bool((limits != limits[0]).any())
    record = Recording(dt, 1.0 if varied else float(limits[0]), subject.total_mass)
    count = max(1, round(seconds / dt))
    passes, places = (None, None) if worn is None else worn.loops.crossings(x.astype(np.float64), worn.joints_at(0.0))
    subject.moves()
    witness = Witness(record, oracle, subject.offsets, every, count)
    if watch is not None:
        watch(x, surface)
    note_state(record, x, subject, limits if varied else np.ones(len(limits)))
    record.work.append(0.0)
    witness.begin((x, surface))
    for k in range(1, count + 1):
        begun, spent = time.perf_counter(), time.process_time()
        try:
            report = subject.advance(k * dt)
        except Exception as error:  # whatever a step raises is this case's failure
            record.failure = f"frame {k}: {type(error).__name__}: {error}"
            break
        record.ms.append(1e3 * (time.perf_counter() - begun))
        record.cpu_ms.append(1e3 * (time.process_time() - spent))
        before = x, surface
        x, surface = subject.cloth(), subject.surface()
        unmoved = np.array_equal(x, before[0])
        same = unmoved and np.array_equal(surface, before[1])
        if same and report.asleep:  # an hour of sleep is one frame to keep and to ask about
            x, surface = before
        if watch is not None:
            watch(x, surface)
        if not subject.leads(np.vstack(before), np.vstack([x, surface])):
            record.leaps.append(k)
        witness.see(k, (x, surface), same, report, subject.moves())
        if not (np.isfinite(x).all() and np.isfinite(surface).all()):
            record.failure = f"frame {k}: a position is not a finite number"
            break
        note_state(record, x, subject, limits if varied else np.ones(len(limits)))
        record.unmoved.append(unmoved)
        record.work.append(record.work[-1] + subject.work())
        skin = subject.skin(k * dt)
        if noise:
            record.surface.append(surface)
        record.told_lag.append(report.body_lag)
        if tracked is not None:
            record.off_tracker.append(largest_distance(surface, tracked()))
        record.lag.append(report.body_lag if skin is None else largest_distance(surface, skin))
        record.told_stretch.append(report.max_stretch)
        record.asleep.append(report.asleep)
        record.worked.append(report.steps)
        record.retries.append(report.retries)
        record.reverts.append(report.reverts)
        record.advice.append(report.advice)
        record.min_gap.append(report.min_gap)
        record.pairs.append(report.pairs)
        if worn is not None:
            now, where = worn.loops.crossings(x.astype(np.float64), worn.joints_at(k * dt))
            record.worn.append(bool((now == passes).all()))
            slid = [worn.loops.slide(a, b) for a, b in zip(places, where)]
            record.slid.append(max((s for i, s in enumerate(slid) if i != worn.lowest), default=0.0))
        if k % max(1, round(1 / dt)) == 0:
            tell(f"{k} of {count} frames, {np.median(record.ms[-round(1 / dt) :]):.0f} ms each")
    return record


def note_state(record: Recording, x: np.ndarray, subject: Subject, limits: np.ndarray) -> None:
    """Positions (N, 3), energies and stretch of the state as it is; `limits` (F,) divide the stretches."""
    record.cloth.append(x)
    kinetic, stored, fall = subject.energies()
    record.kinetic.append(kinetic)
    record.stored.append(stored)
    record.fall.append(fall)
    stretches = principal_stretches(x, subject.faces, subject.uv_corners)[:, 1]
    record.stretch_true.append(float(stretches.max()))
    larger = stretches / limits
    record.stretch_most.append(float(np.quantile(larger, 0.999, method="inverted_cdf")))
    record.stretch_max.append(float(larger.max()))


def largest_distance(a: np.ndarray, b: np.ndarray) -> float:
    """Between vertices of the same number [m]; 0 where there are none."""
    return float(np.linalg.norm(a.astype(np.float64) - b, axis=1).max(initial=0.0))
