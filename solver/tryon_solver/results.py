"""What a step reports: figures and failures as values, never silent."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field


@dataclass(frozen=True)
class StepReport:
    """Figures of one call of `advance`, over all its solver steps."""

    time: float  # s, the poses' clock
    steps: int  # solver steps taken
    substeps: int  # kinematic sub-steps of the body
    iterations: int  # outer iterations of the cycle, summed
    newton_iterations: int  # of the penetration correction, summed
    residual: float  # m/s, largest move of the last Newton iteration over dt
    min_gap: float  # m, smallest gap above the thickness offset among contact pairs; d_hat when there is none
    max_stretch: float  # -, largest principal stretch of any triangle
    body_lag: float  # m, largest distance from the tracked skin to the collision surface
    pairs: int  # contact pairs at the end
    overlapping: int  # pairs found at or under their thickness offset
    retries: int  # steps made void by verification: the garment was carried along and nothing else
    debt: float  # s, time a gap in the poses left to be simulated
    reverts: int = 0  # of these, steps whose carried state failed too: cloth and surface stayed where they were
    times_ms: dict[str, float] = field(default_factory=dict)  # wall time per stage
    advice: str = ""  # what to do when something above is out of bounds

    def to_dict(self) -> dict[str, object]:
        """Plain values, ready for JSON."""
        return asdict(self)


@dataclass
class Counters:
    """What the verbs of a step count while they run."""

    steps: int = 0
    substeps: int = 0
    iterations: int = 0
    newton_iterations: int = 0
    residual: float = 0.0
    pairs: int = 0
    overlapping: int = 0
    retries: int = 0
    reverts: int = 0
    min_gap: float = float("inf")
    times: dict[str, float] = field(default_factory=dict)
