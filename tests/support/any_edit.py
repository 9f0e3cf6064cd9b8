"""Edits drawn at random of what a pattern has, or nearly: most can be made, and some have to be refused.

Who draws is told apart from what is drawn: hypothesis in the tests of the edits, a seeded generator where a worn
garment is edited hundreds of times.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol, TypeVar

import numpy as np

from tryon_solver.materials.fabric import FABRICS
from tryon_solver.redesign import edits

Item = TypeVar("Item")

FARTHEST = 0.04  # m that an edge, a vertex or a handle is moved
OUTSIDE = ((-0.9, 0.0), (0.9, 0.1), (0.0, -0.9), (0.1, 0.9), (-0.7, -0.7), (0.7, -0.5), (0.3, 0.3))  # m: ends of cuts


class Chance(Protocol):
    """Draws; what it draws should be as likely everywhere."""

    def one_of(self, items: Sequence[Item]) -> Item:
        """One of these."""

    def whole(self, least: int, most: int) -> int:
        """A whole number from `least` to `most`."""

    def real(self, least: float, most: float) -> float:
        """A number from `least` to `most`."""


class Seeded:
    """A generator of numpy: the same seed draws the same."""

    def __init__(self, seed: int) -> None:
        self._generator = np.random.default_rng(seed)

    def one_of(self, items: Sequence[Item]) -> Item:
        return items[int(self._generator.integers(len(items)))]

    def whole(self, least: int, most: int) -> int:
        return int(self._generator.integers(least, most + 1))

    def real(self, least: float, most: float) -> float:
        return float(self._generator.uniform(least, most))


def any_edit(chance: Chance, spec: Mapping[str, Any], kind: type[edits.Edit] | None = None) -> edits.Edit:
    """An edit, of that kind, of something that the garment has, or nearly: indices run one past the end."""
    panels = spec["pattern"]["panels"]
    panel = chance.one_of(sorted(panels))
    edge = chance.whole(0, len(panels[panel]["edges"]))
    made = kind or chance.one_of(list(edits.KINDS.values()))
    match made:
        case edits.MoveVertex:
            return edits.MoveVertex(panel, edge, _move(chance))
        case edits.MoveHandle:
            return edits.MoveHandle(panel, edge, chance.whole(0, 2), _move(chance))
        case edits.Lengthen:
            return edits.Lengthen(panel, edge, chance.real(-FARTHEST, FARTHEST))
        case edits.TakeIn:
            return edits.TakeIn(panel, edge, chance.real(-FARTHEST, FARTHEST))
        case edits.ScalePiece:
            return edits.ScalePiece(panel, _factors(chance))
        case edits.ScaleGarment:
            return edits.ScaleGarment(_factors(chance))
        case edits.CloseSeam:
            other = chance.one_of(sorted(panels))
            to_edge = chance.whole(0, len(panels[other]["edges"]))
            free = unsewn(spec)
            if free and chance.whole(0, 3):  # as a rule what is drawn so far is sewn to something else
                (panel, edge), (other, to_edge) = chance.one_of(free), chance.one_of(free)
            return edits.CloseSeam(panel, edge, other, to_edge, _flag(chance), _flag(chance))
        case edits.Cut:
            return edits.Cut(panel, (chance.one_of(OUTSIDE), chance.one_of(OUTSIDE)), _flag(chance))
        case edits.Dart:
            position, width, depth = chance.real(0, 1), chance.real(0.005, 0.05), chance.real(0.01, 0.2)
            return edits.Dart(panel, edge, position, width, depth)
        case edits.Patch | edits.Pocket:
            at = chance.real(-0.3, 0.3), chance.real(-0.3, 0.3)
            return made(panel, at, chance.real(0.03, 0.12), chance.real(0.03, 0.12), chance.real(-30, 30))
        case edits.RemovePiece:
            return edits.RemovePiece(panel)
        case edits.Gather:
            return edits.Gather(panel, edge, chance.one_of([None, chance.real(0.3, 1.0)]))
        case edits.Ease:
            return edits.Ease(panel, edge, chance.one_of([None, chance.real(-0.02, 0.05)]))
        case edits.OpenSeam:
            return edits.OpenSeam(panel, edge)
        case edits.ChangeFabric:
            return edits.ChangeFabric(chance.one_of(list(FABRICS)))
    raise ValueError(f"nobody knows how to draw a {made.kind}")


def unsewn(spec: Mapping[str, Any]) -> list[tuple[str, int]]:
    """The edges of all pieces, by piece and number, that no stitch joins."""
    pattern = spec["pattern"]
    sewn = {(side["panel"], side["edge"]) for stitch in pattern["stitches"] for side in stitch[:2]}
    every = (
        (name, edge) for name in sorted(pattern["panels"]) for edge in range(len(pattern["panels"][name]["edges"]))
    )
    return [each for each in every if each not in sewn]


def _move(chance: Chance) -> tuple[float, float]:
    return chance.real(-FARTHEST, FARTHEST), chance.real(-FARTHEST, FARTHEST)


def _factors(chance: Chance) -> tuple[float, float]:
    factor = chance.real(0.8, 1.25)
    return chance.one_of([(factor, factor), (factor, 1.0), (1.0, factor)])


def _flag(chance: Chance) -> bool:
    return chance.one_of([False, True])
