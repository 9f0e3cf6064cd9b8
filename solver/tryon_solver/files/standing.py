"""Where a stranger's body stands and which way it faces, and how it is put where patterns expect a body. Ours.

Pieces of a pattern are placed around a body that stands on y = 0 over x = z = 0 and faces +Z. A mesh may have its
origin at the pelvis, stand aside, look elsewhere or have its head down. Its feet tell: each reaches forwards from its
ankle; the breadth of the chest says the rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from tryon_solver.files.raw_mesh import MeshFileError

SHIN = 0.2  # share of the height: below the knees, a foot that is lifted while walking with it, each leg is a piece
SOLE = 0.03  # of a foot is so low, as a share of the height, counted from the foot's own lowest point
ANKLE = (0.08, 0.12)  # and within these the ankle
REACH = 0.012  # share of the height by which a foot reaches out before its ankle at least
SMALL = 0.1  # share of the vertices at a height that a foot, or the trunk, has at least
CHEST = (0.70, 0.82)  # shares of the height
BROAD = 1.3  # the chest is so many times as broad as it is deep, in standard deviations
AGREE = np.cos(np.deg2rad(50.0))  # the feet, which turn out, and the chest point the same way within this angle
SQUARE = np.deg2rad(20.0)  # a facing so near to an axis is taken as it
TALLEST = 1.6  # a body that stands is no more than so many times as broad or deep as it is tall: its span is less
WAIST = (0.52, 0.64)  # shares of the height: the middle of the trunk there, beside which arms hang, goes over x = z = 0
NEAR_FLOOR = 0.02  # m, what is so near to where it should be is left there
NEAR_MIDDLE = 0.06  # m, the same of the middle, which a step moves
OVER = np.array([-1.0, -1.0, 1.0])  # half a turn about z
UNDER_FLOOR = 0.1  # m, a body without feet that tell, which can't be put elsewhere, is no further below
ASIDE = 0.3  # m, nor further aside than this


@dataclass(frozen=True)
class Stand:
    """What puts a body where patterns expect it: x goes to R x + `shift`, R the turn by `angle` rad about Y."""

    angle: float
    shift: np.ndarray  # (3,) m
    notes: tuple[str, ...]

    @property
    def turn(self) -> np.ndarray:
        """(3, 3) R."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def feet(x: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(K, 3) m: how far each foot of a surface x (V, 3) m, Y up, faces (F, 3), reaches out before its ankle, level."""
    height = max(float(np.ptp(x[:, 1])), 1e-12)
    low = x[:, 1] < x[:, 1].min() + SHIN * height
    found = []
    for chosen in _pieces(faces, low):
        foot = x[chosen]
        if len(foot) < SMALL * low.sum():
            continue
        share = (foot[:, 1] - foot[:, 1].min()) / height
        ankle = foot[(share > ANKLE[0]) & (share < ANKLE[1])]
        if not len(ankle):
            continue
        reach = _middle(foot[share < SOLE]) - _middle(ankle)
        reach[1] = 0.0
        if np.linalg.norm(reach) > REACH * height:
            found.append(reach)
    return np.array(found).reshape(-1, 3)


def stands(x: np.ndarray, faces: np.ndarray) -> bool:
    """Whether x (V, 3) m, Y up, with faces (F, 3), has two feet that point alike below, and not above."""
    return _are_pair(feet(x, faces)) and not _are_pair(feet(x * OVER, faces))


def stands_on_its_head(x: np.ndarray, faces: np.ndarray) -> bool:
    """Whether x (V, 3) m, Y up, with faces (F, 3), has two feet that point alike above, and not below."""
    return stands(x * OVER, faces)


def facing(x: np.ndarray, faces: np.ndarray) -> np.ndarray | None:
    """(3,) the level unit vector that x (V, 3) m, Y up, with faces (F, 3), faces along; None where no foot tells.

    Across the breadth of the chest, where the chest is broad and the feet point about there; else where they point.
    """
    reaches = feet(x, faces)
    forwards = reaches.sum(axis=0)
    if not len(reaches) or np.linalg.norm(forwards) <= REACH * np.ptp(x[:, 1]) * len(reaches):
        return None
    forwards /= np.linalg.norm(forwards)
    share = (x[:, 1] - x[:, 1].min()) / np.ptp(x[:, 1])
    chest = x[(share > CHEST[0]) & (share < CHEST[1])][:, [0, 2]]
    if len(chest) > 2:
        spread, axes = np.linalg.eigh(np.cov(chest.T))
        across = np.array([axes[0, 0], 0.0, axes[1, 0]])  # of the least spread
        across *= np.sign(across @ forwards) or 1.0
        if spread[1] > BROAD**2 * spread[0] and across @ forwards > AGREE:
            return across
    return forwards


def find_stand(x: np.ndarray, faces: np.ndarray, name: str, told: np.ndarray | None = None) -> Stand:
    """What puts the body x (V, 3) m, Y up, with faces (F, 3), as it is dressed, where patterns expect it.

    `told` (3,) the level unit vector that it faces along, where that is known.

    A body without feet that tell, as a tailor's dummy, is left as it is, which is said. Raises MeshFileError when it
    does not stand, or not on its feet, or has no such feet and is clearly elsewhere.
    """
    extent = np.ptp(x, axis=0)
    if extent[[0, 2]].max() > TALLEST * extent[1]:
        raise MeshFileError(
            f"it does not stand: it is {extent[1]:.2f} m high and {extent[[0, 2]].max():.2f} m long",
            name,
            "A pattern is put on a body that stands in its first frame: begin with one, or say which axis is up with "
            "--body-up",
        )
    if stands_on_its_head(x, faces):
        raise MeshFileError(
            "its feet are above its head in its first frame, and below in later ones",
            name,
            "A pattern is put on a body that stands in its first frame: begin with one",
        )
    forwards = facing(x, faces) if told is None else told
    if forwards is None:
        middle, low = trunk_middle(x, faces), float(x[:, 1].min())
        if low < -UNDER_FLOOR or np.hypot(middle[0], middle[2]) > ASIDE:
            raise MeshFileError(
                "its feet don't tell which way it faces, and it does not stand on y = 0 over x = z = 0, where patterns "
                f"expect a body: its lowest point is at y = {low:.2f} m, its middle at x = {middle[0]:.2f}, "
                f"z = {middle[2]:.2f} m",
                name,
                "Say which way it faces with --body-facing, or move it there, facing +Z, before exporting it",
            )
        note = (
            "its feet don't tell which way it faces: it is left where it is, taken to face +Z and to stand on y = 0 "
            "over x = z = 0, where patterns expect a body; --body-facing says otherwise"
        )
        return Stand(0.0, np.zeros(3), (note,))
    notes = []
    how = "" if told is None else " (as told)"
    found = float(np.arctan2(forwards[0], forwards[2]))  # from +Z towards +X
    quarter = np.pi / 2 * round(found / (np.pi / 2))
    if abs(found - quarter) < SQUARE:
        found = quarter
    stand = Stand(-found, np.zeros(3), ())
    turned = x @ stand.turn.T
    if found:
        notes.append(f"turned by {abs(np.rad2deg(found)):.0f}° about the vertical, to face +Z{how}")
    middle = trunk_middle(turned, faces)
    shift = -np.array([middle[0], turned[:, 1].min(), middle[2]])
    if abs(shift[1]) < NEAR_FLOOR:
        shift[1] = 0.0
    else:
        notes.append(f"stood on the floor: {'raised' if shift[1] > 0 else 'lowered'} by {abs(shift[1]):.2f} m")
    aside = float(np.hypot(shift[0], shift[2]))
    if aside < NEAR_MIDDLE:
        shift[[0, 2]] = 0.0
    else:
        notes.append(f"moved by {aside:.2f} m, to stand over x = z = 0")
    if notes:
        notes[0] = f"put where patterns expect a body: {notes[0]}"
    return Stand(-found, shift, tuple(notes))


def trunk_middle(x: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(3,) m: the middle of the trunk at the waist of x (V, 3) m, Y up, with faces (F, 3)."""
    return _middle(_trunk(x, faces))


def _trunk(x: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(K, 3) the vertices of the trunk at the waist: of its pieces there, arms and all, the one below the chest."""
    share = (x[:, 1] - x[:, 1].min()) / np.ptp(x[:, 1])
    waist, chest = (share > WAIST[0]) & (share < WAIST[1]), x[(share > CHEST[0]) & (share < CHEST[1])]
    pieces = [x[piece] for piece in _pieces(faces, waist) if len(piece) >= SMALL * waist.sum()]
    if not pieces or not len(chest):
        return x
    above = chest.mean(axis=0)
    return min(pieces, key=lambda piece: float(np.linalg.norm((_middle(piece) - above)[[0, 2]])))


def _pieces(faces: np.ndarray, chosen: np.ndarray) -> list[np.ndarray]:
    """Which vertices each of the pieces has into which the surface falls that has only the chosen (V,) bool."""
    kept = faces[chosen[faces].all(axis=1)]
    ends = (np.concatenate([kept[:, 0], kept[:, 1]]), np.concatenate([kept[:, 1], kept[:, 2]]))
    links = sp.coo_matrix((np.ones(len(ends[0])), ends), shape=(len(chosen), len(chosen)))
    part = connected_components(links, directed=False)[1]
    order = np.argsort(part[chosen], kind="stable")
    members = np.flatnonzero(chosen)[order]
    return np.split(members, np.flatnonzero(np.diff(part[members])) + 1) if len(members) else []


def _are_pair(reaches: np.ndarray) -> bool:
    return len(reaches) == 2 and float(reaches[0] @ reaches[1]) > 0


def _middle(x: np.ndarray) -> np.ndarray:
    return (x.min(axis=0) + x.max(axis=0)) / 2
