"""A headset's body tracker that errs as real ones do: noise, rate, latency, lost poses and outages. Pure and seeded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tryon_protocol import POSE_CONVENTION, POSE_FRAME, BodySurface, PoseMessage, ProtocolError, SkeletonMessage

Array = npt.NDArray[np.float64]

WEBXR = {
    "hips": "pelvis",
    "spine-middle": "spine_3",
    "chest": "spine_5",
    "head": "head",
    **{
        f"{side}-{joint}": f"{side}_{ours}"
        for side in ("left", "right")
        for joint, ours in {
            "shoulder": "clavicle",
            "arm-upper": "upper_arm",
            "arm-lower": "forearm",
            "hand-wrist": "hand",
            "upper-leg": "thigh",
            "lower-leg": "shin",
            "foot-ankle": "foot",
            "foot-ball": "toes",
        }.items()
    },
}
"""Joints of WebXR Body Tracking that a headset is simulated to see -> the default body's joints where they are."""
CONVENTIONS = ("webxr", POSE_CONVENTION)


@dataclass(frozen=True)
class TrackerErrors:
    """How a tracker errs.

    Attributes:
        rate: poses per second [Hz].
        latency: from the capture of a pose to its sending [s].
        place_noise: standard deviation of each coordinate of each joint [m].
        turn_noise: standard deviation about each axis of each joint [rad].
        noise_seconds: how long an error lasts (time constant) [s]; 0: it is another one in each pose.
        lost: share of poses that never arrive.
        outages: times per second at which the tracker sees nothing for a while [1/s].
        outage_seconds: how long that lasts [s].
        seed: of the random numbers.
    """

    rate: float = 72.0
    latency: float = 0.045
    place_noise: float = 0.003
    turn_noise: float = float(np.radians(0.5))
    noise_seconds: float = 0.0
    lost: float = 0.01
    outages: float = 0.05
    outage_seconds: float = 0.2
    seed: int = 0


@dataclass(frozen=True)
class TrackedPose:
    """One pose on its way: when it was captured and when it leaves, from the start of the replay [s]."""

    captured: float
    leaves: float
    message: PoseMessage


class SimulatedTracker:
    """Watches a body in a motion.

    Args:
        body: the session's body, as the topology tells it.
        roots: (T,3) m and
        rotations: (T,J,4): its poses, one per capture at ``errors.rate``.
        errors: how the tracker errs.
        convention: in which form it tells the poses, one of `CONVENTIONS`.

    Raises:
        ProtocolError: the poses are of another body, or the convention can't be told of this one.
    """

    def __init__(
        self, body: BodySurface, roots: Array, rotations: Array, errors: TrackerErrors, convention: str
    ) -> None:
        if rotations.shape[1:] != (len(body.joint_names), 4):
            raise _unfit(f"The motion is of {rotations.shape[1]} joints, the body has {len(body.joint_names)}.")
        missing = [ours for ours in WEBXR.values() if ours not in body.joint_names]
        if convention == "webxr" and missing:
            raise _unfit(f"The session's body has no joint {missing[0]!r}.")
        self._body, self._roots, self._rotations = body, roots, rotations
        self._errors, self._convention = errors, convention
        self._joints = [body.joint_names.index(ours) for ours in WEBXR.values()] if convention == "webxr" else []
        self._random = np.random.default_rng(errors.seed)

    def skeleton(self, subject: str) -> SkeletonMessage | None:
        """What announces the poses; None when nothing need be announced."""
        if self._convention == POSE_CONVENTION:
            return None
        rest = np.asarray(self._body.rest_joints, dtype=np.float64)[self._joints]
        return SkeletonMessage(
            subject=subject,
            convention="webxr",
            joint_names=tuple(WEBXR),
            rest_positions=_tuples(rest),
            rest_rotations=((0.0, 0.0, 0.0, 1.0),) * len(rest),
        )

    def poses(self, subject: str, start: float) -> list[TrackedPose]:
        """Every pose that arrives, in order; ``start`` [s] is the sender's clock at the beginning of the replay."""
        errors, count = self._errors, len(self._roots)
        captured = np.arange(count) / errors.rate
        seen = self._random.random(count) >= errors.lost
        for begin in np.flatnonzero(self._random.random(count) < errors.outages / errors.rate):
            seen &= (captured < captured[begin]) | (captured >= captured[begin] + errors.outage_seconds)
        places, turns = self._told()
        result: list[TrackedPose] = []
        for k in np.flatnonzero(seen):
            values: dict[str, Any] = {"rotations": _tuples(turns[k])}
            if self._convention == POSE_CONVENTION:
                x, y, z = places[k, 0].tolist()
                values["root"] = (x, y, z)
            else:
                values["positions"] = _tuples(places[k])
            message = PoseMessage(
                subject=subject,
                convention=self._convention,
                frame=POSE_FRAME,
                t=start + float(captured[k]),
                seq=len(result) + 1,
                **values,
            )
            result.append(TrackedPose(float(captured[k]), float(captured[k]) + errors.latency, message))
        return result

    def _told(self) -> tuple[Array, Array]:
        """Places (T,K,3) and turns (T,K,4) of the joints that are told, with their errors."""
        if self._convention == POSE_CONVENTION:
            places, turns = self._roots[:, None], self._rotations
        else:
            places, turns = world_joints(self._body, self._roots, self._rotations)
            places, turns = places[:, self._joints], turns[:, self._joints]
        errors = self._errors
        places = places + errors.place_noise * self._noise(places.shape)
        shaken = 0.5 * errors.turn_noise * self._noise((*turns.shape[:2], 3))
        error = np.concatenate([shaken, np.ones((*turns.shape[:2], 1))], axis=-1)
        turns = product(error / np.linalg.norm(error, axis=-1, keepdims=True), turns)
        return places, turns

    def _noise(self, shape: tuple[int, ...]) -> Array:
        """Normal errors of variance 1 that fade with the time constant along the first axis."""
        fresh = self._random.normal(size=shape)
        if self._errors.noise_seconds == 0.0:
            return fresh
        kept = np.exp(-1.0 / (self._errors.rate * self._errors.noise_seconds))
        for k in range(1, len(fresh)):
            fresh[k] = kept * fresh[k - 1] + np.sqrt(1.0 - kept * kept) * fresh[k]
        return fresh


def world_joints(body: BodySurface, roots: Array, rotations: Array) -> tuple[Array, Array]:
    """World places (T,J,3) m and turns (T,J,4) of a body's joints in poses; PROTOCOL.md section 8."""
    rest = np.asarray(body.rest_joints, dtype=np.float64)
    places, turns = np.empty((*rotations.shape[:2], 3)), np.array(rotations, dtype=np.float64)
    places[:, 0] = roots
    for joint, parent in enumerate(np.asarray(body.parents)[1:], start=1):
        offset = np.zeros((len(roots), 4))
        offset[:, :3] = rest[joint] - rest[parent]
        turned = product(product(turns[:, parent], offset), turns[:, parent] * [-1.0, -1.0, -1.0, 1.0])
        places[:, joint] = places[:, parent] + turned[:, :3]
        turns[:, joint] = product(turns[:, parent], rotations[:, joint])
    return places, turns


def product(p: Array, q: Array) -> Array:
    """Hamilton product of quaternions x, y, z, w (..., 4)."""
    pv, pw, qv, qw = p[..., :3], p[..., 3:], q[..., :3], q[..., 3:]
    vector = pw * qv + qw * pv + np.cross(pv, qv)
    return np.concatenate([vector, pw * qw - (pv * qv).sum(axis=-1, keepdims=True)], axis=-1)


def _tuples(rows: Array) -> Any:
    """Rows (K,n) as the tuples of a message."""
    return tuple(tuple(row) for row in rows.tolist())


def _unfit(what: str) -> ProtocolError:
    return ProtocolError("unsupported_convention", "$.convention", what, "Send poses of the session's own body.")
