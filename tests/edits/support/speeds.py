"""How fast cloth goes against the body, and how fast but for what it has fallen."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from scipy.spatial import cKDTree

SPEED_LIMIT = 1.5  # m/s of a vertex on the body, but for what it has fallen since the change; or, where the motion
# takes the garment faster than this by itself, as around the shins of who walks, so fast
AROUND = 0.15  # m: cloth between two limbs that pass each other goes with either, whichever is nearer
FREE = 0.05  # m: no limb takes along cloth that is farther than this from all of the body; it hangs from the trunk
GRAVITY = 9.81  # m/s^2: cloth that has lost what held it falls, and is at that speed after 0.15 s


class Seen(Protocol):
    """A garment and a body at one time: cloth (N, 3), the body's surface (B, 3) and its root (3,), m."""

    @property
    def cloth(self) -> np.ndarray: ...

    @property
    def body(self) -> np.ndarray: ...

    @property
    def root(self) -> np.ndarray: ...


class Falling:
    """Where each vertex has been highest over the root, since this began."""

    def __init__(self) -> None:
        self._highest: np.ndarray | None = None  # (N,) m over the root

    def see(self, seen: Seen) -> None:
        """The next of one garment."""
        height = seen.cloth[:, 1] - seen.root[1]
        self._highest = height if self._highest is None else np.maximum(self._highest, height)

    def of_itself(self, speeds: np.ndarray, seen: Seen) -> np.ndarray:
        """(N,) m/s: of these `speeds` (N,) what is left without what has been fallen, sqrt(v^2 - 2 g h)."""
        assert self._highest is not None
        fallen = self._highest - (seen.cloth[:, 1] - seen.root[1])
        left: np.ndarray = np.sqrt(np.maximum(speeds**2 - 2 * GRAVITY * fallen, 0.0))
        return left


def speed_on_body(before: Seen, after: Seen, dt: float) -> np.ndarray:
    """(N,) m/s of the cloth's vertices, each against the point of the body that was nearest; of those faster than half
    of SPEED_LIMIT the least against any point within AROUND."""
    points = cKDTree(before.body)
    _, nearest = points.query(before.cloth)
    way, of_body = after.cloth - before.cloth, after.body - before.body
    result: np.ndarray = np.linalg.norm(way - of_body[nearest], axis=1) / dt
    for k in np.flatnonzero(result > SPEED_LIMIT / 2):
        around = points.query_ball_point(before.cloth[k], AROUND)
        if around:
            result[k] = np.linalg.norm(way[k] - of_body[around], axis=1).min() / dt
    return result


def speed_of_hanging(before: Seen, after: Seen, dt: float) -> np.ndarray:
    """(N,) m/s: `speed_on_body`, or, of vertices that nothing of the body is within FREE of, before and after, that
    against the root, if it is less. A hem that hangs still while a shin swings past it is as fast against that as the
    shin is, which no edit has to do with; cloth that is thrown is fast against both."""
    speeds = speed_on_body(before, after, dt)
    apart = np.minimum(*(cKDTree(seen.body).query(seen.cloth)[0] for seen in (before, after)))
    way = (after.cloth - before.cloth) - (after.root - before.root)
    result: np.ndarray = np.where(apart > FREE, np.minimum(speeds, np.linalg.norm(way, axis=1) / dt), speeds)
    return result
