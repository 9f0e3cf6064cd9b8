"""Patterns for the geometry tests: small ones made here, real ones from the shared data folder when it is there."""

import os
from functools import lru_cache
from pathlib import Path

import pytest

from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import load_pattern

REPOSITORY = Path(__file__).resolve().parents[3]
DEMO_PATTERNS = REPOSITORY / "server" / "tryon_server" / "demo" / "patterns"
REAL_PATTERNS = Path(os.environ.get("TRYON_SHARED_DATA", REPOSITORY.parent / "shared" / "data")) / "patterns"


def _rectangle(width, height, **more):
    """A panel specification in centimetres: edges 0 bottom, 1 right, 2 top, 3 left, counter-clockwise."""
    return {
        "vertices": [[0, 0], [width, 0], [width, height], [0, height]],
        "edges": [{"endpoints": [i, (i + 1) % 4]} for i in range(4)],
        "translation": [0, 0, 0],
        "rotation": [0, 0, 0],
        **more,
    }


def _specification(panels, stitches=()):
    """A pattern specification in centimetres; each stitch is (panel, edge, panel, edge, *flags)."""
    sewn = [[{"panel": a, "edge": i}, {"panel": b, "edge": j}, *flags] for a, i, b, j, *flags in stitches]
    return {"pattern": {"panels": panels, "stitches": sewn}, "properties": {"units_in_meter": 100}}


@pytest.fixture
def rectangle():
    return _rectangle


@pytest.fixture
def specification():
    return _specification


@lru_cache
def _meshed(path, edge_length):
    return mesh_pattern(load_pattern(path), edge_length)


@pytest.fixture
def meshed():
    """meshed(path, edge_length): the mesh of a pattern file, made once for all tests."""
    return _meshed


@pytest.fixture
def demo_patterns():
    """The folder of the demo's own patterns."""
    return DEMO_PATTERNS


@pytest.fixture
def two_squares():
    """Two squares of 40 cm side by side, sewn along one edge."""
    panels = {"left": _rectangle(40, 40), "right": _rectangle(40, 40, translation=[50, 0, 0])}
    return _specification(panels, [("left", 1, "right", 3)])


def _pattern_files():
    """Every real and every demo pattern; one skipped parameter when the real ones are absent."""
    real = sorted(REAL_PATTERNS.glob("*_specification.json"))
    demo = sorted(DEMO_PATTERNS.glob("*.json"))
    params = [pytest.param(path, id=path.stem.removesuffix("_specification")) for path in real + demo]
    if not real:
        reason = f"no GarmentCode patterns in {REAL_PATTERNS}; set TRYON_SHARED_DATA to the folder that holds them"
        params.append(pytest.param(None, id="real patterns", marks=pytest.mark.skip(reason=reason)))
    return params


@pytest.fixture(params=_pattern_files())
def pattern_path(request):
    """Path of a pattern file, one after the other."""
    return request.param
