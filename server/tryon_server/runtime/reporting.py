"""What the solver did for a frame, as clients are told it."""

from __future__ import annotations

import math
from collections.abc import Iterable

from tryon_protocol import FramePrice, ReportMessage
from tryon_server.runtime.drape import StepFacts
from tryon_server.runtime.meter import Meter
from tryon_server.runtime.sources import Move


def price_of(facts: StepFacts, solver_ms: float) -> FramePrice:
    """What a frame was solved to, and what that took: `solver_ms` ms."""
    error = facts.error if math.isfinite(facts.error) else None
    return FramePrice(solver_ms=solver_ms, error=error, late_ms=1e3 * facts.late)


def report_of(
    facts: StepFacts,
    move: Move,
    solver_ms: float,
    seq: int,
    meter: Meter,
    now: float,
    solved: Iterable[FramePrice],
) -> ReportMessage:
    """The message for frame `seq`: of a move's facts, which took `solver_ms` ms, at `now` s on the meter's clock, and
    of all frames `solved` since the one before."""
    price = price_of(facts, solver_ms)
    near = facts.pairs > 0 and math.isfinite(facts.min_gap)
    return ReportMessage(
        seq=seq,
        t_sim=move.t,
        iterations=facts.iterations,
        residual=facts.residual,
        min_gap=facts.min_gap if near else None,
        gap_offset=facts.gap_offset if near else None,
        max_stretch=facts.max_stretch,
        body_lag=facts.body_lag,
        pairs=facts.pairs,
        retries=facts.retries,
        times_ms=dict(facts.times_ms),
        solver_ms=price.solver_ms,
        frames_per_second=meter.frames_per_second(now),
        real_time_factor=meter.real_time_factor,
        advice=facts.advice,
        asleep=facts.asleep,
        error=price.error,
        late_ms=price.late_ms,
        solved=tuple(solved),
    )
