"""Many layers at once."""

from __future__ import annotations

import numpy as np
from harness.kit import laid, layers, on_body, rippled, table, turned
from harness.scene import Ask, HardScene, Run


def dropped_layers(ask: Ask, count: int) -> Run:
    """Square sheets, each turned a little further, dropped together onto a table over whose edges they hang."""
    n = max(5, round(np.sqrt(ask.vertices / count)))
    garment, x = layers(count, n, n, 0.3, 0.0)
    each = garment.vertex_count // count
    x = np.vstack(
        [
            turned(rippled(sheet, 1e-3), 0.12 * k) + [0.002 * k, 0.02 + 0.006 * k, 0.001 * k]
            for k, sheet in enumerate(x.reshape(count, each, 3))
        ]
    )
    return laid(on_body(ask, garment, x, table(0.2, 0.05)), stops=1.5)


SCENES = (
    HardScene(
        "ten_layers_dropped",
        "ten turned sheets fall onto a table together: impacts of layers on layers, ten gaps under one load",
        lambda ask: dropped_layers(ask, 10),
    ),
    HardScene(
        "three_layers_dropped",
        "the same with three layers of finer triangles",
        lambda ask: dropped_layers(ask, 3),
    ),
)
