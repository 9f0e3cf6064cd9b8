"""How much one client may ask."""

from __future__ import annotations


class TokenBucket:
    """Lets ``rate`` events per second pass on average, and bursts of up to ``burst``."""

    def __init__(self, rate: float, burst: float, now: float) -> None:
        self._rate = rate
        self._burst = burst
        self._level = burst
        self._when = now

    def take(self, now: float) -> bool:
        """Whether one more event may pass at ``now`` [s]."""
        self._level = min(self._burst, self._level + (now - self._when) * self._rate)
        self._when = now
        if self._level < 1.0:
            return False
        self._level -= 1.0
        return True
