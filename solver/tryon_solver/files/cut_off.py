"""Whether a stranger's body is half a person: cut off at the neck, the hips or the knees and left open there. Ours.

Where a pattern belongs on a body is told by the body's height. One without head or legs wears it in the wrong place,
and what is then said of the garment, that it is too tight, is not what is wrong.
"""

from __future__ import annotations

import numpy as np

from tryon_solver.geometry.boundary_loops import boundary_loops
from tryon_solver.geometry.surface_repair import crowded_edges

AT_END = 0.02  # share of the height by which a rim may miss the body's end and still be it
SLANT = 0.1  # share of the height by which a rim may rise: necks are cut off lower in front
GIRTH = 0.3  # m; open ankles are narrower, and a body without its feet is as high as another
ENDS = (("above", 1.0, "a head"), ("below", -1.0, "legs and feet"))


def cut_off(x: np.ndarray, faces: np.ndarray) -> str:
    """What there is to say about the ends of an open surface x (V, 3) m, Y up, faces (F, 3); "" for a whole person."""
    if len(crowded_edges(faces)):
        return ""
    height = float(np.ptp(x[:, 1]))
    rims = [x[loop] for loop in boundary_loops(faces)]
    told = []
    for where, sign, missing in ENDS:
        end = float((sign * x[:, 1]).max())
        there = [
            girth(rim)
            for rim in rims
            if end - (sign * rim[:, 1]).max() < AT_END * height and np.ptp(rim[:, 1]) < SLANT * height
        ]
        if max(there, default=0.0) > GIRTH:
            told.append(f"{where} it ends in an open rim, {max(there):.2f} m around, where {missing} should be")
    return f"it is cut off: {', and '.join(told)}" if told else ""


def girth(rim: np.ndarray) -> float:
    """Length [m] of a closed line through places (L, 3) m."""
    return float(np.linalg.norm(rim - np.roll(rim, 1, axis=0), axis=1).sum())
