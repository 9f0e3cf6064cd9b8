"""Rows and results as runs leave them, made up: for tests of the page."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from accuracy_case import AccuracyCase
from recorded import Writer

ABOUT = {"commit": "none", "machine": "none"}


def rows(method: str, *pairs: tuple[float, float], ms: float = 5.0, **more: Any) -> list[dict[str, Any]]:
    """A row for each (error, estimate)."""
    return [
        {
            "state": k,
            "method": method,
            "error": error,
            "largest": 3 * error,
            "strain": 0.1 * error,
            "normal": error,
            "energy": None if k else error,
            "crossed": 0,
            "ms": ms,
            "estimate": estimate,
            "newton": 4,
            "void": False,
            "ms_correction": 0.5 * ms,
            "ms_check": 0.1 * ms,
            "ms_estimate": 0.05 * ms,
            **more,
        }
        for k, (error, estimate) in enumerate(pairs)
    ]


def put(
    folder: Path,
    family: str,
    methods: Mapping[str, tuple[Mapping[str, Any], Sequence[Mapping[str, Any]]]],
    case: AccuracyCase | None = None,
    device: str = "cpu",
) -> None:
    """A file of lines: methods are name -> (about, rows)."""
    case = case or AccuracyCase("skirt", "walk", 1 / 60, held_out=True)
    head = {
        "about": ABOUT,
        "case": case.plain(),
        "family": family,
        "device": device,
        "methods": {name: about for name, (about, _) in methods.items()},
    }
    writer = Writer(folder / f"{case.name}-{family}-{device.replace(':', '')}.jsonl", head)
    for _, of in methods.values():
        writer.add(of)


def about(solver: str = "ours", **at: float) -> dict[str, Any]:
    """Of a method: its solver, and what was varied."""
    return {"solver": solver, "at": at}


def put_presets(
    folder: Path, draft: Sequence[tuple[float, float]], live: Sequence[tuple[float, float]], **more: Any
) -> None:
    """With a preset `reference`, which is right."""
    exact = rows("reference", (0.001, 0.001), (0.001, 0.001), ms=50.0)
    methods = {"draft": (about(), rows("draft", *draft)), "live": (about(), rows("live", *live, ms=10.0))}
    put(folder, "presets", {**methods, "reference": (about(), exact)}, **more)


def timed_case(deadline: float | None, late: int, **more: Any) -> dict[str, Any]:
    """A case of the bench."""
    return {
        **{"name": "none", "garment": "tshirt", "motion": "/some/where/cart_wheel.bvh", "vertices": 20000},
        **{"preset": "draft", "device": "cpu", "fps": 90.0, "sessions": 1, "fabric": "denim", "accuracy_mm": None},
        **{"machine": "CPU", "cloth_vertices": 20044, "frames": 1000, "unclean": 0, "asked": 10, "max_stretch": 1.5},
        **{"frame_ms": {"p50": 10.0, "p99": 12.5, "max": 20.0}, "error_mm": {"p50": 0.25, "p99": 0.75}},
        **{"deadline_ms": deadline, "late": late, "void": 0, "simulated_over_wall": 0.5, **more},
    }


def put_timed(folder: Path, *cases: Mapping[str, Any], name: str = "bench", commit: str = "none") -> None:
    """Results of the bench."""
    run = {"about": {**ABOUT, "commit": commit}, "results": cases}
    (folder / f"{name}.json").write_text(json.dumps(run))
