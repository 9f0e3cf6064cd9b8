"""Whether a stream's poses have the body upside down for longer than a handstand takes: a tracker that is turned."""

from __future__ import annotations

import numpy as np

from tryon_solver.body.model import BodyModel
from tryon_solver.body.pose import Pose, world_from_joint

UPSIDE_DOWN_SECONDS = 2.0  # on the sender's clock: who does a cartwheel, or dives, is the right way up again by then
LOOK_SECONDS = 0.2  # between looks
UPSIDE_DOWN = 0.3  # of the body's height by which its highest joint is below its lowest one: who only lies is not


class UpsideDown:
    """Looks at the poses of one body, and says once for every sender that they are upside down for too long."""

    def __init__(self, body: BodyModel) -> None:
        heights = body.rest_joints[:, 1]
        self._body = body
        self._top, self._bottom = int(heights.argmax()), int(heights.argmin())
        self._height = float(np.ptp(heights))
        self._stream: int | None = None
        self._next_look, self._since, self._said = -np.inf, np.inf, False

    def told(self, stream: int, t: float, pose: Pose) -> bool:
        """Whether it is to be told at this pose, of the time t [s] on its sender's clock; ``stream`` is the sender."""
        if stream != self._stream:
            self._stream, self._next_look, self._since, self._said = stream, t, np.inf, False
        if self._said or t < self._next_look:
            return False
        self._next_look = t + LOOK_SECONDS
        joints = world_from_joint(self._body, pose)[:, 1, 3]
        over = joints[self._bottom] - joints[self._top] > UPSIDE_DOWN * self._height > 0.0
        self._since = min(self._since, t) if over else np.inf
        self._said = t - self._since >= UPSIDE_DOWN_SECONDS
        return self._said
