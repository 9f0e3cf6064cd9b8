"""From the frame in which a garment was put on back to the first one: through the body's own frames, so that it is a
body all the way, where a blend of two far frames would shrink its limbs."""

from __future__ import annotations

from dataclasses import dataclass

from tryon_solver.body.mesh_sequence import MeshSequence, Moment

RAMP = 0.3  # s, in which it gets under way, and comes to a stand


@dataclass(frozen=True)
class LeadBack:
    """A sequence played backwards from the time `begin` [s], nowhere faster than its own pace, from rest to rest."""

    sequence: MeshSequence
    begin: float

    @property
    def duration(self) -> float:
        """How long it takes [s]; 0 from the first frame."""
        return self.begin + self._ramp

    @property
    def _ramp(self) -> float:
        return min(RAMP, self.begin)

    def sample(self, t: float) -> Moment:
        """The moment t s after it sets off; before, the one it sets off from, and afterwards the first frame."""
        ramp, left = self._ramp, self.duration - t
        if t <= 0.0 or left <= 0.0:
            return self.sequence.sample(self.begin if t <= 0.0 < self.begin else 0.0)
        if t < ramp and left >= ramp:
            return self.sequence.sample(self.begin - t * t / (2.0 * ramp))
        if left < ramp:
            return self.sequence.sample(left * left / (2.0 * ramp))
        return self.sequence.sample(self.begin - t + ramp / 2.0)
