"""What is written down of a case, frame by frame."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from frame_judge import FrameVerdict

NO_VERDICT = FrameVerdict(False, True, True, -1)  # until somebody has looked


@dataclass
class Recording:
    """Entry k of a list is frame k, at k dt; frame 0 is the start. Lengths in m, energies in J."""

    dt: float
    strain_limit: float  # of the fabric; of several, 1: stretches are then shares of each triangle's own
    total_mass: float
    cloth: list[np.ndarray] = field(default_factory=list)  # (N, 3) float32
    verdicts: list[tuple[int, FrameVerdict]] = field(default_factory=list)  # frames that ipctk was asked about
    moves: int = 0  # accepted sub-steps that ipctk was asked about
    colliding: list[tuple[int, int]] = field(default_factory=list)  # of these, frame and number of what was not free
    leaps: list[int] = field(default_factory=list)  # frames that the accepted sub-steps do not lead to
    unmoved: list[bool] = field(default_factory=list)  # cloth equal to the frame's before, byte for byte
    kinetic: list[float] = field(default_factory=list)
    stored: list[float] = field(default_factory=list)
    fall: list[float] = field(default_factory=list)
    work: list[float] = field(default_factory=list)  # done on the cloth up to the frame
    stretch_most: list[float] = field(default_factory=list)  # not exceeded by 99.9 % of the triangles
    stretch_max: list[float] = field(default_factory=list)
    stretch_true: list[float] = field(default_factory=list)  # of any triangle, by no limit
    lag: list[float] = field(default_factory=list)  # largest distance from where the surface should be
    off_tracker: list[float] = field(default_factory=list)  # the same from where a tracker has told it to be
    told_lag: list[float] = field(default_factory=list)  # as reported
    told_stretch: list[float] = field(default_factory=list)
    gaps_off: list[tuple[int, float]] = field(default_factory=list)  # frames measured, m by which min_gap was not so
    asleep: list[bool] = field(default_factory=list)  # said to be
    worked: list[int] = field(default_factory=list)  # solver steps of the frame
    retries: list[int] = field(default_factory=list)
    reverts: list[int] = field(default_factory=list)
    advice: list[str] = field(default_factory=list)
    min_gap: list[float] = field(default_factory=list)
    pairs: list[int] = field(default_factory=list)  # contact pairs, as reported
    surface: list[np.ndarray] = field(default_factory=list)  # (B, 3) float32, where noise is measured
    worn: list[bool] = field(default_factory=list)
    slid: list[float] = field(default_factory=list)
    ms: list[float] = field(default_factory=list)  # wall time of a frame
    cpu_ms: list[float] = field(default_factory=list)  # processor time of it, which a busy machine does not lengthen
    failure: str = ""  # the error that ended it

    @property
    def frames(self) -> int:
        """After frame 0."""
        return len(self.cloth) - 1
