"""What is drawn of measured cases: a frame's time against vertices and against sessions, and what it is spent on."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from svg import LIGHT, Bar, Line, bar_chart, line_chart

Result = Mapping[str, Any]
Run = Mapping[str, Any]

HEADSET = (1e3 / 90, "a frame of a headset, 11.1 ms")
KINEMATIC = "move_body"  # the verb of the body's sub-steps
REST = "the rest"


def plots(runs: Sequence[Run]) -> dict[str, tuple[str, str]]:
    """File name -> title and SVG; a run has `name` and `results`. What was measured only once makes no line."""
    found = {}
    alone = [(run["name"], r) for run in runs for r in measured(run) if r["sessions"] == 1]
    for worn in dict.fromkeys((r["garment"], r["motion"]) for _, r in alone):
        of_worn = [(name, r) for name, r in alone if (r["garment"], r["motion"]) == worn]
        lines = drawn_lines(of_worn, lambda name, r: f"{r['preset']}, {name}", lambda r: r["cloth_vertices"])
        if lines:
            title = f"Time of a frame against vertices: {' '.join(worn)}"
            chart = line_chart(title, "vertices of the cloth", "ms", lines, [HEADSET])
            found[f"vertices-{'-'.join(worn)}.svg"] = title, chart
    everything = [(run["name"], r) for run in runs for r in measured(run)]
    lines = drawn_lines(
        everything,
        lambda name, r: f"{r['garment']} {r['motion']} {r['vertices']} {r['preset']}, {name}",
        lambda r: r["sessions"],
    )
    if lines:
        title = "Time of a frame against sessions at once"
        found["sessions.svg"] = title, line_chart(title, "sessions on one device", "ms", lines, [HEADSET])
    for run in runs:
        of_run = [r for r in measured(run) if r["sessions"] == 1]
        if of_run:
            title = f"Where the time of a frame goes: {run['name']}"
            found[f"stages-{plain(run['name'])}.svg"] = title, stages(title, of_run)
    return found


def measured(run: Run) -> list[Result]:
    """The worn cases that were played to their end."""
    return [r for r in run["results"] if "failure" not in r]


def drawn_lines(
    results: Sequence[tuple[str, Result]], label: Callable[[str, Result], str], x_of: Callable[[Result], float]
) -> list[Line]:
    """Median and 99th percentile of all that have the label in common, where there are two places x or more."""
    by_label: dict[str, dict[float, Result]] = {}
    for name, r in results:
        by_label.setdefault(label(name, r), {})[x_of(r)] = r
    lines = []
    for colour, (said, places) in enumerate((s, p) for s, p in by_label.items() if len(p) > 1):
        for figure, dashed in (("p50", False), ("p99", True)):
            points = [(float(x), r["frame_ms"][figure]) for x, r in places.items()]
            lines.append(Line(f"{said}: {figure}", points, colour, dashed))
    return lines


def stages(title: str, results: Sequence[Result]) -> str:
    """Shares of a frame's mean time, two bars a case: a step's verbs, and the body's kinematic sub-steps apart.

    Means add up, which medians don't; the rest is what is left of the frame, and the verbs that take least.
    """
    means = [{verb: times["mean"] for verb, times in r["stages_ms"].items()} for r in results]
    verbs = dict.fromkeys(verb for of_one in means for verb in of_one if verb != KINEMATIC)
    weight = {verb: sum(m.get(verb, 0.0) / r["frame_ms"]["mean"] for m, r in zip(means, results)) for verb in verbs}
    dearest = sorted(weight, key=lambda verb: -weight[verb])[: len(LIGHT) - 2]
    names = [KINEMATIC, *dearest, REST]
    bars = []
    for r, of_one in zip(results, means):
        frame = r["frame_ms"]["mean"]
        sizes = [of_one.get(verb, 0.0) for verb in names[:-1]]
        rest = max(0.0, frame - sum(sizes))
        parts = [(100 * ms / frame, k) for k, ms in enumerate([*sizes[1:], rest], 1)]
        bars.append(Bar(f"{r['name']}: the step", parts, f"{frame - sizes[0]:.1f} ms"))
        bars.append(Bar("the body's sub-steps", [(100 * sizes[0] / frame, 0)], f"{sizes[0]:.1f} ms"))
    return bar_chart(title, "share of a frame's mean time [%]", bars, names)


def plain(name: str) -> str:
    """For file names."""
    return "".join(c if c.isalnum() else "-" for c in name.lower())
