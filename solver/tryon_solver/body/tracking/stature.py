"""How tall a person is of whom rotations and the place of the root come, but no rest pose: by standing on the floor.

The rest pose is taken to be that of an average grown-up in SMPL's T pose. How high the root is over the floor, against
how high it is over the soles of an average person who does the same, is how tall this one is against it. So where the
person stands on the floor y = 0, our body does, whatever the size of the two. Ours.
"""

from __future__ import annotations

import numpy as np

STANDS = 0.85  # of the height of the root at rest: who stands or walks has the root so high over the lower sole
SIZES = (0.6, 1.3)  # of people of 1.0 m to 2.2 m; else the floor is not at y = 0
RESOLUTION = 5e-4  # of sizes: half a millimetre of the root's height
LOW = 0.05  # of the poses seen say that the person is no taller: who jumps was not, and a stray pose says nothing

# m, over the floor y = 0, of a person of 1.70 m, in round numbers. SMPL's shins lean back at rest and its legs are a
# little apart; its pelvis is well above the hips.
MIDDLE = {"pelvis": 0.93, "spine1": 1.04, "spine2": 1.18, "spine3": 1.23, "neck": 1.44, "head": 1.54}
LEFT = {
    "hip": (0.07, 0.84, 0.0),
    "knee": (0.1, 0.46, 0.0),
    "ankle": (0.09, 0.07, -0.04),
    "foot": (0.11, 0.015, 0.08),
    "collar": (0.08, 1.4, 0.0),
    "shoulder": (0.18, 1.4, 0.0),
    "elbow": (0.44, 1.4, 0.0),
    "wrist": (0.68, 1.4, 0.0),
    "hand": (0.76, 1.4, 0.0),
}


def average_place(joint: str) -> np.ndarray:
    """(3,) m: where one of SMPL's joints is in the average person's T pose."""
    side, _, name = joint.partition("_")
    if side not in ("left", "right"):
        return np.array([0.0, MIDDLE[joint], 0.0])
    x, y, z = LEFT[name]
    return np.array([x if side == "left" else -x, y, z])


class Stature:
    """One person's height over the average one's, from what was seen so far."""

    def __init__(self) -> None:
        self._seen = np.zeros(1 + round((SIZES[1] - SIZES[0]) / RESOLUTION), dtype=np.int64)

    def size(self, height: float, drop: float, at_rest: float) -> float:
        """The height over the average; 1 until the person has stood.

        Args:
            height: of the root over the floor y = 0 [m].
            drop: from the root down to the lower sole [m], in this pose of the average person.
            at_rest: the same in the T pose [m].
        """
        if drop > STANDS * at_rest and SIZES[0] <= height / drop <= SIZES[1]:
            self._seen[round((height / drop - SIZES[0]) / RESOLUTION)] += 1
        below = np.cumsum(self._seen)
        if not below[-1]:
            return 1.0
        return SIZES[0] + RESOLUTION * int(np.searchsorted(below, LOW * below[-1]))
