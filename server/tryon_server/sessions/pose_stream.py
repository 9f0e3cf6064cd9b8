"""The poses of one connection: in order, of a known skeleton, held where tracking is lost, filtered before physics."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from tryon_protocol import (
    CONVENTIONS,
    POSE_CLOCK,
    POSE_CONVENTION,
    PoseMessage,
    ProtocolError,
    Skeleton,
    SkeletonMessage,
    TrackedPose,
    validate_pose,
    validate_skeleton,
    validate_tracked_pose,
)
from tryon_server.sessions.commands import UsePose, UseTrackedPose
from tryon_server.sessions.measures import Measures
from tryon_server.sessions.pose_clock import CLIENTS_MAX, PoseClock, Stamp
from tryon_server.sessions.smoothing import PlaceFilter, Smoothing, TurnFilter

NONE = "none"


class PoseStream:
    """What one client's poses need remembered.

    Args:
        client: its number.
        smoothing: settings of the filter.
    """

    def __init__(self, client: int, smoothing: Smoothing) -> None:
        self._client = client
        self._smoothing = smoothing
        self._skeleton: Skeleton | None = None
        self._measures: Measures | None = None
        self._announced = 0
        self._clock = PoseClock()
        self._begin()

    def announce(self, message: SkeletonMessage, subjects: Sequence[str]) -> None:
        """Take a skeleton; the poses of its convention refer to it from now on. Raises ProtocolError."""
        skeleton = validate_skeleton(message, subjects)
        self._measures = Measures(skeleton)
        self._skeleton = skeleton
        self._announced += 1
        self._clock.expect_restart()
        self._begin()

    def check(
        self, message: PoseMessage, joint_names: Sequence[str], subjects: Sequence[str], followable: bool, now: float
    ) -> TrackedPose:
        """The pose's arrays, checked. Changes nothing but what is known of a clock that seems to have restarted.

        Args:
            message: the pose.
            joint_names: of the session's body.
            subjects: bodies of the session.
            followable: whether that body can follow trackers.
            now: when it arrived [s].

        Raises:
            ProtocolError: the pose can't be used.
        """
        if message.convention == POSE_CONVENTION:
            root, rotations = validate_pose(message, joint_names, subjects)
            pose = TrackedPose(root, None, rotations, np.ones(len(joint_names), dtype=bool))
        else:
            pose = self._check_tracked(message, subjects, followable)
        self._clock.check(_stamp(message, now))
        return pose

    def take(self, message: PoseMessage, pose: TrackedPose, now: float) -> UsePose | UseTrackedPose:
        """The checked pose, which arrived at ``now`` [s], as a command, filtered."""
        goes_on = self._goes_on(message)
        dt = self._clock.take(_stamp(message, now))
        if not goes_on or np.isinf(dt):
            self._begin()
        self._key = (message.convention, message.clock, message.frame)
        smoothing = message.smoothing or (NONE if message.convention == POSE_CONVENTION else "")
        pose = self._held(pose)
        if smoothing != NONE:
            pose = self._smoothed(pose, dt)
        stream = self._client + CLIENTS_MAX * self._clock.restarts  # another clock, another stream
        stream = stream if message.clock == POSE_CLOCK else -stream
        if message.convention == POSE_CONVENTION:
            assert pose.root is not None
            assert pose.rotations is not None
            return UsePose(stream, message.seq, message.t, pose.root, pose.rotations)
        assert self._skeleton is not None
        return UseTrackedPose(stream, message.seq, message.t, message.frame, self._skeleton, self._announced, pose)

    def _goes_on(self, message: PoseMessage) -> bool:
        """Whether a pose belongs to the ones before it."""
        last = self._clock.last
        silence = message.t - last.t if last is not None else np.inf
        key = (message.convention, message.clock, message.frame)
        return key == self._key and silence < self._smoothing.forget_seconds

    def _begin(self) -> None:
        """Forget what was filtered and held."""
        self._key = ("", "", "")
        self._seen: TrackedPose | None = None
        self._roots = PlaceFilter(self._smoothing)
        self._places = PlaceFilter(self._smoothing)
        self._turns = TurnFilter(self._smoothing)

    # Checks -------------------------------------------------------------------------------------------------------

    def _check_tracked(self, message: PoseMessage, subjects: Sequence[str], followable: bool) -> TrackedPose:
        known = (POSE_CONVENTION, *CONVENTIONS) if followable else (POSE_CONVENTION,)
        if message.convention not in known:
            why = "is not known here" if message.convention not in CONVENTIONS else "can't be followed by this body"
            raise ProtocolError(
                "unsupported_convention", "$.convention", f"{message.convention!r} {why}.", f"Send {', '.join(known)}."
            )
        skeleton, measures = self._skeleton, self._measures
        if skeleton is None or measures is None or skeleton.convention != message.convention:
            raise ProtocolError(
                "unexpected_message",
                "$.convention",
                f"No skeleton of the convention {message.convention!r} has come.",
                "Send `skeleton` before the first pose.",
            )
        pose = validate_tracked_pose(message, skeleton, subjects)
        measures.check(pose, message.frame)
        held = self._seen.tracked if self._seen is not None and self._goes_on(message) else False
        seen = pose.tracked | held
        required = CONVENTIONS[skeleton.convention].required or skeleton.joint_names
        for joint in np.flatnonzero(~seen):
            name = skeleton.joint_names[joint]
            if name in required:
                raise _unusable(
                    f"$.confidence[{joint}]",
                    f"The joint {name!r} has not been seen yet.",
                    "Send the first pose once the tracker sees every joint that is needed.",
                )
        return pose

    # Holding and filtering ----------------------------------------------------------------------------------------

    def _held(self, pose: TrackedPose) -> TrackedPose:
        """Joints that are not seen stay as they were last seen, carried along with the joints that are."""
        before, self._seen = self._seen, pose
        if before is None or pose.tracked.all():
            return pose
        held = before.tracked & ~pose.tracked
        positions, rotations = pose.positions, pose.rotations
        if positions is not None and before.positions is not None:
            both = pose.tracked & before.tracked
            way = (positions - before.positions)[both].mean(axis=0) if both.any() else np.zeros(3)
            positions = np.where(held[:, None], before.positions + way, positions)
        if rotations is not None and before.rotations is not None:
            rotations = np.where(held[:, None], before.rotations, rotations)
        self._seen = TrackedPose(pose.root, positions, rotations, pose.tracked | held)
        self._appear(self._seen, before.tracked)
        return self._seen

    def _appear(self, pose: TrackedPose, before: npt.NDArray[np.bool_]) -> None:
        """A joint that is seen for the first time has not come there from where it was not."""
        new = pose.tracked & ~before
        if new.any() and pose.positions is not None:
            self._places.put(new, pose.positions)
        if new.any() and pose.rotations is not None:
            self._turns.put(new, pose.rotations)

    def _smoothed(self, pose: TrackedPose, dt: float) -> TrackedPose:
        return TrackedPose(
            root=self._roots.next(pose.root[None], dt)[0] if pose.root is not None else None,
            positions=self._places.next(pose.positions, dt) if pose.positions is not None else None,
            rotations=self._turns.next(pose.rotations, dt) if pose.rotations is not None else None,
            tracked=pose.tracked,
        )


def _stamp(message: PoseMessage, now: float) -> Stamp:
    return Stamp(message.seq, message.t, message.clock, now)


def _unusable(place: str, message: str, remedy: str) -> ProtocolError:
    return ProtocolError("invalid_pose", place, message, remedy)
