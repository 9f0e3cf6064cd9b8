"""What the demo motions are made of: a skeleton, leg inverse kinematics, arms, and a BVH writer.

Lengths in metres, angles in radians, axes x to the body's left, y up, z forward. A track is an array over frames.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from tryon_solver.body import quaternions

FRAMES_PER_SECOND = 60
X, Y, Z = np.eye(3)
SIDES = {"Left": 1.0, "Right": -1.0}

# Joint -> (parent, offset from it in m) in a T pose, 1.72 m tall; the tip of an end joint is its End Site.
_CENTRE = {
    "Hips": ("", (0.0, 0.93, 0.0)),
    "Spine": ("Hips", (0.0, 0.10, -0.01)),
    "Spine1": ("Spine", (0.0, 0.13, -0.005)),
    "Spine2": ("Spine1", (0.0, 0.13, 0.0)),
    "Neck": ("Spine2", (0.0, 0.16, 0.005)),
    "Head": ("Neck", (0.0, 0.10, 0.015)),
}
_SIDE = {
    "Shoulder": ("Spine2", (0.03, 0.11, 0.0)),
    "Arm": ("Shoulder", (0.145, 0.01, 0.0)),
    "ForeArm": ("Arm", (0.28, 0.0, 0.0)),
    "Hand": ("ForeArm", (0.25, 0.0, 0.0)),
    "HandMiddle1": ("Hand", (0.09, 0.0, 0.0)),
    "UpLeg": ("Hips", (0.095, -0.02, 0.0)),
    "Leg": ("UpLeg", (0.0, -0.42, 0.0)),
    "Foot": ("Leg", (0.0, -0.42, 0.0)),
    "ToeBase": ("Foot", (0.0, -0.05, 0.13)),
}
_TIPS = {"Head": (0.0, 0.17, 0.0), "HandMiddle1": (0.08, 0.0, 0.0), "ToeBase": (0.0, 0.0, 0.07)}
THIGH, SHIN = 0.42, 0.42  # m
ANKLE = 0.07  # m, height of the ankle joint over a flat sole
HEEL = np.array([0.0, -ANKLE, -0.05])  # m from the ankle, where the foot rolls on and off
BALL = np.array([0.0, -ANKLE, 0.13])


def _skeleton() -> dict[str, tuple[str, np.ndarray]]:
    joints = {name: (parent, np.array(offset)) for name, (parent, offset) in _CENTRE.items()}
    for side, sign in SIDES.items():
        for name, (parent, offset) in _SIDE.items():
            carrier = parent if parent in _CENTRE else side + parent
            joints[side + name] = (carrier, np.array(offset) * [sign, 1.0, 1.0])
    return joints


SKELETON = _skeleton()
ORDER = {"LeftForeArm": "YZX", "RightForeArm": "YZX"}  # an elbow turns about Y beyond 90 degrees; others ZYX


def turn(axis: np.ndarray, angle: np.ndarray | float) -> np.ndarray:
    """(T, 4) or (4,): quaternion of a turn by `angle` about `axis`."""
    return quaternions.from_axis_angle(axis, np.asarray(angle, dtype=float))


def chain(*turns: np.ndarray) -> np.ndarray:
    """Product of quaternions, the last applied first."""
    product = turns[0]
    for other in turns[1:]:
        product = quaternions.multiply(product, other)
    return product


def hermite(
    u: np.ndarray, start: np.ndarray, start_slope: np.ndarray, end: np.ndarray, end_slope: np.ndarray
) -> np.ndarray:
    """Cubic over u in [0, 1] with given ends and slopes."""
    return (
        (2 * u**3 - 3 * u**2 + 1) * start
        + (u**3 - 2 * u**2 + u) * start_slope
        + (3 * u**2 - 2 * u**3) * end
        + (u**3 - u**2) * end_slope
    )


class Performance:
    """World rotations of the joints and the path of the hips, filled in by a motion."""

    def __init__(self, duration: float) -> None:
        self.time = np.arange(round(duration * FRAMES_PER_SECOND) + 1) / FRAMES_PER_SECOND
        self.hips = np.tile(SKELETON["Hips"][1], (len(self.time), 1))
        self.turns: dict[str, np.ndarray] = {}

    def trunk(self, pelvis: np.ndarray, chest: np.ndarray, head: np.ndarray) -> None:
        """Spine and neck follow from the world turns (T, 4) of pelvis, chest and head."""
        self.turns["Hips"] = pelvis
        for joint, share in (("Spine", 1 / 3), ("Spine1", 2 / 3), ("Spine2", 1.0)):
            self.turns[joint] = quaternions.slerp(pelvis, chest, share)
        self.turns["Neck"] = quaternions.slerp(chest, head, 0.5)
        self.turns["Head"] = head

    def arm(self, side: str, raised: np.ndarray, forward: np.ndarray, elbow: np.ndarray, palm: float = 0.0) -> None:
        """An arm in the chest's frame: `raised` sideways from hanging (0) over T (pi/2) to overhead, then swung
        `forward`; the elbow bent by `elbow`; the forearm turned by `palm`, forward positive. The collar bone follows an
        arm raised above the shoulder by a quarter of the excess."""
        sign = SIDES[side]
        chest = self.turns["Spine2"]
        lift = 0.25 * np.maximum(raised - np.pi / 3, 0.0)
        self.turns[f"{side}Shoulder"] = chain(chest, turn(Z, sign * lift))
        upper = chain(chest, turn(X, -forward), turn(Z, sign * (raised - np.pi / 2)))
        fore = chain(upper, turn(Y, -sign * elbow), turn(X, np.full(len(raised), -palm)))
        self.turns[f"{side}Arm"], self.turns[f"{side}ForeArm"] = upper, fore
        self.turns[f"{side}Hand"] = chain(fore, turn(Z, np.full(len(raised), -0.08 * sign)))
        self.turns[f"{side}HandMiddle1"] = self.turns[f"{side}Hand"]

    def leg(self, side: str, ankle: np.ndarray, foot: np.ndarray, toes: np.ndarray, knee_to: np.ndarray) -> None:
        """A leg whose ankle is at `ankle` (T, 3) with the world turns (T, 4) of foot and toes; the knee bends in the
        plane of hip, ankle and the direction `knee_to` (T, 3). Raises ValueError where the leg is too short."""
        hip = self.hips + quaternions.rotate(
            self.turns["Hips"], np.broadcast_to(SKELETON[f"{side}UpLeg"][1], self.hips.shape)
        )
        reach = ankle - hip
        length = np.linalg.norm(reach, axis=1)
        if length.max() > 0.998 * (THIGH + SHIN):
            frame = int(length.argmax())
            raise ValueError(f"{side} leg at frame {frame}: {length.max():.4f} m from hip to ankle; lower the hips")
        down = reach / length[:, None]
        bend = np.arccos((THIGH**2 + length**2 - SHIN**2) / (2 * THIGH * length))
        knee = np.pi - np.arccos((THIGH**2 + SHIN**2 - length**2) / (2 * THIGH * SHIN))
        hinge = np.cross(knee_to, down)
        hinge /= np.linalg.norm(hinge, axis=1, keepdims=True)  # points to the body's left when the knee goes ahead
        axes = np.stack([hinge, -down, np.cross(hinge, -down)], axis=2)
        straight = Rotation.from_matrix(axes).as_quat()
        thigh = chain(straight, turn(X, -bend))
        self.turns[f"{side}UpLeg"], self.turns[f"{side}Leg"] = thigh, chain(thigh, turn(X, knee))
        self.turns[f"{side}Foot"], self.turns[f"{side}ToeBase"] = foot, toes

    def write(self, path: Path) -> None:
        """Write a BVH file: centimetres, degrees, 60 Hz."""
        lines = ["HIERARCHY", *_hierarchy("Hips", 0), "MOTION", f"Frames: {len(self.time)}"]
        lines.append(f"Frame Time: {1 / FRAMES_PER_SECOND:.6f}")
        columns = [100.0 * self.hips]
        for joint in _file_order("Hips"):
            local = self.turns[joint]
            if joint != "Hips":
                local = chain(quaternions.conjugate(self.turns[SKELETON[joint][0]]), local)
            angles = Rotation.from_quat(local).as_euler(ORDER.get(joint, "ZYX"))
            columns.append(np.degrees(np.unwrap(angles, axis=0)))
        for row in np.concatenate(columns, axis=1):
            lines.append(" ".join(_fixed(value) for value in row))
        path.write_text("\n".join(lines) + "\n", encoding="ascii", newline="\n")


def _fixed(value: float) -> str:
    """Four decimals (1 micrometre, 0.0001 degree), no negative zero."""
    text = f"{value:.4f}"
    return text.removeprefix("-") if float(text) == 0.0 else text


def _children(joint: str) -> list[str]:
    return [name for name, (parent, _) in SKELETON.items() if parent == joint]


def _file_order(joint: str) -> list[str]:
    return [joint, *(name for child in _children(joint) for name in _file_order(child))]


def _hierarchy(joint: str, depth: int) -> list[str]:
    pad, inner = "\t" * depth, "\t" * (depth + 1)
    _, offset = SKELETON[joint]
    order = " ".join(f"{axis}rotation" for axis in ORDER.get(joint, "ZYX"))
    channels = f"3 {order}" if depth else f"6 Xposition Yposition Zposition {order}"
    lines = [f"{pad}{'JOINT' if depth else 'ROOT'} {joint}", pad + "{", inner + _offset(offset)]
    lines.append(f"{inner}CHANNELS {channels}")
    for child in _children(joint):
        lines += _hierarchy(child, depth + 1)
    tip = _TIPS.get(joint.removeprefix("Left").removeprefix("Right"))
    if tip:
        mirrored = np.array(tip) * [-1.0 if joint.startswith("Right") else 1.0, 1.0, 1.0]
        lines += [inner + "End Site", inner + "{", f"{inner}\t{_offset(mirrored)}", inner + "}"]
    return [*lines, pad + "}"]


def _offset(offset: np.ndarray) -> str:
    return "OFFSET " + " ".join(_fixed(100.0 * value) for value in offset)
