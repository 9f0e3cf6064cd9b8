"""Garments that were dressed before: where they hung and the skin they pressed on, so that they need not be sewn again.

Sewing a garment on takes many times longer than starting from where it hung. What is kept is the settled state of a
simulation that proved it free of penetration, under a key of everything that led to it, the solver's own code included.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
from collections.abc import Iterable
from functools import cache
from pathlib import Path

import numpy as np
import numpy.typing as npt

import tryon_solver
from tryon_solver.body.model import BodyModel

CAPACITY = 100  # garments kept; the longest unused ones make room


class Wardrobe:
    """Dressed garments in a folder, one file each."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def recall(self, key: str, vertex_count: int) -> npt.NDArray[np.float32] | None:
        """(A, 3) positions [m] kept under this key; None when there are none, or not as many sound ones."""
        path = self._path(key)
        try:
            positions = np.load(path, allow_pickle=False)
            os.utime(path)
        except (OSError, ValueError, EOFError):
            return None
        sound = positions.shape == (vertex_count, 3) and positions.dtype == np.float32 and np.isfinite(positions).all()
        return positions if sound else None

    def keep(self, key: str, positions: npt.NDArray[np.float32]) -> None:
        """Keep the positions of a settled garment and of the surface it lies on.

        A full disk is no reason not to wear it: then it is not kept.
        """
        draft = self._path(f"{key}.{os.getpid()}")
        with contextlib.suppress(OSError):
            self._folder.mkdir(parents=True, exist_ok=True)
            with draft.open("wb") as file:
                np.save(file, np.asarray(positions, dtype=np.float32))
            draft.replace(self._path(key))
            by_use = sorted(self._folder.glob("*.npy"), key=lambda path: path.stat().st_mtime, reverse=True)
            for path in by_use[CAPACITY:]:
                path.unlink(missing_ok=True)

    def _path(self, key: str) -> Path:
        return self._folder / f"{key}.npy"


def wardrobe_key(pattern: bytes, body: BodyModel, choices: Iterable[object]) -> str:
    """A name for what dressing a pattern on a body leads to; ``choices`` are all values that have a say in it."""
    digest = hashlib.sha256(_solver_digest())
    digest.update(hashlib.sha256(pattern).digest())
    for array in (body.rest_vertices, body.faces, body.rest_joints, body.skin_joints, body.skin_weights):
        digest.update(np.ascontiguousarray(array).tobytes())
    digest.update(repr(tuple(choices)).encode())
    return digest.hexdigest()[:32]


@cache
def _solver_digest() -> bytes:
    digest = hashlib.sha256()
    for path in sorted(Path(tryon_solver.__file__).parent.rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.digest()
