"""How much one client may ask, and how often it is told the same thing."""

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


class Throttle:
    """Lets each word pass once per ``interval`` seconds; remembers no more than ``capacity`` words."""

    def __init__(self, interval: float, capacity: int = 64) -> None:
        self._interval = interval
        self._capacity = capacity
        self._last: dict[str, float] = {}

    def allow(self, word: str, now: float) -> bool:
        """Whether ``word`` may pass at ``now`` [s]."""
        last = self._last.get(word)
        if last is not None and now - last < self._interval:
            return False
        if len(self._last) >= self._capacity and word not in self._last:
            del self._last[min(self._last, key=self._last.__getitem__)]
        self._last[word] = now
        return True
