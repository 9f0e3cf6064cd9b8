"""Moving meshes of the CC0 body that begin, or remain, in poses that nobody is dressed in."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np

from tryon_solver.body import default_body, parse_bvh, quaternions, retarget
from tryon_solver.body.pose import Pose, skin

BODY = default_body()
WALK = Path(__file__).resolve().parents[2] / "server" / "tryon_server" / "demo" / "motions" / "walk.bvh"
X, Y, Z = np.eye(3)
Turn = tuple[str, np.ndarray, float]

A_POSE = Pose.rest(BODY)


def turned(*turns: Turn) -> Pose:
    """The A pose with joints turned: (joint without its side, axis on the left, degrees); mirrored on the right."""
    rotations = A_POSE.rotations.copy()
    for joint, axis, degrees in turns:
        for side, mirror in (("left", [1, 1, 1]), ("right", [1, -1, -1])):
            turn = quaternions.from_axis_angle(axis * mirror, np.radians(degrees))
            index = BODY.index_of[f"{side}_{joint}"]
            rotations[index] = quaternions.multiply(turn, rotations[index])
    return Pose(A_POSE.root, rotations)


CROSSED = turned(("upper_arm", Z, -38.0), ("upper_arm", X, -30.0), ("forearm", Y, -95.0))
AT_SIDES = turned(("upper_arm", Z, -45.0))
LEGS_TOGETHER = turned(("thigh", Z, -9.0))
SEATED = turned(("thigh", X, -85.0), ("shin", X, 85.0))
RAISED = turned(("upper_arm", Z, 120.0))


def mid_stride() -> Pose:
    """A walk half a second after it begins: the arms hang, a leg swings."""
    return retarget(parse_bvh(WALK.read_text()), BODY).sample(0.5)


def led(*poses: Pose, seconds: float, fps: float) -> np.ndarray:
    """(T, B, 3) m: from each pose to the next in that time, by turns of the joints."""
    count = round(seconds * fps)
    shown = [
        skin(BODY, Pose.interpolate(a, b, k / count)) for a, b in itertools.pairwise(poses) for k in range(count)
    ]
    return np.array([*shown, skin(BODY, poses[-1])], np.float32)


def saved(path: Path, frames: np.ndarray, fps: float) -> Path:
    """As an .npz that says all of itself."""
    np.savez(path, vertices=frames, faces=BODY.faces, fps=fps, units="m", up="y")
    return path
