"""Flat pieces in space, and the sheets that are placed: pieces sewn side by side are rolled around the body together.

The halves of a front lie beside each other in the pattern. Each by itself would slide towards the middle to keep to its
side of the body, and the second would come to lie over the first, where no stitch can pull the two apart.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tryon_solver.geometry.body_parts import Arm, Trunk
from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.geometry.proximity import Points

SAME_FACING = 0.9  # cosine of the angle between two pieces of one sheet
BESIDE = 0.05  # share of the narrower piece's width by which two that lie side by side may overlap
LEVEL = 0.5  # share of the lower piece's height over which two that lie side by side do so


@dataclass(frozen=True)
class Sheet:
    """One or several flat pieces side by side: point = origin + along * a + across * b, `outward` off the body."""

    panels: tuple[int, ...]  # indices of the pieces
    sizes: tuple[int, ...]  # number of vertices of each
    positions: Points  # (K, 3) m, piece after piece
    along: Points  # (3,) unit, direction of the cylinder's lines, up the trunk or up the arm
    across: Points  # (3,) unit
    outward: Points  # (3,) unit, across x along or its opposite
    part: Points  # (B, 3) m, vertices of the body's part that it goes around
    is_sleeve: bool

    @property
    def order(self) -> tuple[bool, float, float, int]:
        """Sorts sheets from the trunk outwards: trunk before arms, down the arms, out from the middle of the part."""
        middle = self.positions.mean(axis=0)
        depth = float((middle - self.part.mean(axis=0)) @ self.outward)
        down = -float(middle @ self.along) if self.is_sleeve else 0.0
        return self.is_sleeve, round(down, 2), depth, self.panels[0]

    def split(self, values: Points) -> list[Points]:
        """Values (K, d) of the sheet's vertices, piece by piece."""
        return np.split(values, np.cumsum(self.sizes)[:-1])


def flat_piece(mesh: PanelMesh, index: int, body: Points, trunk: Trunk, arms: dict[int, Arm]) -> Sheet:
    """The piece as the pattern places it, with its directions and its part of the body (B, 3) m.

    A piece of an arm is turned about the arm's root to lie along the arm as this body holds it.
    """
    mine = mesh.panel_of_vertex == index
    positions = mesh.placed[mine]
    side = arm_side(mesh, index, trunk)
    if side:
        arm = arms[side]
        positions = arm.turned(positions, _normal(mesh.uv[mine], positions))
        part, along = arm.behind(positions), arm.axis
    else:
        low, high = positions[:, 1].min(), positions[:, 1].max()
        level = (body[:, 1] >= low) & (body[:, 1] <= high) & ~trunk.arms(body, -1) & ~trunk.arms(body, 1)
        part = body[level] if level.any() else body
        along = np.array([0.0, 1.0, 0.0])
    normal = _normal(mesh.uv[mine], positions)
    along = along - (along @ normal) * normal
    along /= np.linalg.norm(along)
    # The trunk's middle decides what is outward; for a piece beside it, the nearest point of its axis does.
    outward = normal * (1.0 if (positions.mean(axis=0) - part.mean(axis=0)) @ normal >= 0 else -1.0)
    return Sheet((index,), (len(positions),), positions, along, np.cross(along, outward), outward, part, bool(side))


def arm_side(mesh: PanelMesh, index: int, trunk: Trunk) -> int:
    """The arm that the piece belongs to, +1 or -1, or 0."""
    return trunk.arm_side(mesh.placed[mesh.panel_of_vertex == index].mean(axis=0), mesh.panel_labels[index])


def _normal(uv: NDArray[np.float64], positions: Points) -> Points:
    """(3,) unit, of the flat piece."""
    ex, ey, _ = np.linalg.lstsq(np.column_stack([uv, np.ones(len(uv))]), positions, rcond=None)[0]
    normal: Points = np.cross(ex, ey)
    return normal / np.linalg.norm(normal)


def sheets(mesh: PanelMesh, pieces: list[Sheet], apart: float) -> list[Sheet]:
    """The pieces, those that are sewn to each other and lie side by side joined, their boxes `apart` [m]."""
    group = list(range(len(pieces)))
    sewn = np.unique(np.sort(mesh.panel_of_vertex[mesh.stitches], axis=1), axis=0).tolist()
    for one, other in sewn:
        if one != other and _side_by_side(pieces[one], pieces[other]):
            group = [group[one] if g == group[other] else g for g in group]
    members = [[piece for piece, of in zip(pieces, group) if of == g] for g in dict.fromkeys(group)]
    return [_joined(several, apart) if len(several) > 1 else several[0] for several in members]


def _side_by_side(one: Sheet, other: Sheet) -> bool:
    if one.is_sleeve or other.is_sleeve or one.outward @ other.outward < SAME_FACING:
        return False

    def extents(direction: Points) -> tuple[float, float]:
        a, b = one.positions @ direction, other.positions @ direction
        common = min(a.max(), b.max()) - max(a.min(), b.min())
        return float(common), float(min(np.ptp(a), np.ptp(b)))

    (wide, width), (high, height) = extents(one.across), extents(one.along)
    return wide <= BESIDE * width and high >= LEVEL * height


def _joined(pieces: list[Sheet], apart: float) -> Sheet:
    """One sheet of the pieces: moved across, in the order in which they lie, until their boxes are `apart`."""
    first = pieces[0]
    boxes = np.array([[(p.positions @ first.across).min(), (p.positions @ first.across).max()] for p in pieces])
    order = np.argsort(boxes.mean(axis=1))
    widths = np.ptp(boxes, axis=1)[order]
    starts = np.concatenate([[0.0], np.cumsum(widths + apart)[:-1]])
    starts += (boxes[:, 0].min() + boxes[:, 1].max() - starts[-1] - widths[-1]) / 2  # the middle stays
    moved = [
        pieces[k].positions + (start - boxes[k, 0]) * first.across for k, start in zip(order.tolist(), starts.tolist())
    ]
    return replace(
        first,
        panels=tuple(pieces[k].panels[0] for k in order),
        sizes=tuple(len(points) for points in moved),
        positions=np.vstack(moved),
        part=np.unique(np.vstack([piece.part for piece in pieces]), axis=0),
    )
