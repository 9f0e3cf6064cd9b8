"""How flat a garment's triangles are: what that leaves for contact, and what no float32 can bend."""

from __future__ import annotations

import numpy as np

from tryon_solver.geometry.garment import Garment, GarmentError, by_corners

SMALLEST_ALTITUDE_SHARE = 0.4  # a thickness above this share of a triangle's altitude would touch itself at rest
LARGEST_ASPECT = 1e3  # longest side over altitude

Side = tuple[np.ndarray, np.ndarray]
Sides = tuple[Side, Side, Side]


def altitudes(uv_corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(F,) m: each triangle's (F, 3, 2) m smallest altitude, negative where it is clockwise, and its longest side."""
    corners = by_corners(uv_corners)
    (ax, ay), (bx, by), (cx, cy) = (corners[(k + 1) % 3] - corners[k] for k in range(3))
    return altitudes_of(((ax, ay), (bx, by), (cx, cy)))


def sides_of(uv: np.ndarray, faces: np.ndarray) -> Sides:
    """The sides of the triangles faces (F, 3) of points (V, 2) m: three times (F,) m along x and y, from each corner to
    the next. By columns, which takes half the time of gathering corners."""
    x, y = np.ascontiguousarray(uv[:, 0]), np.ascontiguousarray(uv[:, 1])
    at = [(x.take(corner), y.take(corner)) for corner in np.ascontiguousarray(faces.T, dtype=np.intp)]
    (ax, ay), (bx, by), (cx, cy) = at
    return (bx - ax, by - ay), (cx - bx, cy - by), (ax - cx, ay - cy)


def altitudes_of(sides: Sides) -> tuple[np.ndarray, np.ndarray]:
    """As `altitudes`, of the triangles' sides."""
    (ax, ay), (bx, by), (cx, cy) = sides
    longest = np.sqrt(np.maximum(np.maximum(ax * ax + ay * ay, bx * bx + by * by), cx * cx + cy * cy))
    return (ay * cx - ax * cy) / longest, longest


def refuse_flat_triangles(garment: Garment, xi: float) -> None:
    """Raise GarmentError, naming the triangle, where one is flatter than LARGEST_ASPECT, or too low for cloth of xi m
    that feels cloth; xi is 0 where it does not.

    A hinge's stiffness grows with the inverse cube of the altitudes beside it, while its vertices' mass shrinks with
    them: at an aspect of 1e4 their ratio is beyond float32. At 500 cloth still falls, lies and rests as any other. Near
    a vertex cloth begins to feel cloth at half the smallest altitude around it, or a fine mesh would touch itself flat
    at rest.
    """
    altitude, side = altitudes(garment.uv_corners)
    worst = int(np.argmax(side / altitude))
    if side[worst] > LARGEST_ASPECT * altitude[worst]:
        raise GarmentError(
            f"triangle {worst} is {1e3 * side[worst]:.3g} mm long and only {1e3 * altitude[worst]:.2g} mm high, "
            f"{side[worst] / altitude[worst]:.0f} times as long as high; {LARGEST_ASPECT:.0f} times is what can be "
            "simulated: remesh the garment there"
        )
    lowest = int(np.argmin(altitude))
    if xi >= SMALLEST_ALTITUDE_SHARE * altitude[lowest]:
        raise GarmentError(
            f"triangle {lowest} is only {1e3 * altitude[lowest]:.2f} mm high, too thin for a fabric "
            f"{1e3 * xi:.2f} mm thick; use a longer edge length or a thinner fabric"
        )
