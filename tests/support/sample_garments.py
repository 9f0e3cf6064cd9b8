"""Garments as meshes on the default body: tubes around the hips, and pieces of its skin held off it."""

from __future__ import annotations

import numpy as np

from tryon_solver.body import default_body

SKIN = default_body().rest_vertices
COLUMNS, ROWS = 40, 24
FULL_SKIRT = (0.17, 0.55, 1.06, 0.62)  # m: radii above and below, heights
DRESS = (0.2, 0.3, 1.35, 0.6)
MAXI_DRESS = (0.2, 0.35, 1.3, 0.1)
GOWN = (0.17, 0.7, 1.06, 0.1)
BAND = (0.17, 0.175, 1.06, 0.985)


def tube(r0: float, r1: float, y0: float, y1: float, slit: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """(V, 3) m and (F, 3): a cone around the body's hips, along one line of which nothing is joined when it is slit."""
    s, a = np.meshgrid(np.linspace(0, 1, ROWS), np.linspace(0, 2 * np.pi, COLUMNS, endpoint=False), indexing="ij")
    r = r0 + s * (r1 - r0)
    x = np.stack([r * np.cos(a), y0 + s * (y1 - y0), 0.035 + r * np.sin(a)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(ROWS - 1), np.arange(COLUMNS - slit), indexing="ij")
    k, right = (i * COLUMNS + j).ravel(), (i * COLUMNS + (j + 1) % COLUMNS).ravel()
    return x, np.concatenate(
        [np.stack([k, right, right + COLUMNS], axis=1), np.stack([k, right + COLUMNS, k + COLUMNS], axis=1)]
    )


def off_the_skin(kept: np.ndarray, out: float = 0.008) -> tuple[np.ndarray, np.ndarray]:
    """(V, 3) m and (F, 3): the skin of the vertices `kept` (B,), so far off the body."""
    body = default_body()
    corners = SKIN[body.faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal = np.stack([np.bincount(body.faces.ravel(), across[:, k].repeat(3)) for k in range(3)], axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    ids, faces = np.unique(body.faces[kept[body.faces].all(axis=1)], return_inverse=True)
    return (SKIN + out * normal)[ids], faces.reshape(-1, 3)


WIDE, HEIGHT, DEEP = SKIN.T
WORN = {
    "trousers": off_the_skin((HEIGHT > 0.08) & (HEIGHT < 1.0) & (np.abs(WIDE) < 0.28)),
    "tights": off_the_skin((HEIGHT < 1.0) & (np.abs(WIDE) < 0.28)),
    "a sock": off_the_skin((HEIGHT < 0.2) & (WIDE > 0)),
    "ankle socks": off_the_skin(HEIGHT < 0.12),
    "a hat": off_the_skin(HEIGHT > 1.6),
    "an open vest": off_the_skin(
        (HEIGHT < 1.4) & (HEIGHT > 1.0) & (np.abs(WIDE) < 0.2) & ~((DEEP > 0.05) & (np.abs(WIDE) < 0.05))
    ),
    "a cape": off_the_skin((HEIGHT < 1.42) & (HEIGHT > 0.8) & (DEEP < 0), 0.03),
    "a dress": tube(*DRESS),
    "a maxi dress": tube(*MAXI_DRESS),
    "a gown": tube(*GOWN),
    "a band": tube(*BAND),
}
