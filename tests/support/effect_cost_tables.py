"""The tables of what effects cost, in docs/effects.md, of the files that effect_costs.py makes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

BEGIN, END = "<!-- made by `make effects-page` -->", "<!-- until here -->"
CONTACT = ("detection", "assembly", "product", "time_of_impact", "verification")
HEAD = (
    "| effect | scene: cloth that | ms without | ms with | ratio | iterations without | with | ratio an iteration "
    "| ms, a call of each stage | kernels | KiB |"
)
SAID = """Medians of frames of 1/60 s with and without the effect in turn, at preset `live`. Where cloth moves otherwise
with the effect, another number of Newton iterations is in the ratio: below 1 the effect calms what it acts on. The
ratio an iteration leaves that out and comes nearer to what the effect costs; how many conjugate gradients an iteration
has, and what a frame does beside them, is still in it. Iterations are means of the same frames; - where a run did not
count them. A call of each stage is one of all that it has in a step, whatever often each is made; of contact each part
by itself ([clocked_contact.py](../solver/tryon_solver/stepping/clocked_contact.py)); - where a run did not measure any.
Kernels are those that only the scene with the effect launches, its own or not; memory is what it allocates more."""


def write(page: Path, runs: Sequence[Mapping[str, Any]]) -> None:
    """Put the tables of these runs into the page."""
    head, _, rest = page.read_text().partition(BEGIN)
    page.write_text(head + tables(runs) + rest.partition(END)[2])


def tables(runs: Sequence[Mapping[str, Any]]) -> str:
    """In Markdown."""
    return "\n".join([BEGIN, "", *SAID.splitlines(), *(line for run in runs for line in of_run(run)), "", END])


def of_run(run: Mapping[str, Any]) -> Iterator[str]:
    """Where it was, and the table."""
    about = run["about"]
    beside = f", {about['jobs']} scenes at once" if about.get("jobs", 1) > 1 else ""
    yield from ("", f"On {about['machine']}, commit {about['commit']}{beside};")
    yield f"squares of {about['vertices']} by {about['vertices']} vertices, a ball of 642, {about['frames']} frames:"
    yield from ("", HEAD, "|" + "---|" * (HEAD.count("|") - 1))
    for cost in run["effects"]:
        yield f"| {' | '.join(cells(cost))} |"


def cells(cost: Mapping[str, Any]) -> list[str]:
    """Of an effect."""
    bare, full = cost["ms"]
    without, with_it = cost["iterations"] or (0.0, 0.0)
    counted = without > 0 and with_it > 0
    kernels = ", ".join(k.rpartition(".")[2].removesuffix("_kernel") for k in cost["launched"]) or "-"
    return [
        cost["name"],
        cost["shows"],
        f"{bare:.1f}",
        f"{full:.1f}",
        f"{full / bare:.2f}",
        f"{without:.1f}" if cost["iterations"] else "-",
        f"{with_it:.1f}" if cost["iterations"] else "-",
        f"{full / bare * without / with_it:.2f}" if counted else "-",
        called(cost["calls"]),
        kernels,
        f"{cost['bytes'] / 1024:.0f}",
    ]


def called(calls: Mapping[str, float] | None) -> str:
    """ms of a call of each stage in all, of contact by part; - where it has none, or none was measured."""
    if not calls:
        return "-"
    parts = [f"{part.replace('_', ' ')} {calls[part]:.3f}" for part in CONTACT if part in calls]
    return "; ".join(parts) or f"{sum(calls.values()):.3f}"
