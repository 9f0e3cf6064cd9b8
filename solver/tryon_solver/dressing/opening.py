"""What holds a garment that hangs from no shoulder: its upper opening, measured against the body there.

An opening wider than the body slips down to where the body is as wide, however well the garment fits elsewhere; one
with elastic in it is as wide as that has to be stretched to carry the garment (holding.py). The body's girth is a
tape's: the length of the convex outline of a horizontal section, arms left out. Ours.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull

from tryon_solver.dressing.holding import NOTHING, Holding, rings
from tryon_solver.geometry.body_parts import Trunk, find_trunk
from tryon_solver.geometry.boundary_loops import boundary_loops
from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.geometry.seams import face_edges
from tryon_solver.geometry.size import SIZE_MIN
from tryon_solver.geometry.weld import weld

WORTH_SAYING = 0.01  # m, an opening wider than the body by less is held by its friction
LEVELS = 0.005  # m between the heights at which the body is measured
FEWER_LEVELS = 0.02  # m between those at which the garment is


@dataclass(frozen=True)
class Tightest:
    """Where the body is widest against the garment below its opening: at which height over the soles [m], the
    garment's girth in its pattern and the body's [m]; `bears` is the stretch that the fabric bears. Dressing
    lets it be a little more (fit.py); no size is advised that is as tight, for the skin gives way to it, too."""

    height: float
    girth: float
    body_girth: float
    bears: float

    def too_tight(self, factor: float) -> bool:
        """Would the garment be in a size so many times its own?"""
        return self.body_girth > self.bears * factor * self.girth


@dataclass(frozen=True)
class Opening:
    """The upper opening of a garment that no shoulder holds. Lengths in m, heights over the body's soles."""

    pieces: tuple[str, ...]  # the pieces around it
    height: float  # of its middle
    girth: float  # its length in the pattern, unstretched; of elastic, where it is stretched to carry the garment
    body_girth: float  # of the body at that height, 0 where there is none
    rests_at: float | None  # height below, at which the body is as wide as the opening; None: it falls off
    lowest: float  # height of the garment's lowest point
    size: float = 1.0  # in which the pattern is worn, over its own
    too_small: float = 0.0  # the largest smaller size that is known not to go on; 0: none is
    tightest: Tightest | None = None  # below it; None where that is not known

    @property
    def too_wide(self) -> float:
        """By how much [m] it is wider than the body; negative for one that is stretched."""
        return self.girth - self.body_girth

    @property
    def fitting_size(self) -> float:
        """The size, over that of the pattern, whose opening is as wide as the body is now at this height; 0 where no
        body is. Of elastic it is the size that has this girth if it carried as much: a smaller one is lighter, is
        stretched less, and holds."""
        return self.size * self.body_girth / self.girth

    @property
    def advised_size(self) -> float | None:
        """The size to wear instead; None for an opening that holds, and where no other size is known to help."""
        smallest = max(self.too_small, SIZE_MIN)
        helps = self.advice and round(self.fitting_size, 2) > smallest and not self.tight_below
        return self.fitting_size if helps else None

    @property
    def tight_below(self) -> bool:
        """Is the size whose opening fits too tight below it?"""
        return self.tightest is not None and self.tightest.too_tight(self.fitting_size / self.size)

    @property
    def advice(self) -> str:
        """What there is to say about it, in a sentence; empty for an opening that holds."""
        if self.too_wide < WORTH_SAYING:
            return ""
        if self.body_girth == 0:
            return f"the opening of {' and '.join(self.pieces)} ({100 * self.girth:.1f} cm) lies below the body"
        where = "it falls off" if self.rests_at is None else f"it slips to a height of {self.rests_at:.2f} m"
        if self.rests_at is not None and self.lowest < self.height - self.rests_at:
            where += f", its hem from {self.lowest:.2f} m to under the feet, which tread it off,"
        return (
            f"the opening of {' and '.join(self.pieces)} is {100 * self.too_wide:.1f} cm too wide at a height of "
            f"{self.height:.2f} m ({100 * self.girth:.1f} cm, the body {100 * self.body_girth:.1f} cm): {where} when "
            f"the body moves; {self._what_fits()}"
        )

    def _what_fits(self) -> str:
        if self.fitting_size < SIZE_MIN:
            return f"no size of this pattern fits there, not even {SIZE_MIN:g}: narrow the opening in the pattern"
        fits = f"size {self.fitting_size:.2f} fits there"
        if self.tightest is not None and self.tight_below:
            girth = 100 * self.tightest.girth * self.fitting_size / self.size
            return (
                f"{fits}, but is too tight at a height of {self.tightest.height:.2f} m ({girth:.1f} cm, the body "
                f"{100 * self.tightest.body_girth:.1f} cm): narrow the opening in the pattern, or have elastic draw it "
                "in"
            )
        if round(self.fitting_size, 2) > self.too_small:
            return fits
        return f"{fits}, but in size {self.too_small:g} it can't be put on: narrow the opening in the pattern"


def upper_opening(
    garment: Garment,
    x: np.ndarray,
    panel_names: tuple[str, ...],
    body: np.ndarray,
    body_faces: np.ndarray,
    held: Holding = NOTHING,
    laid: Collection[int] = (),
) -> Opening | None:
    """The opening by which the garment at x (N, 3) m hangs on the standing body (B, 3) m with those faces (F, 3), or
    another ring in its upper half that is `held` better; its pieces `laid` on others go around nothing.

    None for a garment that reaches over the armpits, which the shoulders hold, and for one without an opening around
    the trunk.
    """
    trunk = find_trunk(body, body_faces)
    loops = [loop for loop in boundary_loops(garment.faces) if is_around(x[loop], trunk.middle)]
    if x[:, 1].max() > trunk.armpit or not loops:
        return None
    loop = max(loops, key=lambda ids: x[ids, 1].mean())
    height, soles = float(x[loop, 1].mean()), float(body[:, 1].min())
    girth, faces = rest_girth(garment, loop)
    at_height = body_girth(body, body_faces, trunk, height)
    if held.is_any:
        half = 0.5 * (x[:, 1].min() + x[:, 1].max())
        for ids, length in rings(garment, x, held, (trunk.middle, float(np.median(body[:, 2])))):
            there = float(x[ids, 1].mean())
            around = body_girth(body, body_faces, trunk, there) if there > half else 0.0
            if there > half and length - around < girth - at_height:
                height, girth, at_height = there, length, around
                faces = np.flatnonzero(np.isin(garment.faces, ids).sum(axis=1) > 1)
    levels = np.arange(height - LEVELS, soles, -LEVELS)
    wide = (level for level in levels.tolist() if body_girth(body, body_faces, trunk, level) >= girth)
    rests_at = next((level - soles for level in wide), None)
    pieces = tuple(panel_names[k] for k in np.unique(garment.panel_of_face[faces]))
    lowest = float(x[:, 1].min()) - soles
    tightest = None
    if girth - at_height >= WORTH_SAYING:
        around_all = ~np.isin(garment.panel_of_face, [*laid])
        tightest = _tightest(garment, around_all, x, body, body_faces, trunk, height, held.bears)
    return Opening(pieces, height - soles, girth, at_height, rests_at, lowest, tightest=tightest)


def opening_as_drawn(
    panels: PanelMesh, body: np.ndarray, body_faces: np.ndarray, held: Holding = NOTHING
) -> Opening | None:
    """The opening of a garment that is not yet put on, where its pattern places it on the body; else as above."""
    garment, x = as_drawn(panels)
    return upper_opening(garment, x, panels.panel_names, body, body_faces, held, laid_pieces(panels))


def laid_pieces(panels: PanelMesh) -> list[int]:
    """The pieces that lie on others, pockets and patches."""
    return np.unique(panels.panel_of_vertex[panels.laid.vertices]).tolist()


def as_drawn(panels: PanelMesh) -> tuple[Garment, np.ndarray]:
    """The garment as it will be sewn, and where its pattern places it: x (N, 3) m."""
    joined = weld(panels)
    garment = Garment(joined.vertex_of_corner, joined.uv_corners, joined.panel_of_face, joined.vertex_count)
    return garment, joined.mean_of_vertices(panels.placed)


def rest_girth(garment: Garment, loop: np.ndarray) -> tuple[float, np.ndarray]:
    """Length [m] of a boundary loop, its vertices in order, in the pattern, and the faces along it."""
    sides = np.sort(np.column_stack([loop, np.roll(loop, -1)]), axis=1)
    edges, lengths, faces = _rest_edges(garment)
    mine = np.isin(_keys(edges, garment.vertex_count), _keys(sides, garment.vertex_count))
    return float(lengths[mine].sum()), faces[mine]


def body_girth(body: np.ndarray, faces: np.ndarray, trunk: Trunk, height: float, arms: bool = False) -> float:
    """Length [m] of the convex outline of the body's section at the height [m]; 0 without a section. Without `arms`
    they are left out."""
    edges, above = face_edges(faces), body[:, 1] > height
    edges = edges[above[edges[:, 0]] != above[edges[:, 1]]]
    edges = np.unique(np.sort(edges, axis=1), axis=0)  # of all edges this takes ten times the rest
    a, b = body[edges[:, 0]], body[edges[:, 1]]
    points = a + ((height - a[:, 1]) / (b[:, 1] - a[:, 1]))[:, None] * (b - a)
    if not arms:
        points = points[~trunk.arms(points, 1) & ~trunk.arms(points, -1)]
    return float(ConvexHull(points[:, [0, 2]]).area) if len(points) > 2 else 0.0


def _tightest(
    garment: Garment,
    around_all: np.ndarray,
    x: np.ndarray,
    body: np.ndarray,
    body_faces: np.ndarray,
    trunk: Trunk,
    top: float,
    bears: float,
) -> Tightest | None:
    """Where the body is widest against the garment's faces `around_all` (F,) of it, between the height `top` [m] and
    the hips; None where the garment does not reach below that."""
    levels = np.arange(top - FEWER_LEVELS, max(trunk.hips, float(x[:, 1].min())), -FEWER_LEVELS)
    found: Tightest | None = None
    for level in levels.tolist():
        girth, around = _section_in_pattern(garment, around_all, x, level), body_girth(body, body_faces, trunk, level)
        if girth and (found is None or around / girth > found.body_girth / found.girth):
            found = Tightest(level - float(body[:, 1].min()), girth, around, bears)
    return found


def _section_in_pattern(garment: Garment, counts: np.ndarray, x: np.ndarray, height: float) -> float:
    """Length [m] in the pattern of the garment's section at the height [m], of the faces that it `counts` (F,)."""
    y = x[garment.faces, 1] - height
    across = (y > 0) != (np.roll(y, -1, axis=1) > 0)
    cut = across.any(axis=1) & counts
    y, across, uv = y[cut], across[cut], garment.uv_corners[cut]
    share = y / np.where(across, y - np.roll(y, -1, axis=1), 1.0)
    points = uv + share[:, :, None] * (np.roll(uv, -1, axis=1) - uv)
    ends = points[across].reshape(-1, 2, 2)
    return float(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum())


def girth_around(x: np.ndarray, faces: np.ndarray, height: float, middle: float) -> float:
    """Length [m] of the longest line in which the horizontal plane at the height [m] cuts the surface at x (N, 3) m
    with those faces (F, 3), of those around the trunk, as folds and all it hangs; 0 where it cuts none."""
    above = x[:, 1] > height
    sides = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2).astype(np.int64)
    cut = above[sides[..., 0]] != above[sides[..., 1]]  # two sides of a face, or none
    ends = sides[cut].reshape(-1, 2, 2)  # of each segment the two sides that it goes between
    if not len(ends):
        return 0.0
    a, b = x[ends[..., 0]], x[ends[..., 1]]
    points = a + ((height - a[..., 1]) / (b[..., 1] - a[..., 1]))[..., None] * (b - a)
    nodes = np.unique(ends[..., 0] * len(x) + ends[..., 1], return_inverse=True)[1].reshape(-1, 2)
    count, label = connected_components(coo_array((np.ones(len(nodes)), nodes.T), shape=(nodes.max() + 1,) * 2))
    line = label[nodes[:, 0]]
    lengths = np.bincount(line, np.linalg.norm(points[:, 1] - points[:, 0], axis=1), count)
    around = [is_around(points[line == k].reshape(-1, 3), middle) for k in range(count)]
    return float(lengths[around].max(initial=0.0))


def is_around(loop: np.ndarray, middle: float) -> bool:
    """Whether the loop (L, 3) m reaches to both sides of the trunk's middle, as none around a leg does."""
    return bool(loop[:, 0].min() < middle < loop[:, 0].max())


def _rest_edges(garment: Garment) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Every side of every face: its vertices (3 F, 2), smaller first, its length in the pattern [m], its face."""
    uv = garment.uv_corners
    lengths = np.linalg.norm(uv - np.roll(uv, -1, axis=1), axis=2).ravel()
    return np.sort(face_edges(garment.faces), axis=1), lengths, np.repeat(np.arange(len(garment.faces)), 3)


def _keys(edges: np.ndarray, vertex_count: int) -> np.ndarray:
    """One number per edge (K, 2), smaller vertex first."""
    return edges[:, 0].astype(np.int64) * vertex_count + edges[:, 1]
