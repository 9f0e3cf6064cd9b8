"""Value edits of a meshed pattern, as a drag makes them: other pattern coordinates for the same triangles.

An edit of a drag is always taken from the drag's start, never from the edit before it: what the garment becomes depends
on where the designer lets go, not on the way there. What is made at the start serves every edit of the drag.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from tryon_solver.geometry import curves
from tryon_solver.geometry.altitudes import LARGEST_ASPECT, SMALLEST_ALTITUDE_SHARE, altitudes_of, sides_of
from tryon_solver.geometry.cage import Cage, build_cage
from tryon_solver.geometry.curves import Points
from tryon_solver.geometry.panel_mesh import PanelMesh, piece_frame
from tryon_solver.geometry.pattern import Panel, Pattern
from tryon_solver.geometry.sampled_outline import joined_outline, sample_edge
from tryon_solver.redesign.remesh import Remesh
from tryon_solver.redesign.structure import difference

SAME_PLACE = 1e-9  # m that a mesh's outline may miss the pattern it is of


@dataclass(frozen=True)
class _Piece:
    """A piece at the drag's start: its edges as they were sampled, points (K, 2) m each, and the cage of its mesh."""

    panel: Panel
    edges: tuple[Points, ...]
    cage: Cage

    def moved(self, panel: Panel) -> Points:
        """The piece's points (V, 2) m when it is drawn so, sampling only the edges that changed.

        Drawn as at the start it has the points of then, which may miss what is sampled by SAME_PLACE.
        """
        if all(curves.same(old.curve, new.curve) for old, new in zip(self.panel.edges, panel.edges)):
            return self.cage.points
        edges = [
            points if curves.same(old.curve, new.curve) else sample_edge(new, len(points) - 1)
            for points, old, new in zip(self.edges, self.panel.edges, panel.edges)
        ]
        return self.cage.moved(joined_outline(edges, panel.clockwise))


@dataclass(frozen=True)
class Shape:
    """What an edit of a drag makes of its mesh: `uv` (V, 2) m and `placed` (V, 3) m, as in PanelMesh."""

    uv: Points
    placed: Points


@dataclass(frozen=True)
class Drag:
    """A drag's start: the mesh, the pattern it is of, the cloth's thickness [m], and what every edit of it uses."""

    mesh: PanelMesh
    pattern: Pattern
    xi: float
    pieces: tuple[_Piece, ...]

    def moved(self, pattern: Pattern) -> PanelMesh | Remesh:
        """The mesh of the pattern after a value edit, with the vertices, faces and stitches of the start.

        The outline's vertices lie on the new edges, at the shares of their lengths at which they lay on the old ones;
        the inside follows as `Cage` says, but for what another piece lies on, which stays. Other are only `uv` and
        `placed`, the flat pieces where the new pattern puts them: a worn garment's positions are none of a mesh's, and
        lengths and areas at rest are read off `uv`. Remesh where another structure was drawn, or where a triangle
        would be one that the solver refuses.
        """
        why = difference(self.pattern, pattern)
        if why is not None:
            return why
        uv, placed = [], []
        for piece, panel in zip(self.pieces, pattern.panels):
            if panel.clockwise != piece.panel.clockwise:
                return Remesh(f"{panel.name!r} is turned over, its wrong side where its right side was", panel.name)
            uv.append(piece.moved(panel))
            placed.append(piece_frame(panel, uv[-1]))
        mesh = replace(self.mesh, uv=np.vstack(uv), placed=np.vstack(placed))
        return self._torn_off(mesh) or _fault(mesh, pattern, self.xi) or mesh

    def _torn_off(self, mesh: PanelMesh) -> Remesh | None:
        """A piece that lies on another whose fabric goes elsewhere beneath it, as it may at an edge; None without."""
        laid = mesh.laid
        way = np.abs(mesh.uv[laid.onto] - self.mesh.uv[laid.onto]).max(axis=(1, 2), initial=0.0)
        if not np.any(way > SAME_PLACE):
            return None
        name = mesh.panel_names[mesh.panel_of_vertex[laid.vertices[int(np.argmax(way))]]]
        return Remesh(f"what {name!r} is sewn on goes elsewhere beneath it", name)

    def mesh_in(self, shape: Shape) -> PanelMesh:
        """The mesh in a shape that an edit of it has."""
        return replace(self.mesh, uv=shape.uv, placed=shape.placed)


def begin_drag(mesh: PanelMesh, pattern: Pattern, xi: float) -> Drag:
    """What `drag_in_parts` comes to. Raises ValueError as that."""
    *_, drag = drag_in_parts(mesh, pattern, xi)
    assert drag is not None
    return drag


def drag_in_parts(mesh: PanelMesh, pattern: Pattern, xi: float) -> Iterator[Drag | None]:
    """The start of a drag of the pattern, whose mesh this is in the pattern's own size.

    xi [m] is the thickness of fabric that feels itself, as in `refuse_flat_triangles`; of a garment that is worn in
    another size, its thickness over that size, and `in_size` makes what is worn. None after each piece, then the drag.
    Raises ValueError for a mesh that is not the pattern's.
    """
    counts = [len(panel.edges) for panel in pattern.panels]
    if sum(counts) != len(mesh.segments) or mesh.panel_names != pattern.panel_names:
        raise ValueError("the mesh is of a pattern with other pieces or edges")
    pieces = []
    for index, (panel, segments) in enumerate(zip(pattern.panels, np.split(mesh.segments, np.cumsum(counts)[:-1]))):
        first, last = mesh.first_vertex(index), mesh.first_vertex(index + 1)
        points, faces = mesh.uv[first:last], mesh.faces[mesh.panel_of_face == index] - first
        edges = tuple(sample_edge(edge, n) for edge, n in zip(panel.edges, segments.tolist()))
        outline = joined_outline(edges, panel.clockwise)
        if np.abs(outline - points[: len(outline)]).max() > SAME_PLACE:
            raise ValueError(f"the mesh of {panel.name!r} is not of this pattern, or not in its own size")
        beneath = mesh.laid.onto[(mesh.laid.onto >= first) & (mesh.laid.onto < last)] - first
        pieces.append(_Piece(panel, edges, build_cage(points, faces, len(outline), beneath)))
        yield None
    yield Drag(mesh, pattern, xi, tuple(pieces))


def _fault(mesh: PanelMesh, pattern: Pattern, xi: float) -> Remesh | None:
    """The worst triangle of those that the solver would refuse at the thickness xi [m]; None when there are none."""
    altitude, side = altitudes_of(sides_of(mesh.uv, mesh.faces))
    flattest, lowest = int(np.argmin(altitude / side)), int(np.argmin(altitude))
    if altitude[flattest] * LARGEST_ASPECT <= side[flattest]:
        panel, near = _where(mesh, pattern, flattest)
        squeezed = f"{panel.name!r} is squeezed so far near {near} that its triangles there are almost without width"
        folded = f"{panel.name!r} is bent so far that its fabric would fold over itself near {near}"
        return Remesh(folded if altitude[flattest] <= 0 else squeezed, panel.name)
    if altitude[lowest] * SMALLEST_ALTITUDE_SHARE <= xi:
        panel, near = _where(mesh, pattern, lowest)
        high = f"{1e3 * altitude[lowest]:.2f} mm high, too little for a fabric {1e3 * xi:.2f} mm thick"
        return Remesh(f"{panel.name!r} is squeezed so far that triangles near {near} are only {high}", panel.name)
    return None


def _where(mesh: PanelMesh, pattern: Pattern, face: int) -> tuple[Panel, str]:
    """The triangle's piece, and its place in the plane in which that is drawn, in words."""
    panel = pattern.panels[int(mesh.panel_of_face[face])]
    x, y = 100 * mesh.uv[mesh.faces[face]].mean(axis=0) * (-1.0 if panel.clockwise else 1.0, 1.0)
    return panel, f"({x:.1f}, {y:.1f}) cm"
