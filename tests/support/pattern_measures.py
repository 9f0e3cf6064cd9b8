"""Lengths, areas and places of a pattern specification, by formulas of their own: nothing here is the solver's.

The plane is that of complex numbers, in metres. A curve's control point (u, v) is a + (b - a)(u + iv).
"""

import json
from math import comb
from pathlib import Path

import numpy as np

DEMO_PATTERNS = Path(__file__).resolve().parents[2] / "server" / "tryon_server" / "demo" / "patterns"
SAMPLES = 4001  # points of an edge: lengths are off by some 1e-7 of themselves


def demo(name):
    """The specification of a demo pattern."""
    return json.loads((DEMO_PATTERNS / f"{name}.json").read_text())


def rectangle(width, height, **more):
    """A panel in centimetres: edges 0 bottom, 1 right, 2 top, 3 left, counter-clockwise."""
    return {
        "vertices": [[0, 0], [width, 0], [width, height], [0, height]],
        "edges": [{"endpoints": [i, (i + 1) % 4]} for i in range(4)],
        **more,
    }


def sewn(panels, *stitches):
    """A specification in centimetres; each stitch is (panel, edge, panel, edge, *flags)."""
    sides = [[{"panel": a, "edge": i}, {"panel": b, "edge": j}, *flags] for a, i, b, j, *flags in stitches]
    return {"pattern": {"panels": panels, "stitches": sides}, "properties": {"units_in_meter": 100}}


def two_squares():
    """Two squares of 40 cm, sewn along both sides: a tube."""
    panels = {name: rectangle(40, 40, translation=[-20, 80, z]) for name, z in (("front", 20), ("back", -20))}
    return sewn(panels, ("front", 1, "back", 3), ("front", 3, "back", 1))


def vertices(spec, panel):
    """(V,) complex, m."""
    given = np.array(spec["pattern"]["panels"][panel]["vertices"], float) / spec["properties"]["units_in_meter"]
    return given[:, 0] + 1j * given[:, 1]


def edge_points(spec, panel, edge, samples=SAMPLES):
    """Points (samples,) complex, m, along an edge, both ends included."""
    given = spec["pattern"]["panels"][panel]["edges"][edge]
    a, b = vertices(spec, panel)[given["endpoints"]]
    t = np.linspace(0, 1, samples)
    curvature = given.get("curvature")
    if curvature is None:
        return a + t * (b - a)
    if isinstance(curvature, list):
        curvature = {"type": "quadratic", "params": [curvature]}
    params = curvature["params"]
    if curvature["type"] == "circle":
        radius = params[0] / spec["properties"]["units_in_meter"]
        half = abs(b - a) / 2
        to_centre = 1j * (b - a) / abs(b - a) * np.sqrt(max(radius**2 - half**2, 0))
        centre = (a + b) / 2 + (to_centre if params[1] != params[2] else -to_centre)
        turn = np.angle((b - centre) / (a - centre)) % (2 * np.pi)
        return centre + (a - centre) * np.exp(1j * t * (turn if params[2] else turn - 2 * np.pi))
    controls = [a, *(a + (b - a) * complex(u, v) for u, v in params), b]
    degree = len(controls) - 1
    return sum(comb(degree, k) * t**k * (1 - t) ** (degree - k) * point for k, point in enumerate(controls))


def length(spec, panel, edge):
    """Length of an edge, m."""
    return float(np.abs(np.diff(edge_points(spec, panel, edge))).sum())


def outline(spec, panel, samples=SAMPLES):
    """The piece's outline (n,) complex, m, in the order of its edges."""
    count = len(spec["pattern"]["panels"][panel]["edges"])
    return np.concatenate([edge_points(spec, panel, edge, samples)[:-1] for edge in range(count)])


def area(spec, panel):
    """Area of a piece, m^2."""
    points = outline(spec, panel)
    return abs(float(np.imag(np.conj(points) * np.roll(points, -1)).sum())) / 2


def placed(spec, panel, points):
    """Points (K,) complex m of a piece where the pattern places them, (K, 3) m."""
    given = spec["pattern"]["panels"][panel]
    flat = np.stack([points.real, points.imag, np.zeros(len(points))])
    for axis, degrees in enumerate(given.get("rotation", [0, 0, 0])):
        one, other = (axis + 1) % 3, (axis + 2) % 3
        turn = np.radians(degrees)
        flat[one], flat[other] = (
            np.cos(turn) * flat[one] - np.sin(turn) * flat[other],
            np.sin(turn) * flat[one] + np.cos(turn) * flat[other],
        )
    return flat.T + np.array(given.get("translation", [0, 0, 0])) / spec["properties"]["units_in_meter"]


def seams(spec):
    """((panel, edge), (panel, edge)) of every stitch."""
    return [tuple((side["panel"], side["edge"]) for side in stitch[:2]) for stitch in spec["pattern"]["stitches"]]


def seam_ratios(spec):
    """The length of every stitch's first edge over its second's."""
    return [length(spec, *one) / length(spec, *other) for one, other in seams(spec)]
