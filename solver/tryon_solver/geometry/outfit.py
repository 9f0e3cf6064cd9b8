"""Several garments as one set of triangles, and each of them cut out of it again.

To the solver an outfit is a garment whose parts don't hang together: one after the other, from the innermost outwards,
with vertices, triangles and panels numbered on. What concerns a garment as a whole (its subspace, its thickness, how
near its own cloth may come to itself) looks at `Garment.layers`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from tryon_solver.geometry.garment import Garment, Layer


def put_together(names: Sequence[str], garments: Sequence[Garment]) -> Garment:
    """The garments of these names, the innermost first, as one; a single one is itself.

    Raises ValueError for a name that comes twice.
    """
    if len(names) != len(garments) or len(set(names)) != len(names):
        raise ValueError(f"an outfit needs a name of its own for each garment, not {list(names)}")
    if len(garments) == 1:
        return garments[0]
    layers = tuple(_layers(names, garments))
    first = [layer.vertices.start for layer in layers]
    group = None
    if any(garment.group is not None for garment in garments):
        group = np.concatenate(
            [
                start + (np.arange(garment.vertex_count) if garment.group is None else garment.group)
                for start, garment in zip(first, garments)
            ]
        ).astype(np.int32)
    spline_corners = None
    if any(garment.spline_corners is not None for garment in garments):
        spline_corners = np.concatenate([laid_out(garment) for garment in garments])
    panel_of_face = [layer.panels.start + garment.panel_of_face for layer, garment in zip(layers, garments)]
    return Garment(
        np.concatenate([start + garment.faces for start, garment in zip(first, garments)]).astype(np.int32),
        np.concatenate([garment.uv_corners for garment in garments]),
        np.concatenate(panel_of_face).astype(np.int32),
        layers[-1].vertices.stop,
        group,
        spline_corners,
        layers=layers,
    )


def _layers(names: Sequence[str], garments: Sequence[Garment]) -> Iterator[Layer]:
    vertex = face = panel = 0
    for name, garment in zip(names, garments):
        ends = vertex + garment.vertex_count, face + len(garment.faces), panel + garment.panel_count
        yield Layer(name, slice(vertex, ends[0]), slice(face, ends[1]), slice(panel, ends[2]))
        vertex, face, panel = ends


def garments_of(outfit: Garment) -> list[Garment]:
    """Each garment of the outfit by itself; of one garment, that."""
    return [taken_out(outfit, layer) for layer in outfit.layers] or [outfit]


def taken_out(outfit: Garment, layer: Layer) -> Garment:
    """One garment of the outfit, numbered from 0."""
    first = layer.vertices.start
    return Garment(
        outfit.faces[layer.faces] - first,
        outfit.uv_corners[layer.faces],
        outfit.panel_of_face[layer.faces] - layer.panels.start,
        layer.vertices.stop - first,
        None if outfit.group is None else outfit.group[layer.vertices] - first,
        None if outfit.spline_corners is None else outfit.spline_corners[layer.faces],
    )


def laid_out(garment: Garment) -> np.ndarray:
    """(F, 3, 2) m, coordinates over which the subspace lays its splines."""
    return garment.uv_corners if garment.spline_corners is None else garment.spline_corners
