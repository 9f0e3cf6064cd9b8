"""Where the pieces start: around the body, clear of it and of each other, and so that the seams are short and free.

Each piece is rolled onto a cylinder around its part of the body: an upright one around the trunk, one along the arm for
a sleeve. Rolling does not stretch, and it brings the edges that are to be sewn next to each other. Pieces that lie side
by side, as the halves of a front, are rolled together (sheets.py). A piece too wide for that (a flared skirt) stays
flat, moved outwards as far as needed. Pieces are placed one after the other, from the trunk outwards, each clear of
those before; then what lies on a piece, over it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from tryon_solver.geometry.body_parts import FEWEST_VERTICES, find_arm, find_trunk
from tryon_solver.geometry.located_error import LocatedError
from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.geometry.proximity import Points, Surface
from tryon_solver.geometry.rolling import roll, roll_on_cone
from tryon_solver.geometry.sheets import Sheet, arm_side, flat_piece, sheets

# How far the cylinders are tried beyond the clearance: further out, seams get longer than those of flat pieces.
ROLL_DISTANCES = np.arange(0.0, 0.085, 0.005)  # m
SLEEVE_SHIFTS = np.arange(0.0, 0.16, 0.01)  # m, outwards along the arm
FLAT_MOVES = np.arange(0.0, 0.51, 0.01)  # m, outwards
UPRIGHT = 0.5  # cosine: a piece whose plane leans further from the vertical is not rolled around the trunk
BETWEEN = 2.0  # clearances between the pieces of a sheet: rolled, they come a little closer


class PlacementError(LocatedError):
    """A piece that cannot be placed: which, why, and what to do about it."""


def place_around(
    mesh: PanelMesh,
    body_vertices: Points,
    body_faces: NDArray[np.int32],
    clearance: float,
    worn: Sequence[Surface] = (),
) -> NDArray[np.float64]:
    """Positions (V, 3) m of the mesh's vertices around the body, pieces unstretched and at least clearance [m] apart,
    and from what is `worn` already, which they go around, too.

    body_vertices: (B, 3) m, y up, facing +z, arms away from the trunk. body_faces: (F, 3), closed, turning outwards.
    Raises PlacementError naming a piece that finds no free place.
    """
    body = Surface(np.asarray(body_vertices, dtype=np.float64), body_faces)
    trunk = find_trunk(body.vertices, body.faces)
    sides = [arm_side(mesh, index, trunk) for index in range(len(mesh.panel_names))]
    for index, side in enumerate(sides):
        if side and np.count_nonzero(trunk.arms(body.vertices, side)) < FEWEST_VERTICES:
            raise PlacementError(
                f"{mesh.panel_names[index]} belongs on an arm, and the body has none on that side",
                f"panels.{mesh.panel_names[index]}",
                "Give a body that stands upright on y = 0 over x = z = 0, faces +Z and holds its arms away from itself",
            )
    arms = {
        side: find_arm(body.vertices, trunk, side, mesh.placed[np.array(sides)[mesh.panel_of_vertex] == side])
        for side in set(sides) - {0}
    }
    pieces = [flat_piece(mesh, index, body.vertices, trunk, arms) for index in range(len(sides))]
    result = np.full((len(mesh.uv), 3), np.nan)
    placed: list[Surface] = list(worn)
    patches = set(np.unique(mesh.panel_of_vertex[mesh.laid.vertices]).tolist())
    alone = [sheet for sheet in sheets(mesh, pieces, BETWEEN * clearance) if not patches & set(sheet.panels)]
    for sheet in sorted(alone, key=lambda sheet: sheet.order):
        faces = [mesh.faces[mesh.panel_of_face == index] - mesh.first_vertex(index) for index in sheet.panels]
        for candidate in _candidates(sheet, clearance):
            surfaces = [Surface(points, own) for points, own in zip(sheet.split(candidate), faces)]
            if all(
                _is_clear(surface, body, placed + surfaces[:before], clearance)
                for before, surface in enumerate(surfaces)
            ):
                break
        else:
            names = " and ".join(mesh.panel_names[index] for index in sheet.panels)
            raise PlacementError(
                f"{names} finds no place clear of the body and of the other pieces",
                f"panels.{mesh.panel_names[sheet.panels[0]]}",
                "Move it away from the body with its translation, or check that pattern and body have the same size",
            )
        placed += surfaces
        for index, surface in zip(sheet.panels, surfaces):
            result[mesh.panel_of_vertex == index] = surface.vertices
    result[mesh.laid.vertices] = mesh.laid.on(result, mesh.faces, clearance)
    return result


def _is_clear(piece: Surface, body: Surface, placed: list[Surface], clearance: float) -> bool:
    if any(other.is_nearer_than(clearance, piece) for other in (body, *placed)):
        return False
    return not body.contains(piece.vertices[:1])[0]


def _candidates(sheet: Sheet, clearance: float) -> Iterator[Points]:
    """Places for the piece, best first: rolled close to the body, rolled further out, flat, flat and further out."""
    frame = np.stack([sheet.across, sheet.outward, sheet.along])
    plane, part = (sheet.positions @ frame.T)[:, [0, 2]], sheet.part @ frame.T
    upright = sheet.is_sleeve or abs(sheet.outward[1]) < UPRIGHT
    shifts = SLEEVE_SHIFTS if sheet.is_sleeve else np.zeros(1)
    tries = sorted((shift + distance, shift, distance) for shift in shifts for distance in ROLL_DISTANCES)
    for _, shift, distance in tries if upright else ():
        for onto in (roll,) if sheet.is_sleeve else (roll, roll_on_cone):
            rolled = onto(plane, part, clearance + distance)
            if rolled is not None:
                yield rolled @ frame - shift * sheet.along
    for move in FLAT_MOVES:
        yield sheet.positions + move * sheet.outward
