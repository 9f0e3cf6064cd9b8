"""What a step reports: figures and failures as values, never silent."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace

import numpy as np


@dataclass(frozen=True)
class StepReport:
    """Figures of one call of `advance`, over all its solver steps; gaps and pairs of the state that it committed.

    A pair's offset is the thickness between its two surfaces: the fabric's own for cloth on cloth, the skin's margin
    and half the fabric's for cloth on skin. A state is committed only with every distance above half its offset.
    Without contact pairs `min_gap` is d_hat, where contact begins.
    """

    time: float  # s, the poses' clock
    steps: int  # solver steps taken
    substeps: int  # kinematic sub-steps of the body
    iterations: int  # outer iterations of the cycle, summed
    newton_iterations: int  # of the penetration correction, summed
    residual: float  # m/s, longest way that the last Newton direction leads a vertex, over dt
    min_gap: float  # m, smallest distance of a contact pair less its offset; below 0: closer than the offset
    max_stretch: float  # -, largest principal stretch of any triangle
    body_lag: float  # m, largest distance from the tracked skin to the collision surface
    pairs: int  # contact pairs at the end
    overlapping: int  # pairs found at or under their thickness offset
    retries: int  # steps made void, by verification or led astray: the garment was carried along, nothing else
    debt: float  # s, time a gap in the poses left to be simulated
    gap_offset: float = 0.0  # m, that pair's offset: its surfaces are min_gap + gap_offset apart, always above 0; of
    # several garments the least that such a pair has
    error: float = 0.0  # m, estimated RMS distance of the cloth from where a step balances; the largest of the steps
    reverts: int = 0  # of these, steps whose carried state failed too: cloth and surface stayed where they were
    times_ms: dict[str, float] = field(default_factory=dict)  # wall time per stage
    late: float = 0.0  # s of wall time, by which the call ended after the settings' deadline; 0 without one
    asleep: bool = False  # nothing moves and nothing was done: the figures are those of the state as it fell asleep
    advice: str = ""  # what to do when something above is out of bounds (advice.py); "" when nothing is

    def sleeping(self, time: float, debt: float) -> StepReport:
        """Figures of a call in which nothing was done, from those of the state that has not moved since."""
        done = replace(self, steps=0, substeps=0, iterations=0, newton_iterations=0, residual=0.0, retries=0, reverts=0)
        return replace(done, time=time, debt=debt, times_ms={}, late=0.0, asleep=True)

    def to_dict(self) -> dict[str, object]:
        """Plain values, ready for JSON."""
        return asdict(self)


@dataclass
class Counters:
    """What the verbs of a step count while they run."""

    steps: int = 0
    substeps: int = 0
    newton_iterations: int = 0
    residual: float = 0.0
    pairs: int = 0
    overlapping: int = 0
    retries: int = 0
    reverts: int = 0
    asked: np.ndarray | None = None  # (B, 3) m, the skin of a pose that the step could not come to
    behind: float = 0.0  # m, farthest that the skin is from there
    times: dict[str, float] = field(default_factory=dict)
