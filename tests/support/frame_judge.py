"""Judges single frames of cloth on a body, as simulated or as decoded from the wire: numpy and IPC Toolkit only.

Everything here takes positions; nothing asks the solver. Positions are in metres: cloth (N, 3), body (B, 3) the
collision surface, skin (B, 3) the tracked skin at the frame's own pose time.
"""

from __future__ import annotations

from dataclasses import dataclass

import ipctk
import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

ipctk.set_logger_level(ipctk.LoggerLevel.error)


@dataclass(frozen=True)
class FrameVerdict:
    """What is wrong with a frame; `clean` when nothing is."""

    finite: bool
    self_intersecting: bool
    body_intersecting: bool
    inside: int  # cloth vertices inside the body

    @property
    def clean(self) -> bool:
        """No value that is not a number, no intersection, nobody inside."""
        return self.finite and not self.self_intersecting and not self.body_intersecting and self.inside == 0


class FrameJudge:
    """Prepared for one cloth and one closed body; the body with itself is nobody's business.

    ipctk says that NaN intersects nothing, so that is looked for first.
    """

    def __init__(self, cloth_faces: np.ndarray, body_faces: np.ndarray, cloth: np.ndarray, body: np.ndarray) -> None:
        """Faces (F, 3) of each in its own numbering, and any finite positions of both."""
        self.cloth_count = len(cloth)
        self.body_faces = np.asarray(body_faces, np.int32)
        own = np.asfortranarray(np.asarray(cloth_faces, np.int32))
        both = np.asfortranarray(np.vstack([own, self.body_faces + self.cloth_count]).astype(np.int32))
        rest = _stacked(cloth, body)
        self.alone = ipctk.CollisionMesh(np.asfortranarray(rest[: self.cloth_count]), ipctk.edges(own), own)
        self.together = ipctk.CollisionMesh(rest, ipctk.edges(both), both)
        part = np.r_[np.zeros(self.cloth_count), np.ones(len(body))].astype(np.int32)
        self.together.can_collide = ipctk.make_vertex_patches_filter(part)
        edges = ipctk.edges(own)
        links = sparse.coo_matrix(
            (np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(self.cloth_count, self.cloth_count)
        )
        _, piece = csgraph.connected_components(links, directed=False)
        _, self.first_of_piece, self.piece_size = np.unique(piece, return_index=True, return_counts=True)

    def judge(self, cloth: np.ndarray, body: np.ndarray) -> FrameVerdict:
        """The verdict on one frame."""
        if not (np.isfinite(cloth).all() and np.isfinite(body).all()):
            return FrameVerdict(False, False, False, 0)
        both = _stacked(cloth, body)
        crossed_self = ipctk.has_intersections(self.alone, np.asfortranarray(both[: self.cloth_count]))
        crossed_body = ipctk.has_intersections(self.together, both)
        # a piece that does not cross the closed body is wholly inside it or wholly outside: one vertex tells
        inside = 0
        if not crossed_body:
            around = winding_numbers(both[self.first_of_piece], both[self.cloth_count :], self.body_faces)
            inside = int(self.piece_size[around > 0.5].sum())
        return FrameVerdict(True, bool(crossed_self), bool(crossed_body), inside)


def _stacked(cloth: np.ndarray, body: np.ndarray) -> np.ndarray:
    return np.asfortranarray(np.vstack([cloth, body]).astype(np.float64))


def winding_numbers(points: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(P,) how often the closed surface winds around each point: 1 inside, 0 outside, 2 where two parts overlap.

    Sum of signed solid angles over 4 pi (Van Oosterom and Strackee 1983).
    """
    out = np.zeros(len(points))
    for start in range(0, len(points), 64):
        p = points[start : start + 64, None]
        a, b, c = (vertices[faces[:, k]][None] - p for k in range(3))
        la, lb, lc = (np.linalg.norm(v, axis=2) for v in (a, b, c))
        triple = np.einsum("pfi,pfi->pf", a, np.cross(b, c))
        rest = (
            la * lb * lc
            + np.einsum("pfi,pfi->pf", a, b) * lc
            + np.einsum("pfi,pfi->pf", b, c) * la
            + np.einsum("pfi,pfi->pf", c, a) * lb
        )
        out[start : start + 64] = np.arctan2(triple, rest).sum(1) / (2 * np.pi)
    return out


def principal_stretches(cloth: np.ndarray, faces: np.ndarray, uv_corners: np.ndarray) -> np.ndarray:
    """(F, 2) smaller and larger principal stretch of each triangle; `uv_corners` (F, 3, 2) m is the pattern."""
    rest = np.stack([uv_corners[:, 1] - uv_corners[:, 0], uv_corners[:, 2] - uv_corners[:, 0]], axis=-1)
    corner = cloth.astype(np.float64)[faces]
    posed = np.stack([corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]], axis=-1)
    return np.linalg.svd(posed @ np.linalg.inv(rest), compute_uv=False)[:, ::-1]


def turns_around(loop: np.ndarray, start: np.ndarray, end: np.ndarray) -> int:
    """How often the closed polygon (L, 3) m runs around the straight line through two points: their linking number."""
    axis = (end - start) / np.linalg.norm(end - start)
    helper = np.eye(3)[np.argmin(np.abs(axis))]
    u = np.cross(axis, helper)
    u /= np.linalg.norm(u)
    v = np.cross(axis, u)
    angle = np.arctan2((loop - start) @ v, (loop - start) @ u)
    steps = np.diff(np.append(angle, angle[0]))
    return int(np.rint(((steps + np.pi) % (2 * np.pi) - np.pi).sum() / (2 * np.pi)))


def enclosed_bone(loop: np.ndarray, joints: np.ndarray, parents: np.ndarray) -> tuple[int, int]:
    """The bone that a loop of a garment encloses, as (joint at its far end, turns): the nearest it runs around.

    `joints` (J, 3) m. Raises ValueError when the loop encloses none.
    """
    middle = loop.mean(0)
    best, found = np.inf, (-1, 0)
    for child, parent in enumerate(parents):
        if parent < 0:
            continue
        start, end = joints[parent], joints[child]
        if np.linalg.norm(end - start) < 0.02:
            continue
        turns = turns_around(loop, start, end)
        t = np.clip((middle - start) @ (end - start) / ((end - start) @ (end - start)), 0, 1)
        distance = np.linalg.norm(middle - start - t * (end - start))
        if turns != 0 and distance < best:
            best, found = distance, (child, turns)
    if found[1] == 0:
        raise ValueError("the loop runs around no bone")
    return found
