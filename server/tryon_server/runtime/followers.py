"""From a tracker's pose, as a session hands it over, to the pose of the body that wears the garment."""

from __future__ import annotations

from tryon_server.sessions.commands import UseTrackedPose
from tryon_solver.body.model import BodyModel
from tryon_solver.body.pose import Pose
from tryon_solver.body.tracking import Sample, SourceSkeleton, Tracker


class Follower:
    """Follows whoever sends a body's poses; made anew for another sender, skeleton or frame."""

    def __init__(self, body: BodyModel) -> None:
        self._body = body
        self._key: tuple[int, int, str] | None = None
        self._tracker: Tracker | None = None

    def pose(self, command: UseTrackedPose) -> Pose:
        """The body's pose. Raises TrackingError when the tracker's skeleton can't be followed."""
        key = (command.stream, command.skeleton_number, command.frame)
        if self._tracker is None or key != self._key:
            skeleton = command.skeleton
            source = SourceSkeleton(
                skeleton.convention,
                command.frame,
                skeleton.joint_names,
                skeleton.parents,
                skeleton.rest_positions,
                skeleton.rest_rotations,
            )
            self._tracker, self._key = Tracker(self._body, source), key
        pose = command.pose
        return self._tracker.pose(Sample(pose.root, pose.positions, pose.rotations, pose.tracked))
