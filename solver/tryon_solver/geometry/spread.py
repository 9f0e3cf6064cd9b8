"""Displacements that some vertices of a mesh are given, spread over others."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import cg

Points = NDArray[np.float64]

EXACTLY = 1e-5  # of how far the vertices are moved


def spread(sides: NDArray[np.integer], way: Points, free: NDArray[np.integer], edge_share: float) -> Points:
    """The displacements `way` (V, 3) m with those of the vertices `free` (K,) in place of what it holds there.

    They solve u - l^2 Laplace(u) = 0 on the graph of the `sides` (S, 2) of triangles, each as often as there are
    triangles beside it, so that no triangle alone has to bridge a gap; `edge_share` is the mean edge over l.
    """
    both = np.concatenate([sides, sides[:, ::-1]])
    links = sp.coo_matrix((np.ones(len(both)), (both[:, 0], both[:, 1])), shape=(len(way), len(way))).tocsr()
    degree = np.asarray(links.sum(axis=1)).ravel()
    rows = (sp.diags(degree * (1.0 + edge_share**2)) - links).tocsr()[free]
    given = way.copy()
    given[free] = 0.0
    wanted, inner = -(rows @ given), rows[:, free]
    scaled = sp.diags(1.0 / inner.diagonal())
    for k in range(3):  # the matrix is dominated by its diagonal: this takes a third of an elimination's time
        given[free, k], _ = cg(inner, wanted[:, k], rtol=EXACTLY, M=scaled)
    return given
