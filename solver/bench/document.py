"""Several runs of the bench beside each other: a page in Markdown, and its plots in a folder of the page's name."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import peer_table
import roofline_table
import starting_table
from bench_table import SAID, figures_of, stages_of
from plots import plots

RESULTS = "results.json"  # what a run leaves


class NoRunError(ValueError):
    """A place in which no run has ended."""


def ended(places: Sequence[Path]) -> list[dict[str, Any]]:
    """What runs left in these folders, or in these files of other names; a run is called what its place is called.

    Raises NoRunError where there is none.
    """
    files = [place / RESULTS if place.is_dir() else place for place in places]
    missing = [str(file) for file in files if not file.exists()]
    if missing:
        raise NoRunError(f"no run has ended: {', '.join(missing)} is not there; `make bench` writes it")
    names = [place.resolve().name if place.is_dir() else place.stem for place in places]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise NoRunError(f"two runs are called {', '.join(twice)}: rename a folder or a file, for the page tells by it")
    return [{"name": name, **read(file)} for name, file in zip(names, files)]


def read(file: Path) -> dict[str, Any]:
    """What a run left. Raises NoRunError where it is something else."""
    try:
        run = json.loads(file.read_text())
    except ValueError as error:
        raise NoRunError(f"{file} is no run's {RESULTS}: {error}") from error
    if not isinstance(run, dict) or not {"about", "results"} <= run.keys():
        raise NoRunError(f"{file} is no run's {RESULTS}: it tells nothing of what was measured")
    return run


def write(page: Path, runs: Sequence[Mapping[str, Any]]) -> None:
    """The page, and the plots beside it; those of an earlier page are gone."""
    folder = page.with_suffix("")
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob("*.svg"):
        old.unlink()
    drawn = plots(runs)
    for name, (_, chart) in drawn.items():
        (folder / name).write_text(chart)
    page.write_text(document(runs, {f"{folder.name}/{name}": title for name, (title, _) in drawn.items()}))


def document(runs: Sequence[Mapping[str, Any]], pictures: Mapping[str, str]) -> str:
    """The page; `pictures` by their places, seen from it, with their titles."""
    lines = ["# Bench", "", "Written by `make bench-page` of what `make bench` left.", "", SAID, ""]
    for run in runs:
        lines += [f"- **{run['name']}**", *(f"  - {name}: {value}" for name, value in run["about"].items())]
    lines.append("")
    for place, title in pictures.items():
        lines += [f"![{title}]({place})", ""]
    for run in runs:
        if run["results"]:
            lines += [f"## Figures: {run['name']}", "", *figures_of(run["results"]), ""]
    for run in runs:
        if run["peers"]:
            lines += [f"## Other solvers: {run['name']}", "", *peer_table.section(run["peers"]), ""]
    for run in runs:
        if run["roofline"]:
            lines += [f"## Kernels and roofs: {run['name']}", "", *roofline_table.section(run["roofline"]), ""]
        if run.get("starts"):  # not in older runs
            lines += [f"## Starts: {run['name']}", "", *starting_table.section(run["starts"]), ""]
    for run in runs:
        if run["results"]:
            lines += [f"## Stages: {run['name']}", *stages_of(run["results"]), ""]
    return "\n".join(lines)
