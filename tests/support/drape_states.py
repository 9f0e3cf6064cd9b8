"""Deformed states of a small sheet, one kind after the other, and the matrices the solver has there."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import warp as wp
from small_scenes import device_vectors, turn

from tryon_solver.geometry.garment import Garment
from tryon_solver.linalg.block_ell import BlockRows
from tryon_solver.materials.device import RestShape
from tryon_solver.materials.triangle_hessian import TriangleHessian
from tryon_solver.plan import Contribution


def stretched(uv: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Every principal stretch between 1.05 and 1.45, turned in space: the exact Hessian is positive definite there."""
    flat = np.column_stack([1.2 * uv[:, 0], 1.3 * uv[:, 1], np.zeros(len(uv))])
    bulge = 0.15 * np.ptp(uv) * np.cos(9 * uv[:, 0]) * np.cos(7 * uv[:, 1])
    noise = 1e-3 * np.ptp(uv) * rng.standard_normal((len(uv), 3))
    return (flat + np.column_stack([0 * bulge, 0 * bulge, bulge]) + noise) @ turn((20, 35, -50)).T


def sheared(uv: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Simple shear by 0.4, with noise."""
    flat = np.column_stack([uv[:, 0] + 0.4 * uv[:, 1], uv[:, 1], np.zeros(len(uv))])
    return (flat + 5e-3 * np.ptp(uv) * rng.standard_normal((len(uv), 3))) @ turn((-70, 10, 15)).T


def compressed(uv: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Shortened to 0.6 across, stretched to 1.2 along."""
    flat = np.column_stack([0.6 * uv[:, 0], 1.2 * uv[:, 1], np.zeros(len(uv))])
    return flat + 1e-2 * np.ptp(uv) * rng.standard_normal((len(uv), 3))


def crumpled(uv: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Vertices strewn about their places by a fifth of the sheet."""
    flat = np.column_stack([uv[:, 0], uv[:, 1], np.zeros(len(uv))])
    return flat + 0.2 * np.ptp(uv) * rng.standard_normal((len(uv), 3))


STATES: dict[str, Callable[[np.ndarray, np.random.Generator], np.ndarray]] = {
    state.__name__: state for state in (stretched, sheared, compressed, crumpled)
}


def rounded(x: np.ndarray) -> np.ndarray:
    """The float64 values of the float32 positions that the device gets."""
    return x.astype(np.float32).astype(np.float64)


def vertex_gradient(garment: Garment, term: Contribution, x: np.ndarray) -> np.ndarray:
    """(N, 3) N: what a term's local step adds to triangle corners, summed at the vertices."""
    faces = garment.faces
    corners = wp.zeros((len(faces), 3), dtype=wp.vec3, device="cpu")
    project = term.project or term.project_in_correction
    assert project is not None
    project(device_vectors(x), corners)
    out = np.zeros((garment.vertex_count, 3))
    np.add.at(out, faces.ravel(), corners.numpy().reshape(-1, 3).astype(np.float64))
    return out


def dense(count: int, product: Callable[[wp.array, wp.array], None]) -> np.ndarray:
    """(3 count, 3 count) matrix of a product with vec3 arrays of `count` entries."""
    matrix = np.empty((3 * count, 3 * count))
    out = wp.zeros(count, dtype=wp.vec3, device="cpu")
    for column in range(3 * count):
        out.fill_(wp.vec3(np.nan, np.nan, np.nan))
        product(device_vectors(np.eye(3 * count)[column].reshape(count, 3)), out)
        matrix[:, column] = out.numpy().ravel()
    return matrix


def term_hessian(garment: Garment, term: Contribution, x: np.ndarray) -> np.ndarray:
    """(3N, 3N) N/m: what a term's stage of the Hessian sums into block rows, as a dense matrix."""
    count = garment.vertex_count
    rows = BlockRows.build(*garment.connectivity.pairs, "cpu", term.joined)
    if term.add_triangle_hessian is not None:
        rest = RestShape.build(garment, np.ones(len(garment.faces)), "cpu")
        rest.take(garment.uv_corners)
        summed = TriangleHessian.build(rest, garment.connectivity, rows.width)
        term.add_triangle_hessian(device_vectors(x), summed.hessians)
        summed.sum_up(wp.zeros(rows.blocks.shape, dtype=wp.float32, device="cpu"), rows)
    else:
        assert term.add_hessian is not None
        term.add_hessian(device_vectors(x), rows)
    matrix = np.zeros((3 * count, 3 * count))
    for i, (columns, blocks) in enumerate(zip(rows.columns.numpy(), rows.blocks.numpy().astype(np.float64))):
        for j, block in zip(columns, blocks):
            matrix[3 * i : 3 * i + 3, 3 * j : 3 * j + 3] += block
    return matrix
