"""The poses that clients stream, on their way to what moves the body: followed, judged, and told of where odd."""

from __future__ import annotations

import math
from collections.abc import Callable

from tryon_protocol import POSE_CONVENTION
from tryon_server.runtime.followers import Follower
from tryon_server.runtime.posture import Posture, local_turns
from tryon_server.runtime.sources import PoseSource
from tryon_server.runtime.stream_source import StreamSource
from tryon_server.sessions.commands import UsePose, UseTrackedPose
from tryon_solver.body.model import BodyModel
from tryon_solver.body.pose import Pose
from tryon_solver.body.tracking import TrackingError

COMPLAINT_SECONDS = 1.0  # between complaints of a tracker that can't be followed


class PoseTaking:
    """Takes the poses of clients, once there is a body. ``trouble`` tells a code, a place, what is wrong, and what to
    do; ``clock`` is the server's steady clock [s]."""

    def __init__(self, clock: Callable[[], float], trouble: Callable[[str, str, str, str], None]) -> None:
        self._clock, self._trouble = clock, trouble
        self._follower: Follower | None = None
        self._posture: Posture | None = None
        self._complained = -math.inf

    def begin(self, body: BodyModel) -> None:
        """This body is to be moved from now on."""
        self._follower, self._posture = Follower(body), Posture(body)

    def take(self, command: UsePose, source: PoseSource | None) -> None:
        """Use a pose of the body's own joints."""
        self._use(command, Pose(root=command.root, rotations=command.rotations), source)

    def track(self, command: UseTrackedPose, source: PoseSource | None) -> None:
        """Use a tracker's pose; one that can't be followed is told once a second."""
        if self._follower is None:
            return
        try:
            self._use(command, self._follower.pose(command), source)
        except TrackingError as error:
            now = self._clock()
            if now - self._complained >= COMPLAINT_SECONDS:
                self._complained = now
                why = str(error)
                self._trouble(
                    "invalid_skeleton", f"$.{error.field}", why[:1].upper() + why[1:] + ".", "Send `skeleton` anew."
                )

    def _use(self, command: UsePose | UseTrackedPose, pose: Pose, source: PoseSource | None) -> None:
        if not isinstance(source, StreamSource):
            return
        source.take(command.stream, command.seq, command.t_capture, pose)
        convention, sent = POSE_CONVENTION, pose.rotations
        if isinstance(command, UseTrackedPose):
            convention, sent = command.skeleton.convention, local_turns(command)
        if self._posture is not None:
            odd = self._posture.told(command.stream, command.t_capture, pose, convention, sent)
            if odd is not None:
                self._trouble(odd.code, odd.place, odd.message, odd.remedy)
