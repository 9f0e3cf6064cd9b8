"""Results as the bench writes them, made up."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

ABOUT = {"machine": "a made-up one", "commit": "abc", "frames": "30 a second, 3 s of the motion, which repeats"}


def spread(middle: float) -> dict[str, float]:
    return {"mean": middle, "p50": middle, "p99": 2 * middle, "max": 3 * middle}


def worn(vertices: int, ms: float, preset: str = "live", sessions: int = 1, **changed: Any) -> dict[str, Any]:
    """A T-shirt on the walk whose frames take about `ms`: a tenth for the body, six for the correction."""
    return {
        "name": f"tshirt-walk-{vertices}-{preset}-cuda0" + ("" if sessions == 1 else f"-x{sessions}"),
        "garment": "tshirt",
        "motion": "walk",
        "vertices": vertices,
        "preset": preset,
        "device": "cuda:0",
        "sessions": sessions,
        "cloth_vertices": vertices,
        "frame_ms": spread(ms),
        "stages_ms": {"move_body": spread(0.1 * ms), "correct_penetration": spread(0.6 * ms)},
        "newton": spread(4.0),
        "pairs": spread(900.0),
        "substeps": {"2": 90},
        "min_gap": 1e-4,
        "max_stretch": 1.1,
        "body_lag": 1e-3,
        "void": 0,
        "asked": 9,
        "unclean": 0,
        "memory_mib": 120.0,
        "growth_mib": {"process": 0.0},
        "dressing_s": 3.0,
        "simulated_over_wall": 1.0,
        **changed,
    }


def kept(file: Path, *results: dict[str, Any], **parts: Any) -> Path:
    """A run's file."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps({"about": ABOUT, "results": results, "peers": [], "roofline": [], **parts}))
    return file
