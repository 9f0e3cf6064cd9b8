"""Does a process come back to the memory that it had? What it has taken after each change, judged."""

from __future__ import annotations

from collections.abc import Sequence

ENOUGH = 200  # changes, below which nothing is judged
EARLY, LATE = 0.3, 0.1  # of the changes: the first and the last ones, of which the most is compared
GROWTH = 1.2  # that the last level may be over the first: pieces of other garments are larger and smaller


def grown(taken: Sequence[int]) -> str:
    """What is wrong with the bytes taken after each change, or ""."""
    if len(taken) < ENOUGH:
        return ""
    early, late = max(taken[: round(EARLY * len(taken))]), max(taken[-round(LATE * len(taken)) :])
    if late <= GROWTH * early:
        return ""
    return f"memory grows: at most {early / 1e6:.0f} MB at first, {late / 1e6:.0f} MB after {len(taken)} changes"
