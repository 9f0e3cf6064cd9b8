"""Meshes of pieces that are kept, since another mesh of the pattern, as after an edit, has need of most of them again.

They can be handed to another process, which then need not make them, and back.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tryon_solver.geometry.triangulate import triangulate

PIECES_KEPT = 32

PieceKey = tuple[bytes, float]
"""An outline, (n, 2) float64 m as bytes, and an edge length [m]."""

PieceMesh = tuple[NDArray[np.float64], NDArray[np.int32]]
"""Points (V, 2) m and faces (F, 3) as of `triangulate`."""

_kept: dict[PieceKey, PieceMesh] = {}  # the one used last stands last
_lock = threading.Lock()


def triangulated(outline: bytes, edge_length: float) -> PieceMesh:
    """Points (V, 2) m and faces (F, 3) of an outline, (n, 2) float64 m as bytes; of one that is kept, as they were.

    Raises TriangulationError as `triangulate`.
    """
    key = outline, edge_length
    with _lock:
        mesh = _kept.get(key)
    mesh = mesh or triangulate(np.frombuffer(outline).reshape(-1, 2), edge_length)
    keep({key: mesh})
    return mesh


def keep(meshes: Mapping[PieceKey, PieceMesh | None]) -> None:
    """Keep these, as the ones used last, and of those kept before so many that they are `PIECES_KEPT` in all; None
    stands for the mesh that is kept already, if it still is."""
    with _lock:
        for key, given in meshes.items():
            mesh = _kept.pop(key, None) if given is None else given
            if mesh is not None:
                _kept.pop(key, None)
                _kept[key] = mesh
        for key in list(_kept)[: max(0, len(_kept) - PIECES_KEPT)]:
            del _kept[key]


def kept() -> dict[PieceKey, PieceMesh]:
    """Those that are kept, the one used last at the end."""
    with _lock:
        return dict(_kept)
