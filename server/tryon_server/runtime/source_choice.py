"""Which poses a body goes by: its own, a motion's, or those that a client streams."""

from __future__ import annotations

from collections.abc import Callable

from tryon_server.runtime.drape import Drape, Stance
from tryon_server.runtime.sources import MotionSource, PoseSource, SequenceSource, StillSource
from tryon_server.runtime.stream_source import StreamSource
from tryon_solver.body.mesh_sequence import Moment
from tryon_solver.body.model import BodyModel
from tryon_solver.body.motion import Motion
from tryon_solver.body.pose import Pose

Play = Callable[[BodyModel], Motion]
"""Loads the chosen motion for a body; raises whatever keeps it from being played."""


def chosen_source(
    drape: Drape, stance: Stance, before: PoseSource | None, play: Play | None, since: float | None = None
) -> PoseSource:
    """From where the body stands: its own frames where it moves by itself, which go on whatever is chosen; else what
    `play` loads, or, without, the poses of a stream. Its clock goes on from `since` [s], where that was told of the
    frame before. Raises as `play`."""
    own = drape.own_motion
    if own is None and isinstance(stance, Pose):
        return StreamSource(stance, since) if play is None else MotionSource(play(drape.outfit.body), stance, since)
    if isinstance(before, SequenceSource):
        return before
    if own is not None and own.duration > 0 and isinstance(stance, Moment):
        return SequenceSource(own, stance.time, since)
    return StillSource(stance, since=since)
