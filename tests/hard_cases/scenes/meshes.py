"""Meshes as they come: slivers, sizes far apart, loose and doubled vertices, starts that touch."""

from __future__ import annotations

import numpy as np
from harness.kit import FREE, JERSEY, alone, joined, laid, layers, on_body, rippled, square, table, turned
from harness.scene import Ask, HardScene, Run
from small_scenes import fabric, garment_of, grid_faces

from tryon_solver.geometry.garment import Garment
from tryon_solver.materials.fabric import Fabric

THIN = fabric(thickness=1e-6)
CLOSE = r"at the start"  # what the refusal of a start that touches says


def grid(columns: np.ndarray, rows: np.ndarray) -> tuple[Garment, np.ndarray]:
    """A rectangle with its vertices at these places along u and v [m], flat in y = 0."""
    u, v = np.meshgrid(columns, rows)
    uv = np.column_stack([u.ravel(), v.ravel()])
    return garment_of(uv, grid_faces(len(columns), len(rows))), np.column_stack([uv[:, 0], 0 * uv[:, 0], -uv[:, 1]])


def slivers(ask: Ask, cloth: Fabric, height: float = 5e-6) -> Run:
    """A square of 25 mm cells with three rows of triangles 50 mm long and `height` m high across its middle."""
    places = np.arange(-6, 7) * 0.025
    rows = np.sort(np.concatenate([places, height * np.arange(1, 4)]))
    garment, x = grid(np.arange(-3, 4) * 0.05, rows)
    return laid(on_body(ask, garment, x + [0, 0.02, 0], table(0.2, 0.05), cloth), stops=1.5)


def graded(ask: Ask) -> Run:
    """Cells from 0.1 mm to 5 cm, each 1.6 times the one before, along both sides."""
    steps = np.minimum(1e-4 * 1.6 ** np.arange(16), 0.05)
    places = np.concatenate([[0], np.cumsum(steps)])
    garment, x = grid(places - places.mean(), places - places.mean())
    return laid(on_body(ask, garment, x + [0, 0.02, 0], table(0.2, 0.05), fabric(thickness=2e-5)), stops=1.5)


def unreferenced(ask: Ask) -> Run:
    """A vertex that no triangle uses."""
    garment, x = square(ask.vertices, 0.3)
    loose = Garment(garment.faces, garment.uv_corners, garment.panel_of_face, garment.vertex_count + 1)
    return laid(on_body(ask, loose, np.vstack([x, [[0, 1, 0]]]), table()), stops=1.5)


def doubled(ask: Ask) -> Run:
    """Two halves side by side whose vertices along the middle are there twice, at the same places."""
    left, x_left = square(ask.vertices // 2, 0.15)
    right, x_right = square(ask.vertices // 2, 0.15)
    garment, x = joined([(left, x_left + [-0.075, 0.02, 0]), (right, x_right + [0.075, 0.02, 0])])
    return laid(on_body(ask, garment, x, table(0.2, 0.05)), stops=1.5)


def disconnected(ask: Ask) -> Run:
    """Seven pieces from 2 to 25 cm, one above the other, that nothing joins."""
    pieces = []
    for k, size in enumerate((0.25, 0.02, 0.12, 0.05, 0.2, 0.03, 0.15)):
        garment, x = square(max(9, int(ask.vertices * size)), size)
        pieces.append((garment, turned(rippled(x, 1e-3), 0.5 * k) + [0.01 * k - 0.03, 0.02 + 0.008 * k, 0.01]))
    return laid(on_body(ask, *joined(pieces), table(0.2, 0.05)), stops=1.5)


def nearly_parallel(ask: Ask) -> Run:
    """Three flat sheets of the same mesh, each turned by another 10 microradians: every edge has near parallels."""
    n = max(5, round(np.sqrt(ask.vertices / 3)))
    garment, x = layers(3, n, n, 0.25, 0.0)
    x = np.vstack([turned(sheet, 1e-5 * k) + [0, 0.01 + 0.004 * k, 0] for k, sheet in enumerate(np.split(x, 3))])
    return laid(on_body(ask, garment, x, table(0.2, 0.05)), stops=1.5)


def touching(ask: Ask, shift: tuple[float, float, float]) -> Run:
    """A small sheet that starts in the plane of a large one of the same cells, moved by shares of a cell."""
    cell = 0.02
    large, x_large = grid(np.arange(-6, 7) * cell, np.arange(-6, 7) * cell)
    small, x_small = grid(np.arange(-2, 3) * cell, np.arange(-2, 3) * cell)
    garment, x = joined([(large, x_large), (small, x_small + cell * np.array(shift))])
    return Run(alone(ask, garment, x, JERSEY, FREE), dt=step_of_ask(ask), rests=False)


def standing_on_face(ask: Ask) -> Run:
    """A sheet that stands upright with its lower vertices exactly on the faces of another."""
    cell = 0.02
    lying, x_lying = grid(np.arange(-6, 7) * cell, np.arange(-6, 7) * cell)
    upright, x_up = grid(np.arange(-2, 3) * cell, np.arange(0, 5) * cell)
    x_up = np.column_stack([x_up[:, 0] + 0.3 * cell, -x_up[:, 2], np.full(len(x_up), 0.2 * cell)])
    garment, x = joined([(lying, x_lying), (upright, x_up)])
    return Run(alone(ask, garment, x, JERSEY, FREE), dt=step_of_ask(ask), rests=False)


def step_of_ask(ask: Ask) -> float:
    """As step_of, before there is a simulation."""
    return ask.settings.largest_step


SCENES = (
    HardScene(
        "slivers_refused",
        "triangles of aspect 1e4: refused by triangle",
        lambda ask: slivers(ask, JERSEY),
        refused=r"triangle \d+ is 50 mm long and only 0.005 mm high, 10000 times",
    ),
    HardScene(
        "slivers_thinner_than_fabric",
        "triangles of aspect 250, thinner than the fabric: refused by triangle",
        lambda ask: slivers(ask, JERSEY, 2e-4),
        refused=r"triangle \d+ is only .* mm high, too thin",
    ),
    HardScene(
        "slivers_thin_fabric",
        "triangles of aspect 500 in a fabric of one micrometre",
        lambda ask: slivers(ask, THIN, 1e-4),
    ),
    HardScene("cells_0.1mm_to_5cm", "edges of 0.1 mm in one mesh with edges of 5 cm", graded),
    HardScene(
        "unreferenced_vertex",
        "a vertex in no triangle: refused by number",
        unreferenced,
        refused=r"vertex \d+ is in no triangle",
    ),
    HardScene("doubled_vertices", "a seam whose vertices are there twice at the same places", doubled, refused=CLOSE),
    HardScene("disconnected_pieces", "seven pieces of very different size that nothing joins", disconnected),
    HardScene("nearly_parallel_edges", "three sheets whose edges are parallel within 10 microradians", nearly_parallel),
    HardScene(
        "vertices_on_vertices",
        "a sheet that starts with its vertices exactly on another's",
        lambda ask: touching(ask, (0.0, 0.0, 0.0)),
        refused=CLOSE,
    ),
    HardScene(
        "vertices_on_edges",
        "a sheet that starts with its vertices exactly on another's edges",
        lambda ask: touching(ask, (0.5, 0.0, 0.0)),
        refused=CLOSE,
    ),
    HardScene(
        "vertices_on_faces",
        "a sheet that starts standing on another with its vertices exactly on its faces",
        standing_on_face,
        refused=CLOSE,
    ),
)


