"""What a pattern's edges carry besides their shape: elastic, pressed creases, buttons and zips.

An addition to the format (pattern.py): an edge may have `"elastic": {"ratio": 0.9, "stiffness": 30}`, `"crease":
{"angle": 60}`, or `"fastened": {"as": "fly", "buttons": 3}`; the edges that are fastened by one name are the two sides
of one row of buttons, without their number of one zip. What is written at an edge goes with it through every edit:
where it is divided, both parts have it. Units and bounds are those of tryon_solver/effect_words/table.py.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tryon_solver.effect_words.fields import EffectError, checked
from tryon_solver.effect_words.table import BY_NAME, ON_EDGES

Side = tuple[int, int]


@dataclass(frozen=True)
class EdgeEffect:
    """What acts along an edge: `name` is one of ON_EDGES, `parameters` all that it says, plain JSON."""

    panel: int
    edge: int
    name: str
    parameters: Mapping[str, Any]


def read_edge_effects(
    panels: Sequence[tuple[str, Sequence[Mapping[str, Any]]]], seams: Sequence[Sequence[Side]]
) -> tuple[EdgeEffect, ...]:
    """Those of all edges of these panels, each a name and its edges as the file has them, of which these are sewn in
    pairs, the `seams`. Raises EffectError."""
    found = []
    sewn = {side for seam in seams for side in seam}
    for panel, (name, edges) in enumerate(panels):
        for number, edge in enumerate(edges):
            for word, fields in ON_EDGES.items():
                if word in edge:
                    place = f"panels.{name}.edges[{number}].{word}"
                    found.append(EdgeEffect(panel, number, word, checked(fields, edge[word], place)))
                    if word == "crease" and (panel, number) not in sewn:
                        remedy = "Press an edge that is sewn, or divide the panel along the crease and sew it"
                        raise EffectError("a border has but one side, nothing to fold", place, remedy)
    effects = tuple(found)
    _refuse_contradictions(effects, [name for name, _ in panels], seams)
    counts = [len(edges) for _, edges in panels]
    for fastener, sides in fastened_sides(effects, counts).items():
        if len(sides) != 2:
            first = next(e for e in effects if e.name == "fastened" and e.parameters["as"] == fastener)
            raise EffectError(
                f"{fastener!r} fastens {len(sides)} lines of edges to each other",
                f"panels.{panels[first.panel][0]}.edges[{first.edge}].fastened",
                "Have it at the edges of two lines, each of edges in a row",
            )
    return effects


def _refuse_contradictions(
    effects: Sequence[EdgeEffect], names: Sequence[str], seams: Sequence[Sequence[Side]]
) -> None:
    """Raise EffectError, naming both places, where edges that are sewn to each other carry an effect otherwise: they
    are one line of the garment."""
    carried = {(effect.panel, effect.edge, effect.name): effect.parameters for effect in effects}
    for one, other in seams:
        for word in ("elastic", "crease"):
            here, there = carried.get((*other, word)), carried.get((*one, word))
            if here is None or there is None or here == there:
                continue
            field = next(field for field in here if here[field] != there[field])
            place, before = (f"panels.{names[panel]}.edges[{edge}].{word}" for panel, edge in (other, one))
            fault = f"{field} is {here[field]:g}, and {there[field]:g} at {before}, the other side of the same seam"
            raise EffectError(fault, f"{place}.{field}", f"Have the same {field} at both, or {word} at one of them")


def fastened_sides(effects: Sequence[EdgeEffect], counts: Sequence[int]) -> dict[str, list[list[Side]]]:
    """By the name that fastens them, lines of edges in a row around their panels, which have so many edges."""
    sides: dict[str, list[list[Side]]] = {}
    for effect in effects:
        if effect.name != "fastened":
            continue
        lines = sides.setdefault(effect.parameters["as"], [])
        here = (effect.panel, effect.edge)
        if lines and lines[-1][-1] == (effect.panel, effect.edge - 1):
            lines[-1].append(here)
        else:
            lines.append([here])
    for lines in sides.values():  # one that runs over the end of the outline's list is one
        for line in [line for line in lines if line[0][1] == 0]:
            panel = line[0][0]
            last = next((it for it in lines if it is not line and it[-1] == (panel, counts[panel] - 1)), None)
            if last is not None:
                last += line
                lines.remove(line)
    return sides


def called_for(
    effects: Sequence[EdgeEffect], names: Sequence[str], counts: Sequence[int]
) -> dict[str, dict[str, Any]]:
    """What panels of these names, with so many edges, call for by what their edges carry: effects by name, with all
    their parameters (tryon_solver/effect_words/table.py). Edges that carry the same are one line."""

    def named(side: Side) -> dict[str, Any]:
        return {"panel": names[side[0]], "edge": side[1]}

    found: dict[str, dict[str, Any]] = {}
    for name, word in (("elastic", "elastic"), ("crease", "creases")):
        lines: list[tuple[Mapping[str, Any], list[dict[str, Any]]]] = []
        for effect in (effect for effect in effects if effect.name == name):
            along = next((along for carried, along in lines if carried == effect.parameters), None)
            if along is None:
                along = []
                lines.append((effect.parameters, along))
            along.append(named((effect.panel, effect.edge)))
        if lines:
            rows = [{"along": along, **carried} for carried, along in lines]
            found[word] = BY_NAME[word].parameters({"lines": rows})
    buttons = {e.parameters["as"]: e.parameters["buttons"] for e in effects if e.name == "fastened"}
    rows = []
    for fastener, (first, second) in fastened_sides(effects, counts).items():
        sides = {"first": [named(side) for side in first], "second": [named(side) for side in second]}
        rows.append({**sides, "buttons": buttons[fastener]})
    if rows:
        found["fasteners"] = BY_NAME["fasteners"].parameters({"rows": rows})
    return found
