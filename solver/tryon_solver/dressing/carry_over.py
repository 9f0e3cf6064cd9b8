"""The next cut of a garment put on from the one that is worn: Algorithm 2's edit where triangles or seams change.

Every vertex of the new mesh lies where the fabric lay that it is made of: the pieces' flat places say which triangle
of the old mesh that was. Places, and velocities with them, are carried over from there. What is sewn together now
meets in the middle, with the fabric beside it; what was sewn and is open now is drawn back by a fabric's thickness; a
pocket is laid on the fabric that it is sewn on. The state is then freed of contact as a garment that comes as a mesh
is (dressing/untangle.py), and goes on from there with the body where it is.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tryon_solver.build_in_parts import build_in_parts
from tryon_solver.dressing.new_cut import NewCut
from tryon_solver.dressing.returned import REACHES, Hung, Returning, lacking, torn
from tryon_solver.dressing.stitching_on import stitched_on, without_stitches
from tryon_solver.dressing.untangle import Freed, Tangle, TangledError
from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.overlay import Overlay
from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.geometry.spread import Points, spread
from tryon_solver.geometry.weld import WeldedMesh
from tryon_solver.materials.fabric import Fabric
from tryon_solver.redesign.slack import Slack
from tryon_solver.scene import Effect, Scene
from tryon_solver.simulation import Simulation

SPREAD = 4.0  # times the widest gap of a seam that is drawn shut: so far from it the fabric comes along
NEGLIGIBLE = 0.1  # mean edges: gaps narrower than this are bridged by the triangles at the seam
ROOM = 1.2  # offsets of cloth from cloth that lie between edges that were sewn together before
LIFT = 2e-3  # m at least off the fabric at which a pocket is laid on it, and
LIFT_SHARE = 0.15  # of the mean edge: so far the two meshes may miss each other where the fabric is bent
ROUNDS = 12  # of freeing, four times what cuts and darts of worn garments took: the wearer waits for them
RETURNED_ROUNDS = 30  # of freeing what comes back: of a T-shirt's six pieces three took over 12, and are put on as they
# hung, in four times as long, where they are given up
EASING = 40  # rounds at most, in which what was drawn too long gives
OVERSHOT = 1.2  # times what a round takes back: it is spread over neighbours that have to give it on
MOST_STRETCH = 1.5  # times the fabric's limit: drawn so far together, cloth is better dressed anew


class CarryError(ValueError):
    """The new cut can't be put on from the old one: it has to be dressed anew; or, where cloth came back with it and
    what is worn stayed (`came_back`), by another reach; where all went back to where it hung (`as_hung`), in another
    stance."""

    came_back = as_hung = False


@dataclass(frozen=True)
class Prepared:
    """The new cut made ready to be put on: its simulation, the state of which counts for nothing yet, and what frees
    that once it does."""

    simulation: Simulation
    cut: NewCut
    tangle: Tangle


@dataclass(frozen=True)
class Carried:
    """The new cut, worn: the running simulation, its welded mesh, what had to be freed, the slack that its rest shape
    is to begin with, None where nothing was drawn out, and how far its cloth went at most [m]."""

    simulation: Simulation
    welded: WeldedMesh
    freed: Freed
    slack: Slack | None
    went: float


def carry_over(worn: Simulation, before: PanelMesh, after: PanelMesh) -> Carried:
    """Put on the mesh `after` where the garment `worn` is, whose mesh is `before`, both in the size that is worn.

    The new simulation has the old one's body in its stance, its collision surface, fabric, effects and settings; its
    clock begins at 0. Raises CarryError, or GarmentError as `build`; the old simulation is as it was.
    """
    cut = NewCut.of(after, before, worn.settings.subspace_spacing)
    (prepared,) = (it for it in prepare(worn, cut, worn.scene.fabric) if it is not None)
    return put_on(prepared, worn, before)


def prepare(
    worn: Simulation,
    cut: NewCut,
    fabric: Fabric,
    more: Iterable[object] = (),
    effects: tuple[Effect, ...] | None = None,
) -> Iterator[Prepared | None]:
    """All of `carry_over`, in this fabric, that does not depend on where the garment `worn` is, which may be advanced
    meanwhile and afterwards: in parts, None after each but the last. `more` are parts of something else, done while the
    inverse is being made; `effects` are the new cut's, the worn one's own if none are given. Raises GarmentError as
    `build`."""
    assert worn.scene.body is not None
    assert worn.body is not None
    flat = cut.welded.mean_of_vertices(cut.mesh.placed)
    stitches = stitched_on(cut.mesh, cut.welded.welded_of_vertex, fabric)
    own = without_stitches(worn.scene.effects if effects is None else effects)
    scene = Scene(cut.garment, flat, worn.scene.body, fabric, (*own, *stitches))
    settings, pose = worn.settings.by_budget(), worn.body.pose
    building = build_in_parts(scene, settings, worn.device, pose, None, worn.dt, cut.basis, more)
    for simulation in building:
        yield None
        if simulation is not None:
            yield Prepared(simulation, cut, Tangle(simulation, ROUNDS))


def put_on(
    prepared: Prepared,
    worn: Simulation,
    before: PanelMesh,
    hung: Hung | None = None,
    reach: float = REACHES[0],
) -> Carried:
    """The rest of `carry_over`, from where the garment `worn` is now; `before` is its mesh. The cut's overlay, if it is
    one over what the garment was before, is not looked at. Cloth that lies over nothing that is worn is put where it
    `hung`, if that is known, and gives way to what is worn as far as `reach`. Raises CarryError, and then it may be
    called again."""
    assert worn.body is not None
    simulation, cut = prepared.simulation, prepared.cut
    room = ROOM * simulation.contact.sizes.xi_self
    where = worn.cloth_positions(), worn.state.v.numpy()
    back = None if hung is None else Returning(hung, reach, cut, worn, simulation)
    laid = laid_over(cut, before, worn.scene.garment.faces, where, simulation.scene.fabric, room, back)
    simulation.start_at(laid.x, worn.body_positions().astype(np.float64), worn.body.pose)
    came_back = back is not None and back.came_back
    prepared.tangle.most_rounds = RETURNED_ROUNDS if came_back else ROUNDS
    try:
        freed = freed_where_worn(prepared.tangle, cut.mesh.panel_names)
    except CarryError as error:
        error.as_hung = back is not None and back.with_all
        error.came_back = back is not None and back.came_back and not back.with_all
        raise
    simulation.state.v.assign(laid.v.astype(np.float32))
    return Carried(simulation, cut.welded, freed, *laid.drawn_to(simulation.cloth_positions()))


@dataclass(frozen=True, eq=False)
class Laid:
    """The new `cut` where it is to be put on: its vertices at x (N, 3) m, as fast as v (N, 3) m/s, and where its cloth
    was before anything was drawn: triangles' corners at `carried` (F, 3, 3) m, zero of what comes from nowhere, unsewn
    vertices at `places` (V, 3) m, `known` (V,) those that lay over cloth."""

    cut: NewCut
    x: Points
    v: Points
    carried: Points
    places: Points
    known: NDArray[np.bool_]

    def drawn_to(self, x: NDArray[np.float32]) -> tuple[Slack | None, float]:
        """The slack of the cut once its vertices are freed and at x (N, 3) m, and how far its cloth went then, at most
        [m]."""
        came = x.astype(np.float64)
        way = came[self.cut.welded.welded_of_vertex[self.known]] - self.places[self.known]
        return Slack.of(self.cut.garment, came, self.carried), float(_lengths(way).max(initial=0.0))


def laid_over(
    cut: NewCut,
    before: PanelMesh,
    faces: NDArray[np.int32],
    where: tuple[NDArray[np.float32], NDArray[np.float32]],
    fabric: Fabric,
    room: float,
    back: Returning | None = None,
) -> Laid:
    """Where the new cut lies, and how fast it is, from `where` the vertices of the garment with these `faces` (F, 3)
    are, (N, 3) m, and how fast, (N, 3) m/s, whose mesh is `before`; `room` m is to be between what was sewn together,
    and `back` knows where what lies over none of its cloth is to be."""
    after, joined = cut.mesh, cut.welded
    overlay = cut.overlay if cut.overlay.is_over(before) else Overlay.of(before, after)
    corners = faces[overlay.face]
    places, speeds = (
        np.einsum("vk,vkd->vd", overlay.weights, values[corners].astype(np.float64)) for values in where
    )
    off, were_at, missing = lacking(cut, before, overlay), places.copy(), np.zeros(len(places), bool)
    if back is not None:
        missing = off | torn(after, places, MOST_STRETCH * fabric.strain_limit)
        back.put(missing, places, speeds)
    lay_on(before, after, overlay.face, places)
    were = places[after.faces]
    were[missing[after.faces].any(axis=1)] = 0.0  # how long it is there says nothing of how long it has been
    x = joined.mean_of_vertices(drawn_together(after, joined, places))
    x = eased(cut.garment, x, were, fabric.strain_limit)
    x, v = drawn_back(cut.garment, x, room), joined.mean_of_vertices(speeds)
    off[after.laid.vertices] = True  # what is laid on another piece goes with that
    return Laid(cut, x, v, were, were_at, ~off)


def freed_where_worn(tangle: Tangle, pieces: Sequence[str]) -> Freed:
    """Free what was put on where it is worn, with names for its `pieces`. Raises CarryError where that can't be, or
    stretches it too far."""
    try:
        freed = tangle.free()
    except TangledError as error:
        raise CarryError(f"where the garment is worn, {error}") from error
    scene, garment = tangle.sim.scene, tangle.sim.scene.garment
    limits = scene.of_fabrics("strain_limit")[:, 0]
    stretch = tangle.sim.stretches()
    worst = int(np.argmax(stretch / limits))
    if stretch[worst] > MOST_STRETCH * limits[worst]:
        name, times = pieces[garment.panel_of_face[worst]], f"{stretch[worst]:.2f} times its length"
        raise CarryError(f"where the garment is worn, {name} would be stretched to {times}")
    return freed


def lay_on(before: PanelMesh, after: PanelMesh, face: NDArray[np.int64], places: Points) -> None:
    """Put what lies on another piece, and did not before, over that; `face` is each vertex's triangle of `before`."""
    laid = after.laid
    if not len(laid.vertices):
        return
    were = np.unique(before.panel_of_vertex[before.laid.vertices])
    new = ~np.isin(before.panel_of_face[face[laid.vertices]], were)
    lift = max(LIFT, LIFT_SHARE * mean_edge(after))
    places[laid.vertices[new]] = laid.on(places, after.faces, lift)[new]


def mean_edge(mesh: PanelMesh) -> float:
    """m, mean over triangle sides in the pattern."""
    return float(_sides(mesh.uv[mesh.faces]).mean())


def drawn_together(mesh: PanelMesh, joined: WeldedMesh, x: Points) -> Points:
    """The unsewn vertices (V, 3) m with those that are sewn together in one place, the fabric beside them drawn along.

    How far from a seam is told by the widest gap: the displacement u solves u - l^2 Laplace(u) = 0 on the pieces'
    graphs, l `SPREAD` times that gap, so that no triangle alone has to bridge it. Of a piece all of whose own gaps are
    negligible only the seams move.
    """
    way = joined.mean_of_vertices(x)[joined.welded_of_vertex] - x
    members = np.bincount(joined.welded_of_vertex)[joined.welded_of_vertex]
    sewn = members > 1
    length = mean_edge(mesh)
    widest = np.zeros(len(mesh.panel_names))  # m, of each piece
    np.maximum.at(widest, mesh.panel_of_vertex, np.linalg.norm(way, axis=1))
    drawn = (widest >= NEGLIGIBLE * length)[mesh.panel_of_vertex]
    if not drawn.any():
        return x + way
    sides = mesh.faces[drawn[mesh.faces[:, 0]]][:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    return x + spread(sides, way, np.flatnonzero(~sewn & drawn), length / (SPREAD * widest.max()))


def eased(garment: Garment, x: Points, before: Points, limit: float) -> Points:
    """Vertices (N, 3) m, moved so that sides of triangles are no longer than the fabric bears, `limit` times their
    length in the pattern, or than they were `before`, (F, 3, 3) m by corners: what was drawn together at the corners of
    a seam's gap draws on what lies beside it. Goes on for EASING rounds, and leaves the rest to the solver."""
    ends = garment.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    longest = np.maximum(limit * _sides(garment.uv_corners), _sides(before))
    x, look = x.copy(), np.arange(len(ends))
    for _ in range(EASING):
        side = x[ends[look, 1]] - x[ends[look, 0]]
        length = _lengths(side)
        late = length > longest[look]
        over = look[late]
        if not len(over):
            break
        pull = (0.5 * (1.0 - longest[over] / length[late]))[:, None] * side[late]
        at, inverse, count = np.unique(ends[over], return_inverse=True, return_counts=True)
        look = _sides_at(at, garment)
        pulls = np.stack([pull, -pull], axis=1).reshape(-1, 3)
        total = np.stack([np.bincount(inverse.ravel(), weights=pulls[:, k]) for k in range(3)], axis=1)
        x[at] += OVERSHOT * total / count[:, None]
    return x


def _sides(corners: Points) -> Points:
    """(3 F,) lengths of the sides of triangles given by their corners (F, 3, 2 or 3), from each to the next."""
    return _lengths(corners[:, [1, 2, 0]] - corners).ravel()


def _lengths(vectors: Points) -> Points:
    """Of vectors (..., 2 or 3): numpy's norm takes several times as long along so short an axis."""
    squares = vectors[..., 0] ** 2
    for k in range(1, vectors.shape[-1]):
        squares = squares + vectors[..., k] ** 2
    length: Points = np.sqrt(squares)
    return length


def _sides_at(vertices: NDArray[np.integer], garment: Garment) -> NDArray[np.int64]:
    """The sides, of all 3 F, that begin or end at these vertices, ascending: side 3 f + k begins at corner k of f."""
    order, starts = garment.connectivity.corners
    counts = starts[vertices + 1] - starts[vertices]
    skipped = np.repeat(starts[vertices] - np.concatenate([[0], np.cumsum(counts)[:-1]]), counts)
    begins = order[np.arange(len(skipped)) + skipped].astype(np.int64)
    ends = np.where(begins % 3 == 0, begins + 2, begins - 1)
    return np.unique(np.concatenate([begins, ends]))


def drawn_back(garment: Garment, x: Points, room: float) -> Points:
    """Vertices (N, 3) m that lie within `room` m of others, drawn towards the middle of their neighbours by as much."""
    close = np.unique(cKDTree(x).query_pairs(room, output_type="ndarray"))
    if not len(close):
        return x
    edges = garment.edges()
    total, count = np.zeros_like(x), np.zeros(len(x))
    for one, other in (edges.T, edges.T[::-1]):
        np.add.at(total, one, x[other])
        np.add.at(count, one, 1.0)
    way = total[close] / count[close][:, None] - x[close]
    length = np.linalg.norm(way, axis=1, keepdims=True)
    moved = x.copy()
    moved[close] += way * np.minimum(room / np.maximum(length, 1e-12), 0.5)
    return moved
