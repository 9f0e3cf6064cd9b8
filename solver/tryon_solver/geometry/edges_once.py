"""Lines of a pattern that are asked for one by one, as edges of one mesh: an edge that two of them name is one edge.

A seam is one line of the mesh and two edges of the pattern, so two lines may name it, each from its side. Springs and
hinges of both would be summed there, which nobody asks for: what says the same twice is said once, and two that say
different things of one edge are a fault of theirs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tryon_solver.effect_words.fields import EffectError
from tryon_solver.geometry.named_lines import Cut

Line = Mapping[str, Any]
"""Edges of the pattern, `along`, and what is asked for along them."""


def edges_once(cut: Cut, lines: Sequence[Line], place: str) -> list[np.ndarray]:
    """Of each line the edges (K, 2) int32 of the mesh along it that no line before it has. Raises EffectError for an
    edge of the pattern that there is not."""
    taken: set[tuple[int, int]] = set()
    found = []
    for k, line in enumerate(lines):
        edges = cut.mesh_edges(line["along"], f"{place}[{k}].along")
        keys = _keys(edges)
        found.append(edges[[key not in taken for key in keys]])
        taken.update(keys)
    return found


def refuse_contradictions(cut: Cut, lines: Sequence[Line], fields: Sequence[str], place: str) -> None:
    """Raise EffectError, naming both places, where two lines that differ in any of these `fields` have an edge of the
    mesh in common; lines of edges that the pattern has."""
    first: dict[tuple[int, int], tuple[int, int]] = {}
    for k, line in enumerate(lines):
        for j, edge in enumerate(line["along"]):
            here = f"{place}[{k}].along[{j}]"
            for key in _keys(cut.mesh_edges([edge], place)):
                before_k, before_j = first.setdefault(key, (k, j))
                other = lines[before_k]
                differing = [field for field in fields if other[field] != line[field]]
                if not differing:
                    continue
                field, there = differing[0], other["along"][before_j]
                same = there == edge
                named = "this edge" if same else f"edge {there['edge']} of {there['panel']}, which this one is sewn to"
                raise EffectError(
                    f"{field} is {line[field]:g} here, and {other[field]:g} at {place}[{before_k}].along[{before_j}], "
                    f"{named}",
                    here,
                    f"Have the same {field} in both, or take one of them out: the two sides of a seam are one line",
                )


def _keys(edges: np.ndarray) -> list[tuple[int, int]]:
    """Each edge's vertices, the smaller one first."""
    return [(low, high) for low, high in np.sort(edges, axis=1).tolist()]
