"""Quadratic B-spline basis over pattern space, one grid per panel.

    B_ij(u, v) = N(u/dx - i) N(v/dx - j),  N(x) = 3/4 - x^2 (|x| < 1/2), (3/2 - |x|)^2 / 2 (1/2 <= |x| < 3/2), else 0.

Source: Li et al. 2023. Each panel has its own grid (neighbouring panels never share a basis), centred on the panel. A
seam vertex lies in several panels: its row is the mean of its rows there, so rows still sum to one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp

from tryon_solver.geometry.distinct import distinct
from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.outfit import garments_of
from tryon_solver.linalg.dense_inverse import spd_inverse

SPACINGS_ACROSS = 3  # a panel narrower than this many spacings gets a finer grid across
FINEST_SPACING = 2.0  # mean edge lengths: finer grids have more bases than vertices to carry them
DIAGONAL_SHIFT = 1e-6  # relative; where a narrow panel has more bases than rows of vertices, the rest is undetermined


def quadratic_spline(x: np.ndarray) -> np.ndarray:
    """N(x) above, elementwise."""
    distance = np.abs(x)
    return np.where(distance < 0.5, 0.75 - x * x, np.where(distance < 1.5, 0.5 * (1.5 - distance) ** 2, 0.0))


def pattern_rows(garment: Garment) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Each vertex once per distinct place it has in the pattern: vertex ids (R,), panel ids (R,), uv (R, 2) m."""
    vertex = garment.faces.ravel().astype(np.int64)
    panel = np.repeat(garment.panel_of_face, 3).astype(np.int64)
    uv = (garment.uv_corners if garment.spline_corners is None else garment.spline_corners).reshape(-1, 2)
    place = panel, *np.round(uv * 1e7).astype(np.int64).T
    order, starts = garment.connectivity.corners
    own = order[starts[:-1]]  # the first corner of each vertex: most have no other place
    several = np.zeros(garment.vertex_count, bool)
    several[vertex[np.any([key != key[own][vertex] for key in place], axis=0)]] = True
    corners = np.flatnonzero(several[vertex])
    keys = [key[corners] for key in (vertex, *place)]
    order = np.lexsort(keys[::-1])  # together they are too large for one number
    other = np.any([key[order][1:] != key[order][:-1] for key in keys], axis=0)
    first = corners[order[np.concatenate([np.ones(min(1, len(order)), bool), other])]]
    first = np.concatenate([own[~several], first])
    first = first[np.argsort(vertex[first], kind="stable")]
    return vertex[first], panel[first], uv[first]


def spline_basis(garment: Garment, spacing: float) -> sp.csr_matrix:
    """(vertex_count, basis_count) float64; rows sum to one (but below). `spacing` m between grid points.

    A narrow panel (collar, waistband) gets a finer grid across it. Bases whose support holds almost no fabric would
    make the reduced matrix singular: those with less than 1e-3 of the largest weight are dropped and the rows rescaled
    to sum to one; beside large pieces a tiny one may be left with none, and its rows empty.
    """
    vertex, panel, uv = pattern_rows(garment)
    rows, columns, weights = [], [], []
    basis_count = 0
    for name in np.unique(panel):
        here = np.flatnonzero(panel == name)
        local = uv[here] - 0.5 * (uv[here].min(0) + uv[here].max(0))
        extent = np.ptp(uv[here], axis=0)
        finest = FINEST_SPACING * garment.mean_edge_length()
        grid = local / np.maximum(np.minimum(spacing, extent / SPACINGS_ACROSS), finest)
        base = np.floor(grid + 0.5).astype(np.int64)
        i, j = np.meshgrid([-1, 0, 1], [-1, 0, 1], indexing="ij")
        node = base[:, None, :] + np.stack([i.ravel(), j.ravel()], axis=1)[None]
        along = quadratic_spline(grid[:, None, :] - node)
        weight = along[..., 0] * along[..., 1]
        nodes = distinct(node.reshape(-1, 2) - node.min((0, 1)))
        rows.append(np.repeat(vertex[here], 9))
        columns.append(basis_count + nodes.which)
        weights.append(weight.ravel())
        basis_count += len(nodes.rows)
    basis = sp.coo_matrix(
        (np.concatenate(weights), (np.concatenate(rows), np.concatenate(columns))),
        shape=(garment.vertex_count, basis_count),
    ).tocsr()
    size = np.asarray(basis.multiply(basis).T @ garment.vertex_areas()).ravel()
    basis = basis[:, size >= 1e-3 * size.max()]
    total = np.asarray(basis.sum(axis=1)).ravel()
    return sp.diags(np.divide(1.0, total, out=np.zeros_like(total), where=total > 0.0)) @ basis


def basis_by_edges(garment: Garment, edges: float) -> sp.csr_matrix:
    """`spline_basis` with grid points so many mean edges of the pattern apart; of an outfit each garment's own."""
    each = garments_of(garment)
    bases = [spline_basis(one, edges * one.mean_edge_length()) for one in each]
    return bases[0] if len(bases) == 1 else sp.csr_matrix(sp.block_diag(bases))


def reduced_matrix(basis: sp.csr_matrix, system: sp.csr_matrix) -> np.ndarray:
    """B^T H B, dense (basis_count, basis_count) float64, its diagonal raised by DIAGONAL_SHIFT.

    The shift keeps the factor finite where bases depend on each other; it serves as a first Hessian only, so that it
    changes how fast the search converges there, not where to.
    """
    dense = np.asarray((basis.T @ system @ basis).todense())
    both = 0.5 * (dense + dense.T)
    both[np.diag_indices_from(both)] += DIAGONAL_SHIFT * dense.diagonal()
    return both


def explicit_inverse(reduced: np.ndarray) -> np.ndarray:
    """float32 inverse of an SPD matrix by its float64 Cholesky factor. Raises numpy.linalg.LinAlgError when not SPD."""
    return spd_inverse(reduced).astype(np.float32)


def reduced_inverse(basis: sp.csr_matrix, system: sp.csr_matrix, parts: Sequence[slice] = ()) -> np.ndarray:
    """(M, M) float32, the explicit inverse of B^T H B; of an outfit, whose garments hold the vertices `parts` and share
    no basis, block by block. What holds two garments together counts for nothing here: it is a first Hessian's."""
    if not parts:
        return explicit_inverse(reduced_matrix(basis, system))
    inverse = np.zeros((basis.shape[1], basis.shape[1]), np.float32)
    for vertices in parts:
        own = basis[vertices]
        columns = np.unique(own.indices)
        block = reduced_matrix(own[:, columns], system[vertices, vertices])
        inverse[np.ix_(columns, columns)] = explicit_inverse(block)
    return inverse
