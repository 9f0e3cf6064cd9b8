"""How long a rebuild takes, by its parts, against the mesh's vertices and the subspace's basis functions.

An edit in the same mesh rebuilds matrices, the reduced matrix and its inverse; another mesh is made, carried over from
the old one, built and freed. Times are figures of the machine they were taken on, the least of a few; nothing is
asserted of them.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from edit_case import DEMO, mean_edge
from edit_table import row
from svg import Line, line_chart
from undone import silent

from tryon_server.runtime.order import DrapeOrder
from tryon_server.runtime.production import build_drape
from tryon_solver.dressing.carry_over import prepare, put_on
from tryon_solver.dressing.new_cut import NewCut
from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.geometry.pattern import Pattern, load_pattern, parse_pattern
from tryon_solver.geometry.size import mesh_in_size, mesh_with_vertices
from tryon_solver.live_edit import LiveEdit
from tryon_solver.redesign import edits
from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.drag import begin_drag
from tryon_solver.reshape import reshape
from tryon_solver.simulation import Simulation, build
from tryon_solver.subspace.basis import explicit_inverse, reduced_matrix

TIMES = 3  # each is taken; the least counts
VERTICES = (1000, 2500, 5000, 10_000)
SPACINGS = (0.7, 1.0, 1.4)  # times the preset's: of the splines, in which the subspace's size is set
WIDER = edits.ScaleGarment((1.03, 1.03))
DARTS = tuple(edits.Dart("front", 0, 0.25, 0.03, depth) for depth in (0.12, 0.121, 0.122, 0.123))
VALUE = ("moved shape", "matrices", "reduced matrix", "inverse")
TOPOLOGY = ("mesh", "what follows from it", "build", "put on")


def rebuild_times(vertices: int, spacings: Sequence[float], preset: str, device: str, wardrobe: Path) -> dict[str, Any]:
    """Seconds of each part for the demo's T-shirt: of a value edit, of another mesh, and by spacing of the splines."""
    path = DEMO / "patterns" / "tshirt.json"
    pattern = load_pattern(path)
    edge = mean_edge(mesh_with_vertices(pattern, vertices))
    order = DrapeOrder(path, "cotton_jersey", preset, device, edge_length=edge, wardrobe=wardrobe)
    drape = build_drape(order, silent)
    sim, spec = drape.simulation, drape.specification
    assert spec is not None
    mesh = mesh_in_size(pattern, edge, 1.0)
    wide = parse_pattern(apply(spec, WIDER).specification)
    live = LiveEdit(sim, begin_drag(mesh, parse_pattern(spec), sim.scene.fabric.thickness))
    moved = least(lambda: in_same_mesh(live, wide))
    taken = [another_cut(sim, mesh, apply(spec, dart).specification, edge) for dart in DARTS]
    parts = {name: min(of[name] for of in taken[1:]) for name in TOPOLOGY}  # the first one compiles, too
    live.now = live.wanted
    value = {"moved shape": moved, "matrices": least(lambda: reshape(sim, live.garment()))}
    rows = [by_basis(sim, spacing) for spacing in spacings]
    own = next(row for row in rows if row["spacing"] == 1.0)
    value |= {name: own[name] for name in ("reduced matrix", "inverse")}
    return {"vertices": sim.cloth_count, "value": value, "topology": parts, "bases": rows}


def in_same_mesh(live: LiveEdit, pattern: Pattern) -> None:
    """Have it become that. Raises ValueError where it needs another mesh: that would be told in no time."""
    refused = live.want(pattern)
    if refused is not None:
        raise ValueError(f"not a value edit: {refused.message}")


def by_basis(sim: Simulation, spacing: float) -> dict[str, float]:
    """What depends on the number of basis functions, at so many times the preset's spacing of the splines."""
    wide = replace(sim.settings, subspace_spacing=spacing * sim.settings.subspace_spacing)
    assert sim.body is not None
    other = build(sim.scene, wide, sim.device, sim.body.pose, sim.body_positions().astype(float))
    system = other.stiffness_matrix + sp.diags(other.diagonal(other.dt))
    reduced = reduced_matrix(other.basis, system)
    return {
        "spacing": spacing,
        "functions": reduced.shape[0],
        "reduced matrix": least(lambda: reduced_matrix(other.basis, system)),
        "inverse": least(lambda: explicit_inverse(reduced)),
    }


def another_cut(sim: Simulation, mesh: PanelMesh, spec: Mapping[str, Any], edge: float) -> dict[str, float]:
    """Seconds of each part of putting on another cut, one of whose pieces has not been meshed before."""
    times = [time.perf_counter()]
    new = mesh_in_size(parse_pattern(spec), edge, 1.0)
    times.append(time.perf_counter())
    cut = NewCut.of(new, mesh, sim.settings.subspace_spacing)
    times.append(time.perf_counter())
    *_, prepared = prepare(sim, cut, sim.scene.fabric)
    assert prepared is not None
    times.append(time.perf_counter())
    put_on(prepared, sim, mesh)
    times.append(time.perf_counter())
    return dict(zip(TOPOLOGY, np.diff(times).tolist()))


def least(action: Callable[[], object]) -> float:
    """The least time [s] of a few."""
    taken = []
    for _ in range(TIMES):
        begun = time.perf_counter()
        action()
        taken.append(time.perf_counter() - begun)
    return min(taken)


def plots(results: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """SVG by the file's stem: parts against vertices, and what the basis decides against its functions."""
    against = [
        Line(f"{edit}: {part}", [(r["vertices"], 1e3 * r[kind][part]) for r in results], colour, kind == "topology")
        for kind, edit, parts in (("value", "same mesh", VALUE), ("topology", "another mesh", TOPOLOGY))
        for colour, part in enumerate(parts)
        if all(part in r[kind] for r in results)
    ]
    bases = [
        Line(f"{r['vertices']} vertices: {part}", [(b["functions"], 1e3 * b[part]) for b in r["bases"]], k, dashed)
        for k, r in enumerate(results)
        for part, dashed in (("reduced matrix", True), ("inverse", False))
    ]
    title = "Rebuild after an edit"
    return {
        "rebuild_vertices": line_chart(f"{title}, by vertices", "vertices", "ms", against),
        "rebuild_bases": line_chart(f"{title}, by the subspace's size", "basis functions", "ms", bases),
    }


def table(made: Mapping[str, Any], folder: str) -> str:
    """The section of the page; the plots lie in a folder beside it."""
    about = made["about"]
    lines = ["", "## Rebuilds [ms]", "", f"Commit {about['commit']}; {about['machine']}; preset {about['preset']}.", ""]
    lines.append(row(["vertices", *VALUE, *(f"another: {part}" for part in TOPOLOGY)]))
    lines.append(row(["---"] * (1 + len(VALUE) + len(TOPOLOGY))))
    for r in made["rows"]:
        parts = [*(r["value"].get(part) for part in VALUE), *(r["topology"][part] for part in TOPOLOGY)]
        lines.append(row([str(r["vertices"]), *("–" if s is None else f"{1e3 * s:.1f}" for s in parts)]))
    lines += ["", *(f"![{name}]({folder}/{name}.svg)" for name in plots(made["rows"])), ""]
    return "\n".join(lines)
