"""What a tracker sends, and the same in the parts of our body: what every convention is brought to first.

A part is named as our joint that it begins at: `left_forearm` is the elbow as a point and the forearm as a turn. Beside
our joints there are `chest` (turn only), `waist` (a point of the spine between hips and shoulders), and per side
`left_index` and `left_little` (knuckles).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

SIDES = ("left", "right")
LIMBS = ("left_arm", "right_arm", "left_leg", "right_leg")
LIMB_PARTS = {"arm": ("upper_arm", "forearm", "hand"), "leg": ("thigh", "shin", "foot")}


class TrackingError(ValueError):
    """A tracker whose poses can't be followed; the message names the joint and the remedy, `field` what of the skeleton
    is at fault."""

    def __init__(self, message: str, field: str = "joint_names") -> None:
        super().__init__(message)
        self.field = field


@dataclass(frozen=True)
class SourceSkeleton:
    """What the arrays of a tracker's poses mean.

    The rest pose stands upright, Y up, facing +Z, in metres. What is None is not known.
    """

    convention: str
    frame: str
    joint_names: tuple[str, ...]
    parents: tuple[int, ...] | None = None
    rest_positions: np.ndarray | None = None  # (K, 3) m
    rest_rotations: np.ndarray | None = None  # (K, 4) unit quaternions x y z w, of the joints' axes in the world


@dataclass(frozen=True)
class Sample:
    """One pose of a tracker: the arrays its convention has, None for the others."""

    root: np.ndarray | None  # (3,) m
    positions: np.ndarray | None  # (K, 3) m
    rotations: np.ndarray | None  # (K, 4) unit quaternions x y z w
    tracked: np.ndarray  # (K,) bool, whether a joint's numbers were ever seen


@dataclass
class Observation:
    """One pose in the parts of our body, in the session's space."""

    points: dict[str, np.ndarray] = field(default_factory=dict)  # part -> (3,) m
    turns: dict[str, np.ndarray] = field(default_factory=dict)  # part -> (4,) unit quaternion, world turn from rest
    palms: dict[str, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)  # side -> fingers, back (3,) unit
    rest: dict[str, np.ndarray] | None = None  # part -> (3,) m, the same points in the source's own rest pose
    stride: float = 1.0  # our leg over the source's: positions are scaled by it
    afloat: bool = False  # where the body is is not known: it is stood on the floor
