"""The rest shape of a mesh garment: its pattern, where texture coordinates are one, or else the shape it comes in.

Texture coordinates are a pattern when, in metres or in the file's unit, they have the size of the surface in space:
cloth hardly stretches, so a flat piece has nearly the lengths of the same piece worn, in all directions (distortion.py:
what a texture's square is filled with may have a garment's size by chance). A few triangles that are far from
that in a pattern (a seam of the texture that was not split, a stray coordinate) rest as they come, the others in it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tryon_solver.geometry.distortion import measure
from tryon_solver.geometry.surface_repair import connected_faces, neighbours

REST_SHAPES = ("pattern", "shape")
"""Which may be told."""

SAME_SIZE = (0.8, 1.25)  # median length in the pattern over that in space
SAME_LENGTH = 0.03  # by how much that may miss 1 untold
SPREAD = (0.5, 2.0)  # nearly all lengths are within this; gathers and what is stretched, too
NEARLY_ALL = (2.0, 98.0)  # per cent
FAR = (0.25, 4.0)  # a triangle whose longest side is outside this, or its height below, is none of the pattern's
FEW = 0.05  # share of the triangles that may be so
SAME_PLACE = 1e-6  # m, in the pattern: sides that lie on each other are no seam
SMOOTHING = 20  # rounds in which the direction a triangle faces is averaged with its neighbours'
SMALLEST_CHART = 12  # triangles; smaller patches join a neighbour


@dataclass(frozen=True)
class Doubt:
    """Triangles `faces` (K,) of which something is told, and what could be done about them."""

    told: str
    faces: np.ndarray
    remedy: str


@dataclass(frozen=True)
class RestShape:
    """Pattern coordinates of a mesh garment.

    `uv_corners` (F, 3, 2) m, each triangle counter-clockwise; `panel_of_face` (F,) int32 the piece or patch;
    `spline_corners` (F, 3, 2) m where the subspace lays its splines, None for uv_corners; `told` in words; `doubts`
    of single triangles; `no_pattern` why its texture coordinates are not taken as one, empty where they are or need not
    be.
    """

    uv_corners: np.ndarray
    panel_of_face: np.ndarray
    spline_corners: np.ndarray | None
    told: str
    doubts: tuple[Doubt, ...] = ()
    no_pattern: str = ""


def find_rest_shape(
    x: np.ndarray, faces: np.ndarray, uv: np.ndarray | None, unit: str, unit_size: float, told: str | None = None
) -> RestShape:
    """The rest shape of the surface x (V, 3) m with faces (F, 3).

    `uv` (F, 3, 2) texture coordinates or None; `unit` and `unit_size` m are the file's; `told` which of REST_SHAPES it
    is, None to find it out. Texture coordinates that are told to be a pattern need not have the size it is worn in, but
    some are none all the same: see RestShape.no_pattern.
    """
    if told == "shape":
        return from_shape(x, faces, "the shape it comes in, as told")
    if uv is None:
        return _no_pattern(x, faces, "the file has no texture coordinates")
    corners = x[faces]
    in_space = np.linalg.norm(corners[:, [1, 2, 0]] - corners, axis=2)
    in_pattern = np.linalg.norm(uv[:, [1, 2, 0]] - uv, axis=2)
    ratio = in_pattern / np.maximum(in_space, 1e-12)
    median = float(np.median(ratio))
    readings = {"metres": 1.0, unit: unit_size} if unit != "m" else {"metres": 1.0}
    name, size = min(readings.items(), key=lambda item: abs(np.log(max(item[1] * median, 1e-300))))
    scale = median * size
    low, high = np.percentile(ratio, NEARLY_ALL)
    why = f"its texture coordinates have {low:.2g} to {high:.2g} times its lengths in metres and are no pattern"
    if not SPREAD[0] <= scale <= SPREAD[1]:
        return _no_pattern(x, faces, why)
    longest = size * in_pattern.max(axis=1) / in_space.max(axis=1)
    height = np.abs(_signed_areas(size * uv)) / np.maximum(_areas(corners) * longest, 1e-30)
    far = _outside(longest, FAR) | (height < FAR[0])
    same = SAME_SIZE[0] <= scale <= SAME_SIZE[1]
    if far.mean() > FEW:
        return _no_pattern(x, faces, why, _doubts_of_far(longest, far) if same or told else ())
    low, high = np.percentile(ratio[~far] * size, NEARLY_ALL)
    if not told and not (same and low >= SPREAD[0] and high <= SPREAD[1]):
        return _no_pattern(x, faces, f"{why}; --rest-shape pattern if they are one")
    distortion = measure(corners[~far], uv[~far])
    if not told and distortion.is_texture(scale):
        why = f"its texture coordinates {distortion.describe()} and have {scale:.2f} times its lengths in {name}"
        return _no_pattern(x, faces, f"{why}, as a texture's do and no pattern's; --rest-shape pattern if they are one")
    shape = _from_pattern(x, faces, uv * size, far, scale, longest)
    words = f"the pattern in its texture coordinates, in {name}{', as told' if told else ''}; {shape.told}"
    doubtful = []
    if abs(scale - 1.0) > SAME_LENGTH:
        doubtful.append(f"its lengths are {scale:.2f} times those of the shape it comes in")
    if distortion.uneven:
        doubtful.append(f"its coordinates {distortion.describe()}")
    words = "; ".join([words, *doubtful])
    words += ", --rest-shape shape if it is no pattern" if doubtful and not told else ""
    return replace(shape, told=words)


def _no_pattern(x: np.ndarray, faces: np.ndarray, why: str, doubts: tuple[Doubt, ...] = ()) -> RestShape:
    return replace(from_shape(x, faces, f"the shape it comes in, as {why}"), no_pattern=why, doubts=doubts)


def _doubts_of_far(longest: np.ndarray, far: np.ndarray) -> tuple[Doubt, ...]:
    """What is told of triangles `far` (F,) bool, whose longest sides are `longest` (F,) times those in space."""
    if not far.any():
        return ()
    low, high = float(longest[far].min()), float(longest[far].max())
    how = [f"up to {high:.0f} times as long"] * (high > FAR[1]) + [f"only {low:.2g} times as long"] * (low < FAR[0])
    there = "in its texture coordinates"
    what = f"{' or '.join(how)} {there} as where they lie" if how else f"almost without width {there}"
    remedy = "split the texture along its seams there, or mend its coordinates"
    return (Doubt(f"{far.sum()} of its {len(far)} triangles are {what}", np.flatnonzero(far), remedy),)


def _outside(values: np.ndarray, limits: tuple[float, float]) -> np.ndarray:
    return (values < limits[0]) | (values > limits[1])


def _from_pattern(
    x: np.ndarray, faces: np.ndarray, uv: np.ndarray, far: np.ndarray, scale: float, longest: np.ndarray
) -> RestShape:
    """Rest in the pattern uv (F, 3, 2) m, but for those `far` (F,) bool from it: these rest as they come, `scale` times
    as large, as the others are, in patches of their own. `longest` (F,) as in _doubts_of_far; told is of pieces."""
    pairs = neighbours(faces)
    first, second, side, other = pairs.T
    a = np.stack([uv[first, side], uv[first, (side + 1) % 3]], axis=1)
    b = np.stack([uv[second, other], uv[second, (other + 1) % 3]], axis=1)
    match = faces[first, side] == faces[second, other]
    b = np.where(match[:, None, None], b, b[:, ::-1])
    sign = np.sign(_signed_areas(uv))
    # mirrored halves may lie on each other: what is folded along a side is two pieces
    joined = (np.abs(a - b).max(axis=(1, 2)) < SAME_PLACE) & (sign[first] == sign[second])
    joined &= ~far[first] & ~far[second]
    pieces, piece = np.unique(connected_faces(len(faces), pairs[joined, :2])[~far], return_inverse=True)
    told = f"{len(pieces)} pieces"
    panel = np.zeros(len(faces), np.int32)
    panel[~far] = piece
    turned = np.where((sign < 0)[:, None, None], uv * [-1.0, 1.0], uv)
    odd = ~far & _outside(longest, SPREAD)
    doubts = tuple(replace(doubt, told=f"{doubt.told}, and rest as they lie") for doubt in _doubts_of_far(longest, far))
    if odd.any():
        low, high = float(longest[odd].min()), float(longest[odd].max())
        odd_told = f"{odd.sum()} of its triangles are {low:.2g} to {high:.2g} times as long in its pattern as they lie"
        remedy = "mend its coordinates there if they are not gathered or stretched so"
        doubts += (Doubt(odd_told, np.flatnonzero(odd), remedy),)
    if not far.any():
        return RestShape(turned, panel, None, told, doubts)
    patches = from_shape(x, faces[far], "")
    turned[far] = scale * patches.uv_corners
    panel[far] = len(pieces) + patches.panel_of_face
    spline = turned.copy()
    spline[far] = patches.spline_corners
    return RestShape(turned, panel, spline, told, doubts)


def from_shape(x: np.ndarray, faces: np.ndarray, told: str) -> RestShape:
    """Every triangle flattened as it is, its u level and its v upwards as in a drawn pattern; no curvature at rest."""
    corners = x[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    upward = np.array([0.0, 1.0, 0.0]) - normal[:, [1]] * normal
    level = np.linalg.norm(upward, axis=1) < 0.1  # a triangle that lies: forwards instead of upwards
    ahead = np.array([0.0, 0.0, 1.0]) - normal[:, [2]] * normal
    upward = np.where(level[:, None], ahead, upward)
    upward /= np.linalg.norm(upward, axis=1, keepdims=True)
    across = np.cross(upward, normal)
    relative = corners - corners[:, :1]
    uv = np.stack([np.einsum("fkd,fd->fk", relative, across), np.einsum("fkd,fd->fk", relative, upward)], axis=-1)
    chart, spline = _charts(x, faces, normal)
    return RestShape(uv, chart, spline, told)


def _charts(x: np.ndarray, faces: np.ndarray, normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Patches (F,) int32 that face one way, and coordinates (F, 3, 2) m over them: their view along that axis."""
    pairs = neighbours(faces)[:, :2]
    smooth = normal.copy()
    for _ in range(SMOOTHING):
        total = smooth.copy()
        np.add.at(total, pairs[:, 0], smooth[pairs[:, 1]])
        np.add.at(total, pairs[:, 1], smooth[pairs[:, 0]])
        smooth = total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-30)
    axis = np.abs(smooth).argmax(axis=1)
    facing = 2 * axis + (smooth[np.arange(len(faces)), axis] < 0)
    chart = _patches(facing, pairs)
    for _ in range(len(faces)):
        sizes = np.bincount(chart)
        small = sizes[chart] < SMALLEST_CHART
        touching = pairs[(chart[pairs[:, 0]] != chart[pairs[:, 1]])]
        takes = np.concatenate([touching, touching[:, ::-1]])
        takes = takes[small[takes[:, 0]] & (sizes[chart[takes[:, 1]]] > sizes[chart[takes[:, 0]]])]
        if not len(takes):
            break
        lost, gives = chart[takes[0, 0]], facing[takes[0, 1]]
        facing[chart == lost] = gives
        chart = _patches(facing, pairs)
    planes = np.array([[2, 1], [0, 2], [0, 1]])[facing // 2]
    return chart.astype(np.int32), np.take_along_axis(x[faces], planes[:, None, :].repeat(3, axis=1), axis=2)


def _patches(facing: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    alike = facing[pairs[:, 0]] == facing[pairs[:, 1]]
    return connected_faces(len(facing), pairs[alike])


def _areas(corners: np.ndarray) -> np.ndarray:
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return 0.5 * np.linalg.norm(np.cross(a, b), axis=1)


def _signed_areas(uv: np.ndarray) -> np.ndarray:
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    return 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
