"""Where the pieces start: around the body, clear of it and of each other, and so that the seams are short and free.

Each piece is rolled onto a cylinder around its part of the body: an upright one around the trunk, one along the arm for
a sleeve. Rolling does not stretch, and it brings the edges that are to be sewn next to each other. A piece too wide for
that (a flared skirt) stays flat, moved outwards as far as needed. Pieces are placed one after the other, from the trunk
outwards, each clear of those before.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tryon_solver.geometry.body_parts import Trunk, find_trunk
from tryon_solver.geometry.located_error import LocatedError
from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.geometry.proximity import Points, Surface
from tryon_solver.geometry.rolling import roll, roll_on_cone

# How far the cylinders are tried beyond the clearance: further out, seams get longer than those of flat pieces.
ROLL_DISTANCES = np.arange(0.0, 0.085, 0.005)  # m
SLEEVE_SHIFTS = np.arange(0.0, 0.16, 0.01)  # m, outwards along the arm
FLAT_MOVES = np.arange(0.0, 0.51, 0.01)  # m, outwards
UPRIGHT = 0.5  # cosine: a piece whose plane leans further from the vertical is not rolled around the trunk


class PlacementError(LocatedError):
    """A piece that cannot be placed: which, why, and what to do about it."""


@dataclass(frozen=True)
class _Flat:
    """A flat piece in space: point = origin + along * a + across * b, `outward` away from the body."""

    positions: Points  # (K, 3) m
    along: Points  # (3,) unit, direction of the cylinder's lines, up the trunk or up the arm
    across: Points  # (3,) unit
    outward: Points  # (3,) unit, across x along or its opposite
    part: Points  # (B, 3) m, vertices of the body's part that it goes around
    is_sleeve: bool

    @property
    def depth(self) -> float:
        """How far [m] the piece's plane lies outside the middle of its part."""
        return float((self.positions.mean(axis=0) - self.part.mean(axis=0)) @ self.outward)


def place_around(
    mesh: PanelMesh, body_vertices: Points, body_faces: NDArray[np.int32], clearance: float
) -> NDArray[np.float64]:
    """Positions (V, 3) m of the mesh's vertices around the body, pieces unstretched and at least clearance [m] apart.

    body_vertices: (B, 3) m, y up, facing +z, arms away from the trunk. body_faces: (F, 3), closed, turning outwards.
    Raises PlacementError naming a piece that finds no free place.
    """
    body = Surface(np.asarray(body_vertices, dtype=np.float64), body_faces)
    trunk = find_trunk(body.vertices, body.faces)
    flats = [_flat_piece(mesh, index, body.vertices, trunk) for index in range(len(mesh.panel_names))]
    order = sorted(range(len(flats)), key=lambda index: (flats[index].is_sleeve, flats[index].depth, index))
    result = np.full((len(mesh.uv), 3), np.nan)
    placed: list[Surface] = []
    for index in order:
        vertices = mesh.panel_of_vertex == index
        faces = mesh.faces[mesh.panel_of_face == index] - mesh.first_vertex(index)
        for candidate in _candidates(flats[index], clearance):
            surface = Surface(candidate, faces)
            if _is_clear(surface, body, placed, clearance):
                result[vertices] = candidate
                placed.append(surface)
                break
        else:
            raise PlacementError(
                "the piece finds no place clear of the body and of the other pieces",
                f"panels.{mesh.panel_names[index]}",
                "Move it away from the body with its translation, or check that pattern and body have the same size",
            )
    return result


def _is_clear(piece: Surface, body: Surface, placed: list[Surface], clearance: float) -> bool:
    if any(other.is_nearer_than(clearance, piece) for other in (body, *placed)):
        return False
    return not body.contains(piece.vertices[:1])[0]


def _flat_piece(mesh: PanelMesh, index: int, body: Points, trunk: Trunk) -> _Flat:
    """The piece as the pattern places it, with its directions and its part of the body."""
    mine = mesh.panel_of_vertex == index
    positions = mesh.placed[mine]
    uv = np.column_stack([mesh.uv[mine], np.ones(len(positions))])
    ex, ey, _ = np.linalg.lstsq(uv, positions, rcond=None)[0]
    normal = np.cross(ex, ey)
    centre = positions.mean(axis=0)
    side = trunk.arm_side(centre, mesh.panel_labels[index])
    if side:
        part, along = _arm_near(body[trunk.arms(body, side)], positions, ex, ey)
    else:
        low, high = positions[:, 1].min(), positions[:, 1].max()
        level = (body[:, 1] >= low) & (body[:, 1] <= high) & ~trunk.arms(body, -1) & ~trunk.arms(body, 1)
        part = body[level] if level.any() else body
        along = np.array([0.0, 1.0, 0.0])
    along = along - (along @ normal) * normal
    along /= np.linalg.norm(along)
    # The trunk's middle decides what is outward; for a piece beside it, the nearest point of its axis does.
    middle = part.mean(axis=0)
    outward = normal * (1.0 if (centre - middle) @ normal >= 0 else -1.0)
    return _Flat(positions, along, np.cross(along, outward), outward, part, bool(side))


def _arm_near(arm: Points, positions: Points, ex: Points, ey: Points) -> tuple[Points, Points]:
    """The arm's vertices behind or before the flat piece, and the direction of the arm there."""
    inside = np.ones(len(arm), dtype=bool)
    for axis in (ex, ey):
        coordinates = positions @ axis
        inside &= (arm @ axis >= coordinates.min()) & (arm @ axis <= coordinates.max())
    part = arm[inside] if np.count_nonzero(inside) >= 8 else arm
    spread = part - part.mean(axis=0)
    axis = np.linalg.eigh(spread.T @ spread)[1][:, 2]
    return part, axis * -np.sign(axis @ (spread[np.argmax(np.abs(part[:, 0]))]))


def _candidates(flat: _Flat, clearance: float) -> Iterator[Points]:
    """Places for the piece, best first: rolled close to the body, rolled further out, flat, flat and further out."""
    frame = np.stack([flat.across, flat.outward, flat.along])
    plane, part = (flat.positions @ frame.T)[:, [0, 2]], flat.part @ frame.T
    upright = flat.is_sleeve or abs(flat.outward[1]) < UPRIGHT
    shifts = SLEEVE_SHIFTS if flat.is_sleeve else np.zeros(1)
    tries = sorted((shift + distance, shift, distance) for shift in shifts for distance in ROLL_DISTANCES)
    for _, shift, distance in tries if upright else ():
        for onto in (roll,) if flat.is_sleeve else (roll, roll_on_cone):
            rolled = onto(plane, part, clearance + distance)
            if rolled is not None:
                yield rolled @ frame - shift * flat.along
    for move in FLAT_MOVES:
        yield flat.positions + move * flat.outward
