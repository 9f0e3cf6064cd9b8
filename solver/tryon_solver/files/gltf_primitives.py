"""The triangles of a glTF primitive, in whichever way it lists them.

Khronos Group, glTF 2.0 Specification, section 3.7.2.1 (topology types).
"""

from __future__ import annotations

import numpy as np

MODES = {"triangles": 4, "strip": 5, "fan": 6}
"""Those of a surface; the others are points and lines."""


def as_triangles(corners: np.ndarray, mode: int) -> np.ndarray:
    """(F, 3) from the vertex ids (K,) that a primitive lists in one of MODES.

    Of a strip every second triangle is turned back. Those with a corner twice join strips and are none. Raises
    ValueError for a list that is no whole number of triangles.
    """
    if mode == MODES["triangles"]:
        return corners.reshape(-1, 3)
    if mode == MODES["fan"]:
        faces = np.column_stack([corners[1:-1], corners[2:], np.repeat(corners[:1], max(len(corners) - 2, 0))])
    else:
        faces = np.column_stack([corners[:-2], corners[1:-1], corners[2:]])
        faces[1::2] = faces[1::2, [0, 2, 1]]
    a, b, c = faces.T
    return faces[(a != b) & (b != c) & (c != a)]
