"""Small garments, bodies and scenes for the solver's tests: metres, Y up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import warp as wp
from scipy.spatial.transform import Rotation

from tryon_solver.body.model import BodyModel
from tryon_solver.body.pose import Pose
from tryon_solver.geometry.garment import Garment
from tryon_solver.materials.fabric import FABRICS, Fabric

wp.config.quiet = True

STILL = Pose(np.zeros(3), np.array([[0.0, 0.0, 0.0, 1.0]]))
JERSEY = replace(FABRICS["cotton_jersey"], k_bend=6e-6)  # what the tests' tolerances were derived for, whatever is sold


def fabric(**values: object) -> Fabric:
    """The tests' cotton jersey with some values changed."""
    return Fabric(**{**JERSEY.__dict__, "name": "test", **values})


def grid_faces(columns: int, rows: int) -> np.ndarray:
    """(F, 3) int32 of a grid of vertices numbered row by row, counter-clockwise, diagonals alternating."""
    faces = []
    for j in range(rows - 1):
        for i in range(columns - 1):
            a, b = i + columns * j, i + 1 + columns * j
            c, d = a + columns, b + columns
            faces += [[a, b, d], [a, d, c]] if (i + j) % 2 else [[a, b, c], [b, d, c]]
    return np.array(faces, np.int32)


def grid_uv(columns: int, rows: int, width: float, height: float) -> np.ndarray:
    """(columns rows, 2) m, centred at the origin."""
    u, v = np.meshgrid(np.linspace(-width / 2, width / 2, columns), np.linspace(-height / 2, height / 2, rows))
    return np.column_stack([u.ravel(), v.ravel()])


def garment_of(uv: np.ndarray, faces: np.ndarray) -> Garment:
    """One panel."""
    return Garment(faces, uv[faces], np.zeros(len(faces), np.int32), len(uv))


def sheet(columns: int, rows: int, width: float, height: float) -> tuple[Garment, np.ndarray]:
    """A rectangle and its positions (N, 3) m flat in the plane y = 0, front side up."""
    uv = grid_uv(columns, rows, width, height)
    return garment_of(uv, grid_faces(columns, rows)), np.column_stack([uv[:, 0], np.zeros(len(uv)), -uv[:, 1]])


def folded_sheet(apart: float) -> tuple[Garment, np.ndarray, np.ndarray]:
    """A sheet of 24 x 54 cm folded over itself, its layers `apart` m; its positions (N, 3) m, and the layer of each
    vertex (N,): 0 the lower one, 1 the fold, 2 the upper one."""
    rows, columns, edge = 19, 9, 0.03
    garment, flat = sheet(columns, rows, edge * (columns - 1), edge * (rows - 1))
    row = np.arange(rows).repeat(columns)
    layer = 1 + np.sign(row - 9)
    away = np.where(layer == 0, row, 18 - row) * edge
    away[layer == 1] = 8 * edge + np.sqrt(edge**2 - (apart / 2) ** 2)
    return garment, np.column_stack([flat[:, 0], layer * apart / 2, away]), layer


def flattened(x: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(F, 3, 2) m: each triangle laid flat by itself."""
    a, b, c = (x[faces[:, k]] for k in range(3))
    length = np.linalg.norm(b - a, axis=1)
    along = ((b - a) * (c - a)).sum(1) / length
    height = np.linalg.norm(np.cross(b - a, c - a), axis=1) / length
    zero = 0 * length
    return np.stack([np.column_stack(corner) for corner in ((zero, zero), (length, zero), (along, height))], axis=1)


def layers(count: int, columns: int, rows: int, size: float, apart: float) -> tuple[Garment, np.ndarray]:
    """`count` square sheets, each a panel, stacked along y at distances `apart` m."""
    uv, faces = grid_uv(columns, rows, size, size), grid_faces(columns, rows)
    n = len(uv)
    all_faces = np.vstack([faces + k * n for k in range(count)])
    garment = Garment(
        all_faces,
        np.vstack([uv[faces]] * count),
        np.repeat(np.arange(count, dtype=np.int32), len(faces)),
        count * n,
    )
    flat = np.column_stack([uv[:, 0], np.zeros(n), -uv[:, 1]])
    return garment, np.vstack([flat + np.array([0, k * apart, 0]) for k in range(count)])


def rigid_body(vertices: np.ndarray, faces: np.ndarray) -> BodyModel:
    """A body of one joint at the origin."""
    count = len(vertices)
    return BodyModel(
        np.asarray(vertices, np.float64),
        np.asarray(faces, np.int32),
        ("root",),
        np.array([-1], np.int32),
        np.zeros((1, 3)),
        np.zeros((count, 1), np.int32),
        np.ones((count, 1), np.float32),
    )


def icosphere(radius: float, subdivisions: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (B, 3) m and outward faces of a sphere at the origin."""
    import trimesh

    mesh = trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)
    return np.array(mesh.vertices, np.float64), np.array(mesh.faces, np.int32)


def slab(width: float, depth: float, thickness: float, cell: float) -> tuple[np.ndarray, np.ndarray]:
    """A closed box whose top lies in y = 0, all sides cut into cells of about `cell` m."""
    extents = np.array([width, thickness, depth])
    points, faces, start = [], [], 0
    for axis in range(3):
        for sign in (-1.0, 1.0):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            counts = [int(np.ceil(extents[k] / cell)) + 1 for k in (u, v)]
            a, b = np.meshgrid(*(np.linspace(-0.5, 0.5, c) * extents[k] for c, k in zip(counts, (u, v))))
            side = np.empty((a.size, 3))
            side[:, u], side[:, v], side[:, axis] = a.ravel(), b.ravel(), 0.5 * sign * extents[axis]
            cells = grid_faces(*counts)
            faces.append((cells if sign > 0 else cells[:, ::-1]) + start)
            points.append(side)
            start += len(side)
    vertices = np.vstack(points)
    unique, inverse = np.unique(np.round(vertices, 9), axis=0, return_inverse=True)
    unique[:, 1] -= 0.5 * thickness
    return unique, inverse.ravel()[np.vstack(faces)].astype(np.int32)


def turn(angles: tuple[float, float, float]) -> np.ndarray:
    """(3, 3) rotation by Euler angles xyz in degrees."""
    return Rotation.from_euler("xyz", angles, degrees=True).as_matrix()


def device_vectors(x: np.ndarray) -> wp.array:
    """(n, 3) as a Warp array on the processor."""
    return wp.array(np.ascontiguousarray(x, np.float32), dtype=wp.vec3, device="cpu")
