"""A sewing pattern as it is worn, and the shapes that other patterns have in its mesh: found in any process.

Light to import: a process that works edits out has no need of the solver.
"""

from __future__ import annotations

import pickle
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import count
from typing import Any

from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.geometry.size import in_size
from tryon_solver.redesign.drag import Drag, Shape, drag_in_parts
from tryon_solver.redesign.parsed import parsed
from tryon_solver.redesign.remesh import Remesh

_numbers = count()
_begun: dict[int, Drag] = {}  # the drag of the last number that shapes were asked of here


@dataclass(frozen=True)
class WornPattern:
    """A sewing pattern as it is worn: plain JSON, meshed in `size` times its own by edges of `edge_length` m."""

    specification: Mapping[str, Any]
    panels: PanelMesh
    size: float
    edge_length: float

    def drag_in_parts(self, thickness: float) -> Iterator[Drag | None]:
        """Make it ready to take on other shapes in the same mesh; `thickness` m is the worn fabric's. None after each
        part but the last."""
        own = in_size(self.panels, 1.0 / self.size)
        return drag_in_parts(own, parsed(self.specification), thickness / self.size)

    def shapes(self, thickness: float) -> Shapes:
        """The shapes of other patterns in this mesh, of fabric so thick [m]."""
        return Shapes(next(_numbers), pickle.dumps((self, thickness)))


class NotKnownError(Exception):
    """Shapes are asked for in a worn pattern that this process was told nothing of."""


@dataclass(frozen=True, eq=False)
class Shapes:
    """Finds the shape of a pattern in a worn pattern's mesh. Can be pickled: what it is worn in travels along, and is
    made ready once where shapes are asked for one after the other.

    `number` is its own in the process that made it; `worn` a WornPattern and the fabric's thickness [m], pickled, or
    nothing for where it is known.
    """

    number: int
    worn: bytes

    def by_number(self) -> Shapes:
        """The same for a process that these were asked for in before: of 20,000 vertices 1.4 MB less to travel."""
        return Shapes(self.number, b"")

    def __call__(self, specification: Mapping[str, Any]) -> Shape | Remesh:
        """Remesh where that needs another mesh, as `Drag.moved`. Raises NotKnownError."""
        self.make_ready()
        moved = _begun[self.number].moved(parsed(specification))
        return moved if isinstance(moved, Remesh) else Shape(moved.uv, moved.placed)

    def make_ready(self) -> None:
        """Begin the drag that shapes are found by, in place of the one before. Raises NotKnownError."""
        if self.number in _begun:
            return
        if not self.worn:
            raise NotKnownError
        worn, thickness = pickle.loads(self.worn)
        *_, drag = worn.drag_in_parts(thickness)
        _begun.clear()
        _begun[self.number] = drag
