"""Cloths of some hundred vertices, and on each the places where effects act: lines, pairs, a patch."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from small_scenes import flattened, icosphere, layers, sheet
from worn_garment import WornGarment, dressed_demo

from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.lines import chain, line_between

RADIUS = 0.11  # m, of the ball that cloth lies on
ABOVE = 2.5e-3  # m: of cloth over the ball, of layers over each other, of a patch over what it is sewn to
OVER = 2 * ABOVE  # m, of an outer garment over the inner one: a patch is between them
PATCH = 0.05  # m, its radius
EDGE = {"tshirt": 0.037, "skirt": 0.037}  # m, of the mesh of garments


@dataclass(frozen=True)
class Cloth:
    """`x` (N, 3) m, free of contact; `worn` where it is on a person; `height` m of its layers over each other."""

    garment: Garment
    x: np.ndarray
    worn: WornGarment | None = None
    height: float = 0.0

    @cached_property
    def across(self) -> np.ndarray:
        """(K, 2) int32 edges of a line from one side to the other: around, of what is worn."""
        if self.worn is not None:
            lowest = min(self.worn.loops, key=lambda loop: self.x[loop, 1].mean())
            return chain(lowest, closed=True)
        return self._line(np.array([1.0, 0.1, 0.05]))

    @cached_property
    def along(self) -> np.ndarray:
        """(K, 2) int32 edges of a line the other way, none of them at a border."""
        way = self._line(np.array([0.05, 0.3, 1.0]))
        inner = np.sort(self.garment.hinges()[:, :2], axis=1)
        is_inner = (np.sort(way, axis=1)[:, None] == inner[None]).all(2).any(1)
        return way[is_inner]

    def _line(self, direction: np.ndarray) -> np.ndarray:
        """Between the ends of the last of its largest pieces, the upper one of a stack, along a direction."""
        piece = np.unique(self.garment.faces[self.garment.panel_of_face == self._largest])
        ahead = self.x[piece] @ direction
        return line_between(self.garment, int(piece[ahead.argmin()]), int(piece[ahead.argmax()]))

    @cached_property
    def corners(self) -> np.ndarray:
        """(K,) int32: where it is held, a few vertices about its highest point on the left."""
        score = self.x @ [-0.7, 1.0, 0.2]
        return np.argsort(-score)[:3].astype(np.int32)

    @cached_property
    def buttons(self) -> np.ndarray:
        """(K, 2) int32: pairs of vertices that are three edges apart along the line."""
        way = np.append(self.along[:, 0], self.along[-1, 1])
        start = len(way) // 2
        return np.column_stack([way[start - 3 : start], way[start : start + 3]])[:2].astype(np.int32)

    @cached_property
    def dart(self) -> np.ndarray:
        """(K, 2) int32: pairs of vertices to each side of the middle of a line, its nearest first."""
        way = np.append(self.across[:, 0], self.across[-1, 1])
        middle = len(way) // 2
        return np.array([[way[middle - k], way[middle + k]] for k in (1, 2)], np.int32)

    @cached_property
    def taped(self) -> np.ndarray:
        """(K,) int32: the vertices within two radii of a patch around where the two lines are halfway."""
        return np.flatnonzero(np.linalg.norm(self.x - self.x[self._middle], axis=1) < 2 * PATCH).astype(np.int32)

    def lifted(self, patched: bool) -> np.ndarray:
        """(N, 3) m: where another garment of the same pattern lies over it, and over its patch if it is `patched`."""
        return self.x + (OVER + patched * self.height) * self._normals

    @cached_property
    def _normals(self) -> np.ndarray:
        """(N, 3) of its vertices, weighted by area."""
        normals = np.zeros_like(self.x)
        corners = self.x[self.garment.faces]
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        for k in range(3):
            np.add.at(normals, self.garment.faces[:, k], across)
        return normals / np.linalg.norm(normals, axis=1, keepdims=True)

    @property
    def _largest(self) -> int:
        triangles = np.bincount(self.garment.panel_of_face)
        return int(np.flatnonzero(triangles == triangles.max())[-1])

    @property
    def _middle(self) -> int:
        return int(self.along[len(self.along) // 2, 0])

    def patched(self) -> tuple[Cloth, np.ndarray, np.ndarray]:
        """The same with a copy of a disc of its triangles that lies on them, a panel more; vertices (K,) int32 of the
        copy and (K,) of what each lies on."""
        garment, x = self.garment, self.x
        normals = self._normals
        near = np.linalg.norm(x - x[self._middle], axis=1) < PATCH
        near &= normals @ normals[self._middle] > 0.3
        within = near[garment.faces].all(axis=1) & (garment.panel_of_face == self._largest)
        beneath, faces = np.unique(garment.faces[within], return_inverse=True)
        count = garment.vertex_count
        spline = garment.spline_corners
        panels = garment.panel_of_face
        both = Garment(
            np.vstack([garment.faces, faces.reshape(-1, 3).astype(np.int32) + count]),
            np.vstack([garment.uv_corners, garment.uv_corners[within]]),
            np.append(panels, np.full(within.sum(), panels.max() + 1, panels.dtype)),
            count + len(beneath),
            spline_corners=None if spline is None else np.vstack([spline, spline[within]]),
        )
        cloth = replace(self, garment=both, x=np.vstack([x, x[beneath] + ABOVE * normals[beneath]]))
        return cloth, np.arange(count, both.vertex_count, dtype=np.int32), beneath.astype(np.int32)


def over_the_ball(x: np.ndarray) -> np.ndarray:
    """Flat cloth put above the ball, somewhat aside, hardly waved so that nothing falls straight."""
    return x + np.column_stack([0.013 + 0 * x[:, 0], RADIUS + 4e-3 + 1e-3 * np.cos(25 * x[:, 0]), 0 * x[:, 0] + 0.007])


def make_cloth(kind: str, fabric: str) -> Cloth:
    """One of LEVELS["cloth"]; what is worn is dressed, which takes seconds."""
    if kind in EDGE:
        worn = dressed_demo(kind, EDGE[kind], fabric)
        return Cloth(worn.garment, worn.x, worn)
    if kind == "sheet":
        garment, x = sheet(25, 25, 0.5, 0.5)
    elif kind == "strip":
        garment, x = sheet(41, 9, 0.6, 0.12)
    elif kind == "stack":
        garment, x = layers(2, 18, 18, 0.36, ABOVE)
        return Cloth(garment, over_the_ball(x), height=ABOVE)
    else:
        ball, faces = icosphere(0.12, 3)
        corners = ball[faces][:, :, :2]
        panel = np.zeros(len(faces), np.int32)
        garment = Garment(faces, flattened(ball, faces), panel, len(ball), spline_corners=corners)
        x = ball + [0, 0.12, 0]
    return Cloth(garment, over_the_ball(x))
