"""Which frames IPC Toolkit is asked about, the ways to them, and how far off the gap is that was told of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from harness.oracle import Move, Oracle, on_the_way
from harness.recording import NO_VERDICT, Recording
from tryon_solver.results import StepReport

GAP_EVERY = 10  # of the frames that are asked about, those whose reported gap is measured

BEYOND = 2e-3  # m beyond the distance told, within which a true one is looked for

Shown = tuple[np.ndarray, np.ndarray]
"""Cloth (N, 3) and surface (B, 3) of a frame, m."""


class Witness:
    """Of one run of `count` frames: every `every`-th frame, the way to it, and the last; of a sleep the first frame and
    the way there, whatever its number: what is shown for long has been looked at."""

    def __init__(self, record: Recording, oracle: Oracle, offsets: tuple[float, float] | None, every: int, count: int):
        """`offsets` of cloth from body and of cloth from cloth [m], which gaps are told above; None: none are told."""
        self.record, self.oracle, self.offsets, self.every, self.count = record, oracle, offsets, every, count
        self.known = True  # was what is shown asked about?
        self.passed: list[Move] = []  # the moves to the frame before, if it was not

    def begin(self, shown: Shown) -> None:
        """Frame 0."""
        self.record.verdicts.append((0, self.oracle.judge(*shown)))

    def see(self, k: int, shown: Shown, same: bool, report: StepReport, moves: Sequence[Move]) -> None:
        """Frame k; `same`: byte for byte the frame before; `moves`: what was accepted since."""
        slept = same and report.asleep
        asked = not (slept and self.known) and (k % self.every == 0 or k == self.count or report.asleep)
        # of a void step nothing was accepted but what led to where it went back to
        counted = on_the_way(moves, np.vstack(shown)) if report.retries else range(len(moves))
        ways = [moves[number] for number in counted]
        if asked:
            self.ask(k, shown, [*self.passed, *ways] if slept else ways, report)
        self.known = asked or (same and self.known)
        self.passed = [] if asked else [*self.passed, *ways] if same else ways

    def ask(self, k: int, shown: Shown, ways: Sequence[Move], report: StepReport) -> None:
        """What the toolkit says of a frame and of each way to it."""
        record, verdict = self.record, NO_VERDICT
        verdict = self.oracle.judge(*shown)
        record.verdicts.append((k, verdict))
        record.moves += len(ways)
        record.colliding += [(k, number) for number in self.oracle.colliding(ways)]
        if self.offsets is not None and report.pairs and verdict.finite and len(record.verdicts) % GAP_EVERY == 0:
            record.gaps_off.append((k, gap_off(self.oracle, shown, self.offsets, report)))


def gap_off(oracle: Oracle, shown: Shown, offsets: tuple[float, float], report: StepReport) -> float:
    """By how much [m] the report's smallest gap is not what the toolkit measures in this frame.

    It must be no larger than the gap from cloth to body, and just that where the pair is said to be of both. Of cloth
    on cloth the toolkit knows pairs that the solver leaves out, since they are as close in the pattern: a distance
    that is told may only not be smaller than what the toolkit finds.
    """
    of_body, of_cloth = offsets
    to_body, to_cloth = oracle.distances(*shown, report.min_gap + report.gap_offset + BEYOND)
    off = report.min_gap - (to_body - of_body)
    if report.gap_offset == of_body:
        return abs(off)
    return max(off, to_cloth - (report.min_gap + of_cloth), 0.0)
