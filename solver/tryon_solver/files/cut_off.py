"""Whether a stranger's body is half a person: cut off at the neck, the hips or the knees, open there or capped. Ours.

Where a pattern belongs on a body is told by its feet and its height. One without head or legs, such as a mannequin's
torso, wears it in the wrong place, and what is then said of the garment, that it is too tight, is not what is wrong. So
it is told, and one without legs is put where its upper end is at the height at which patterns expect it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tryon_solver.files.standing import NEAR_MIDDLE, SQUARE, Stand, trunk_middle
from tryon_solver.geometry.boundary_loops import boundary_loops
from tryon_solver.geometry.distinct import ascending, distinct
from tryon_solver.geometry.seams import face_edges, sides_of_one_edge
from tryon_solver.geometry.surface_repair import crowded_edges

AT_END = 0.02  # share of the height by which a rim may miss the body's end and still be it
SLANT = 0.1  # share of the height by which a rim may rise: necks are cut off lower in front
GIRTH = 0.3  # m; open ankles are narrower, and a body without its feet is as high as another
ENDS = {"head": ("above", 1.0, "a head"), "legs": ("below", -1.0, "legs and feet")}

EVEN = ((0.003, 5.0), (0.012, 20.0), (0.02, 35.0))  # m, degrees: a cap is flat, or its rim follows the mesh's edges
SHARP = np.cos(np.deg2rad(40.0))  # at a cap's rim the surface turns by more than this
MOSTLY = 0.5  # of the rim; around what is even of a crown, or of hair, it turns by little
CAP, CAP_SHARE = 0.01, 0.004  # m^2, and of the height's square, for children; a neck has 0.014 m^2
CAP_AT_END = 0.04  # share of the height by which such a rim may miss the end
WAIST, WAIST_SHARE = 0.04, 0.016  # the same; no hat is so wide
SHOULDERS = 2.0  # below a neck the body is so many times as broad, within
BELOW_NECK = 0.15  # m, where a head has no shoulders
BEHIND = 0.1  # share of the height at which a limb goes on behind its cap, as a foot does not behind its sole
SEEDS = 60  # triangles, large ones and any, that are looked at as part of a cap
UPRIGHT = 0.5  # of a cap's unit normal, upwards
GOES_ON = 0.6  # of the cap's breadth and depth

NECK, CROWN = 1.47, 1.72  # m above the floor, of whom patterns are drawn for: the default body
IN_PLACE = 0.15  # m, an upper end so near to where it belongs is left there


def cut_off(x: np.ndarray, faces: np.ndarray) -> str:
    """What there is to say about the ends of a surface x (V, 3) m, Y up, faces (F, 3); "" for a whole person."""
    return describe(missing_ends(x, faces))


def describe(missing: Mapping[str, str]) -> str:
    """What there is to say of what `missing_ends` found; "" for nothing."""
    return f"it is cut off: {', and '.join(missing.values())}" if missing else ""


def missing_ends(x: np.ndarray, faces: np.ndarray) -> dict[str, str]:
    """Of `ENDS` those that x (V, 3) m, Y up, faces (F, 3), lacks, each with what is there instead, for people."""
    if len(crowded_edges(faces)):
        return {}
    height = float(np.ptp(x[:, 1]))
    rims = [x[loop] for loop in boundary_loops(faces)]
    told = {}
    for name, (where, sign, missing) in ENDS.items():
        end = float((sign * x[:, 1]).max())
        there = [
            girth(rim)
            for rim in rims
            if end - (sign * rim[:, 1]).max() < AT_END * height and np.ptp(rim[:, 1]) < SLANT * height
        ]
        if max(there, default=0.0) > GIRTH:
            told[name] = f"{where} it ends in an open rim, {max(there):.2f} m around, where {missing} should be"
        elif area := _capped(x, faces, name):
            told[name] = f"{where} it ends in a flat cap of {1e4 * area:.0f} cm^2, where {missing} should be"
    return told


def girth(rim: np.ndarray) -> float:
    """Length [m] of a closed line through places (L, 3) m."""
    return float(np.linalg.norm(rim - np.roll(rim, 1, axis=0), axis=1).sum())


def stand_of_half(x: np.ndarray, faces: np.ndarray, lacks: frozenset[str], told: np.ndarray | None) -> Stand:
    """What puts a body x (V, 3) m, Y up, faces (F, 3), that `lacks` its legs where patterns expect its upper end.

    `told` (3,) the level unit vector that it faces along; +Z where it is not told.
    """
    angle = 0.0 if told is None else float(np.arctan2(told[0], told[2]))
    if abs(angle) < SQUARE:
        angle = 0.0
    stand = Stand(-angle, np.zeros(3), ())
    turned = x @ stand.turn.T
    middle, high = trunk_middle(turned, faces), float(turned[:, 1].max())
    belongs, what = (NECK, "a neck") if "head" in lacks else (CROWN, "the top of a head")
    shift = np.array([-middle[0], belongs - high, -middle[2]])
    way = "taken to face +Z" if told is None else "it faces +Z (as told)"
    if angle:
        way = f"turned by {abs(np.rad2deg(angle)):.0f}° about the vertical, to face +Z (as told)"
    notes = [f"it has no legs to stand on: {way}" + (", --body-facing says otherwise" if told is None else "")]
    if abs(shift[1]) < IN_PLACE:
        shift[1] = 0.0
    else:
        way = "raised" if shift[1] > 0 else "lowered"
        notes.append(f"{way} by {abs(shift[1]):.2f} m, its upper end to where patterns expect {what}, {belongs} m up")
    aside = float(np.hypot(shift[0], shift[2]))
    if aside < NEAR_MIDDLE:
        shift[[0, 2]] = 0.0
    else:
        notes.append(f"moved by {aside:.2f} m, to stand over x = z = 0")
    return Stand(-angle, shift, ("; ".join(notes),))


def _capped(x: np.ndarray, faces: np.ndarray, name: str) -> float:
    """The area [m^2] of the flat end of a limb or trunk that is cut off at one of `ENDS`; 0 where it does not end so:
    in a head, in soles, on a stand."""
    sign, height = ENDS[name][1], float(np.ptp(x[:, 1]))
    y = sign * x[:, 1]
    a, b, c = (x[faces[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    areas = 0.5 * np.linalg.norm(across, axis=1)
    normals = across / np.maximum(2.0 * areas, 1e-30)[:, None]
    middles = (a + b + c) / 3.0
    top = y.max() - y[faces]
    near = np.flatnonzero((top < SLANT * height).all(axis=1) & (areas > 0.0))
    seeds = near[(np.abs(normals[near, 1]) > UPRIGHT) & (top[near].min(axis=1) < CAP_AT_END * height)]
    largest = seeds[np.argsort(-areas[seeds])[:SEEDS]]
    spread, facing, places = areas[near], normals[near], middles[near]
    found = [(0.0, np.zeros(0, int)) for _ in EVEN]
    for k in [*largest, *seeds[:: max(1, len(seeds) // SEEDS)]]:
        cosines, distances = facing @ normals[k], np.abs((places - middles[k]) @ normals[k])
        for level, (within, degrees) in enumerate(EVEN):
            even = (cosines > np.cos(np.deg2rad(degrees))) & (distances < within)
            area = float(spread[even].sum())
            if area > found[level][0]:
                found[level] = area, near[even]
    for area, best in found:
        if area > min(CAP, CAP_SHARE * height**2) and _has_rim(x, faces, normals, best):
            break
    else:
        return 0.0
    cap = x[np.unique(faces[best])]
    if sign > 0.0:
        below = x[y > y.max() - BELOW_NECK]
        shoulders = np.ptp(below[:, [0, 2]], axis=0).max() > SHOULDERS * np.ptp(cap[:, [0, 2]], axis=0).max()
        return area if area > min(WAIST, WAIST_SHARE * height**2) or shoulders else 0.0
    behind = _section(x, faces, float(x[:, 1].min()) + BEHIND * height)
    goes_on = len(behind) and (np.ptp(behind, axis=0) > GOES_ON * np.ptp(cap[:, [0, 2]], axis=0)).all()
    return area if goes_on else 0.0


def _has_rim(x: np.ndarray, faces: np.ndarray, normals: np.ndarray, cap: np.ndarray) -> bool:
    """Whether the surface, an edge-manifold, turns off sharply around most of the triangles `cap` (K,), as around a
    cut."""
    one, other = sides_of_one_edge(faces)
    capped = np.isin(np.arange(len(faces)), cap)
    at_rim = capped[one // 3] != capped[other // 3]
    one, other = one[at_rim], other[at_rim]
    ends = x[face_edges(faces)[one]]
    lengths = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
    turns = np.einsum("ed,ed->e", normals[one // 3], normals[other // 3]) < SHARP
    return bool(lengths[turns].sum() > MOSTLY * lengths.sum())


def _section(x: np.ndarray, faces: np.ndarray, level: float) -> np.ndarray:
    """(K, 2) x and z [m] where edges pass through the plane y = `level`."""
    edges = distinct(ascending(face_edges(faces))).rows
    a, b = x[edges[:, 0]], x[edges[:, 1]]
    through = (a[:, 1] > level) != (b[:, 1] > level)
    a, b = a[through], b[through]
    share = (level - a[:, 1]) / (b[:, 1] - a[:, 1])
    return (a + share[:, None] * (b - a))[:, [0, 2]]
