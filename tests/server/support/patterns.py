"""Small patterns as a pattern tool writes them."""

from __future__ import annotations

import json
from typing import Any


def piece(width: float, height: float, z: float) -> dict[str, Any]:
    """A rectangle [cm] in front of (z > 0) or behind the body."""
    return {
        "translation": [-width / 2, 80.0, z],
        "rotation": [0.0, 0.0, 0.0] if z > 0 else [0.0, 180.0, 0.0],
        "vertices": [[0, 0], [width, 0], [width, height], [0, height]],
        "edges": [{"endpoints": [i, (i + 1) % 4]} for i in range(4)],
    }


def tube(width: float = 60.0, height: float = 50.0) -> dict[str, Any]:
    """Two rectangles sewn into a tube."""
    return {
        "pattern": {
            "panels": {"front": piece(width, height, 30.0), "back": piece(width, height, -30.0)},
            "stitches": [
                [{"panel": "front", "edge": 1}, {"panel": "back", "edge": 3}],
                [{"panel": "front", "edge": 3}, {"panel": "back", "edge": 1}],
            ],
            "panel_order": ["front", "back"],
        },
        "parameters": {},
        "parameter_order": [],
        "properties": {"curvature_coords": "relative", "normalize_panel_translation": False, "units_in_meter": 100},
    }


def bag(width: float, height: float) -> dict[str, Any]:
    """The tube sewn up at its upper end: it hangs on what it is put over."""
    spec = tube(width, height)
    spec["pattern"]["stitches"].append([{"panel": "front", "edge": 2}, {"panel": "back", "edge": 2}])
    return spec


def scarf() -> dict[str, Any]:
    """A long piece that is sewn to nothing."""
    spec = tube()
    spec["pattern"].update(panels={"scarf": piece(30.0, 150.0, 20.0)}, stitches=[], panel_order=["scarf"])
    return spec


def gathered() -> dict[str, Any]:
    """A tube, one side of which asks for 50 cm to be gathered onto an arc of 11.7 cm."""
    spec = tube()
    front = spec["pattern"]["panels"]["front"]
    front["vertices"] = [[0, 0], [60, 0], [60, 50], [0, 11.4]]
    front["edges"][3]["curvature"] = {"type": "circle", "params": [15.0, 0, 0]}
    spec["pattern"]["stitches"][1].append("gather")
    return spec


def as_bytes(pattern: dict[str, Any]) -> bytes:
    return json.dumps(pattern).encode()
