"""Left and right of a stranger's body: triangles that face inwards and joints on the wrong side are what mirroring
leaves. Ours."""

from __future__ import annotations

import re

import numpy as np

from tryon_solver.files.convention import Convention
from tryon_solver.files.facing import toes

NEARLY_ALL = 0.9  # of a part's triangles
APART = 0.05  # m, joints of the two sides are so far from each other at least
SIDES = {  # "LeftArm", "mixamorig:leftFoot"; "thigh.L", "Bip01 L Thigh", "l_hip", "upperarm_l"; "lShldr"
    side: re.compile(rf"(?i:{side})|(?<![A-Za-z])(?i:{side[0]})(?![A-Za-z])|^{side[0]}(?=[A-Z])")
    for side in ("left", "right")
}


def side_of(joint: str) -> str | None:
    """"left" or "right", where the name of a joint says one of them."""
    found = [side for side, pattern in SIDES.items() if pattern.search(joint.rpartition(":")[2])]
    return found[0] if len(found) == 1 else None


def sides_told(
    turned: np.ndarray,
    part: np.ndarray,
    x: np.ndarray,
    leftward: np.ndarray | None,
    convention: Convention,
    facing: np.ndarray | None = None,
) -> list[str]:
    """What there is to say about a body of which the triangles `turned` (F,) faced inwards.

    `part` (F,) which of its parts each is of: one is inside out where nearly all of its triangles are; mirroring turns
    all of them, never some.

    `x` (V, 3) m its vertices; `leftward` (3,), in the file's units and axes, from its right joints to its left ones;
    `facing` (3,) where it faces, if that is told: else its toes do.
    """
    notes = []
    share = np.bincount(part, turned) / np.bincount(part)
    if 2 * np.count_nonzero(turned & (share[part] > NEARLY_ALL)) > len(turned):
        notes.append(
            "it is inside out, its triangles face inwards as those of a mirrored export do: they are turned over; if "
            "it is mirrored its left is its right"
        )
    elif turned.any():
        notes.append(f"{np.count_nonzero(turned)} of its {len(turned)} triangles faced inwards: they are turned over")
    forwards = None if leftward is None else toes(x) if facing is None else facing
    if leftward is not None and forwards is not None:
        way = float(convention.apply(leftward) @ np.cross([0.0, 1.0, 0.0], forwards))
        if way < -APART:
            notes.append(
                "its joints named left are on its right: it was mirrored, or they are named the wrong way round; it is "
                "worn as it is, mirror it back where its sides matter"
            )
    return notes
