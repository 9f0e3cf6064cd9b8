"""A pattern's mesh as it is made for a garment that is worn: by another process, with what both have meshed before.

Light to import: a process that meshes has no need of the solver.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from tryon_server.problems import problem_error
from tryon_solver.dressing.new_cut import NewCut
from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.geometry.pattern import PatternError, parse_pattern
from tryon_solver.geometry.piece_meshes import PieceKey, PieceMesh, keep, kept
from tryon_solver.geometry.size import mesh_in_size


@dataclass(frozen=True, eq=False)
class Cut:
    """A pattern, plain JSON, as it is cut anew of the `fabric` of this name, and the meshes of its pieces to be kept,
    None of those that were known."""

    specification: Mapping[str, Any]
    fabric: str
    made: NewCut
    pieces: Mapping[PieceKey, PieceMesh | None]


@dataclass(frozen=True, eq=False)
class Cutting:
    """Meshes a pattern, plain JSON, in `size` times its own by edges of `edge_length` m. Call it in any process.

    `worn` is the mesh that it is to be put on from, in that size, too; `spacing` is the basis's, in mean edges; `known`
    are meshes of pieces that need not be made again.
    """

    specification: Mapping[str, Any]
    worn: PanelMesh
    edge_length: float
    size: float
    spacing: float
    fabric: str
    known: Mapping[PieceKey, PieceMesh | None]

    def __call__(self) -> Cut:
        """Raises ProblemError for a pattern that can't be meshed so."""
        keep(self.known)
        try:
            panels = mesh_in_size(parse_pattern(self.specification), self.edge_length, self.size)
        except PatternError as error:
            raise problem_error("pattern.invalid", error.message, error.remedy, place=error.place) from error
        pieces = {key: None if key in self.known else mesh for key, mesh in kept().items()}
        return Cut(self.specification, self.fabric, NewCut.of(panels, self.worn, self.spacing), pieces)
