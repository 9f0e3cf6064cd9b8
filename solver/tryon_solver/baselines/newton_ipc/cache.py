"""States of the reference kept on disk, under a hash of everything they follow from.

That is the discrete energy, the state before, the skin before and after, the time step, the tolerance, and the source
of this package: a change of any makes a state anew.
"""

from __future__ import annotations

import hashlib
import os
from dataclasses import fields, is_dataclass
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from tryon_solver.baselines.newton_ipc.contact import Presliding
from tryon_solver.baselines.newton_ipc.newton import Solved


def source_files() -> list[Path]:
    """The package's modules, in order."""
    return sorted(Path(__file__).parent.glob("*.py"))


def content_hash(*values: object) -> str:
    """Of numbers, strings, bytes, arrays, sparse matrices, tuples and dataclasses of such: equal content, equal hash.

    Raises TypeError for anything else.
    """
    digest = hashlib.sha256()
    for value in values:
        _feed(digest, value)
    return digest.hexdigest()


def _feed(digest: hashlib._Hash, value: object) -> None:
    digest.update(type(value).__name__.encode())
    if isinstance(value, np.ndarray):
        digest.update(f"{value.dtype}{value.shape}".encode())
        digest.update(np.ascontiguousarray(value).tobytes())
    elif sp.issparse(value):
        rows = sp.csr_matrix(value)
        for part in (rows.data, rows.indices, rows.indptr):
            _feed(digest, part)
    elif is_dataclass(value) and not isinstance(value, type):
        for field in fields(value):
            digest.update(field.name.encode())
            _feed(digest, getattr(value, field.name))
    elif isinstance(value, (tuple, list)):
        for part in value:
            _feed(digest, part)
    elif isinstance(value, bytes):
        digest.update(value)
    elif value is None or isinstance(value, (bool, int, float, str, np.generic)):
        digest.update(repr(value).encode())
    else:
        raise TypeError(f"no content hash for {type(value).__name__}")


def load(folder: Path, key: str) -> Solved | None:
    """The solved step kept under this key, or None."""
    path = folder / f"{key}.npz"
    if not path.exists():
        return None
    with np.load(path) as kept:
        known = Presliding(kept["kinds"], kept["ids"], kept["given"])
        return Solved(kept["x"], int(kept["iterations"]), float(kept["last_move"]), bool(kept["convex"]), known)


def save(folder: Path, key: str, solved: Solved) -> None:
    """Keep a solved step; whoever reads at the same time sees it whole or not at all."""
    folder.mkdir(parents=True, exist_ok=True)
    unfinished = folder / f"{key}.{os.getpid()}.tmp.npz"
    np.savez_compressed(
        unfinished,
        x=solved.x,
        iterations=solved.iterations,
        last_move=solved.last_move,
        convex=solved.convex,
        kinds=solved.known.kinds,
        ids=solved.known.ids,
        given=solved.known.given,
    )
    unfinished.replace(folder / f"{key}.npz")
