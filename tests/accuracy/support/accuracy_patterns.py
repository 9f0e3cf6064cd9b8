"""Patterns that are measured: the demo's, and a layered skirt made of one of them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from tryon_solver.geometry.pattern import Pattern, parse_pattern

PATTERNS = Path(__file__).resolve().parents[3] / "server" / "tryon_server" / "demo" / "patterns"
LAYERED = "layered_skirt"
LAYER = [[-28.0, -30.0], [28.0, -30.0], [15.0, 0.0], [-15.0, 0.0]]  # cm: lies on a panel, sewn on by its upper edge
SEWN = {True: 2, False: 0}  # that edge, counter-clockwise or not
PLACE = [0.0, -3.0]  # cm, of its upper edge's middle


def specification(garment: str) -> dict[str, Any]:
    """The pattern as JSON holds it; `layered_skirt` is the demo's skirt with a second layer on its front and its
    back, free but for its upper edge."""
    name = "skirt" if garment == LAYERED else garment
    spec: dict[str, Any] = json.loads((PATTERNS / f"{name}.json").read_text())
    if garment == LAYERED:
        panels = spec["pattern"]["panels"]
        for name, host in list(panels.items()):
            panels[f"{name}_layer"] = layer_on(name, signed_area(host["vertices"]) > 0)
        spec["pattern"]["panel_order"] = list(panels)
    return spec


def pattern_of(garment: str) -> Pattern:
    """Of the demo by its name, or the layered skirt. Raises PatternError."""
    return parse_pattern(specification(garment))


def layer_on(host: str, counter_clockwise: bool) -> dict[str, Any]:
    """A piece that lies on the panel `host`, its outline running the same way round."""
    vertices = LAYER if counter_clockwise else LAYER[::-1]
    sewn = SEWN[counter_clockwise]
    return {
        "vertices": vertices,
        "edges": [{"endpoints": [k, (k + 1) % 4]} for k in range(4)],
        "translation": [0, 0, 0],
        "rotation": [0, 0, 0],
        "on": {"panel": host, "at": PLACE, "open": [k for k in range(4) if k != sewn]},
    }


def signed_area(polygon: list[list[float]]) -> float:
    """Above 0 where it runs counter-clockwise."""
    following = polygon[1:] + polygon[:1]
    return 0.5 * sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(polygon, following))
