"""Groups of constraints that share no vertex: within a group all can be projected at once, as if one by one."""

from __future__ import annotations

import numpy as np


def colours(ids: np.ndarray, count: int) -> list[np.ndarray]:
    """Indices of the rows of ids (P, k), vertices of `count`, in groups that share none: greedy, in order of rows."""
    taken: list[np.ndarray] = []
    groups: list[list[int]] = []
    for row, vertices in enumerate(ids):
        for used, group in zip(taken, groups):
            if not used[vertices].any():
                used[vertices] = True
                group.append(row)
                break
        else:
            used = np.zeros(count, bool)
            used[vertices] = True
            taken.append(used)
            groups.append([row])
    return [np.array(group) for group in groups]
