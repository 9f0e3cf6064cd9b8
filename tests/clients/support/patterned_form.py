"""The dress form in tunics that have sewing patterns: edits, fabrics and outfits are taken up, effects along edges of
the patterns are there. The tunics look as ever.

A crease wants a seam, and a row of buttons two edges, as the solver has it. The fabric ``tight`` can't be worn.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from dress_form import FITTING_SIZE, MOST_WORN, Tunic, load_motion
from pretended_effects import PretendedEffects

from tryon_server.problems import problem_error
from tryon_solver.effect_words.fields import EffectError
from tryon_solver.redesign.fabrics import named_fabric

__all__ = ["build", "load_motion"]


class LinedEffects(PretendedEffects):
    """Effects that know the edges of the patterns."""

    def __init__(self, specifications: Mapping[str, Mapping[str, Any]], asked: Any = None) -> None:
        super().__init__(asked, tuple(specifications))
        self.specifications = specifications

    def check(self, asked: Mapping[str, Mapping[str, Any]]) -> None:
        """Raises EffectError for a piece or an edge that there is not, and for a crease along an open one."""
        for parameters in asked.values():
            for name, value in parameters.items():
                rows = value if isinstance(value, list) else []
                for k, row in enumerate(row for row in rows if isinstance(row, dict)):
                    self._check_row(row, f"parameters.{name}[{k}]")
        for k, row in enumerate(asked.get("creases", {}).get("lines", [])):
            if any(edge["edge"] not in self._sewn(edge["panel"]) for edge in row["along"]):
                place = f"parameters.lines[{k}].along"
                raise EffectError("it is no seam along all its length", place, "Press an edge that is sewn")
        for k, row in enumerate(asked.get("fasteners", {}).get("rows", [])):
            if row["first"] == row["second"]:
                place = f"parameters.rows[{k}]"
                raise EffectError("the two edges are one seam", place, "Name two edges that are not sewn together")

    def _check_row(self, row: Mapping[str, Any], place: str) -> None:
        if "panel" in row:
            self._pattern(row["panel"], place)
        for name, edges in row.items():
            for k, edge in enumerate(edges if isinstance(edges, list) else []):
                pieces = self._pattern(edge["panel"], f"{place}.{name}[{k}]")["panels"]
                if edge["edge"] >= len(pieces[edge["panel"].rpartition("/")[2]]["edges"]):
                    raise EffectError("there is no such edge", f"{place}.{name}[{k}].edge", "Name another")

    def _pattern(self, piece: str, place: str = "") -> Mapping[str, Any]:
        garment, _, name = piece.rpartition("/")
        known = self.specifications
        found = known.get(garment) or (next(iter(known.values())) if len(known) == 1 else None)
        if found is None or name not in found["pattern"]["panels"]:
            raise EffectError(f"there is no piece {piece!r}", place, "Name another")
        return found["pattern"]

    def _sewn(self, piece: str) -> set[int]:
        name = piece.rpartition("/")[2]
        return {
            side["edge"]
            for seam in self._pattern(piece)["stitches"]
            for side in seam
            if isinstance(side, dict) and side["panel"] == name
        }


class PatternedTunic(Tunic):
    """Tunics that were made of these patterns, by the names that they are worn under."""

    def __init__(self, fabrics: dict[str, str], specifications: Mapping[str, Any], asked: Any = None) -> None:
        super().__init__("", fabrics)
        self._specifications = dict(specifications)
        self.effects = LinedEffects(specifications, asked)

    @property
    def specifications(self) -> dict[str, Mapping[str, Any]]:  # type: ignore[override]
        return self._specifications

    @property
    def specification(self) -> Mapping[str, Any]:
        return self._specifications[self.edited]

    @property
    def shape_of(self) -> Any:
        return no_shape

    def reshape(self, specification: Mapping[str, Any], shape: Any = None) -> str:  # noqa: ARG002
        if (named_fabric(specification) or self.fabrics[self.edited]) != self.fabrics[self.edited]:
            return "it is of another fabric"
        self._take(specification)
        return ""

    def _take(self, specification: Mapping[str, Any]) -> None:
        self._specifications = {**self._specifications, self.edited: specification}
        self.effects.specifications = self._specifications

    def cutting(self, specification: Mapping[str, Any], fabric: str) -> Any:
        return partial(tuple, (specification, fabric))

    def recut(self, cut: Any, hung: Any = None) -> Iterator[PatternedTunic | None]:
        specification, fabric = cut  # `hung` is of no use where nothing hangs
        del hung
        if fabric == "tight":
            return
        yield None
        changed = {**self._specifications, self.edited: specification}
        yield self._as_now(PatternedTunic({**self.fabrics, self.edited: fabric}, changed, self.effects.asked))

    def take_off(self, *names: str) -> Iterator[PatternedTunic]:  # type: ignore[override]
        fabrics = {own: fabric for own, fabric in self.fabrics.items() if own not in names}
        left = {own: specification for own, specification in self._specifications.items() if own not in names}
        yield self._as_now(PatternedTunic(fabrics, left, self.effects.asked))

    def unpacking(self, specification: Any = None) -> Iterator[PatternedTunic]:  # type: ignore[override]
        if specification is not None:
            self._take(specification)
        yield self

    def _as_now(self, tunic: PatternedTunic) -> PatternedTunic:
        tunic.current, tunic.t, tunic.origin, tunic.preset = self.current, self.t, self.origin, self.preset
        tunic.outfit = replace(tunic.outfit, size=self.outfit.size)
        tunic.edited = self.edited if self.edited in tunic.names else tunic.names[-1]
        return tunic


def no_shape(_specification: Mapping[str, Any]) -> None:
    """What a pattern is in the mesh of a tunic that stays as it is."""


def build(order: Any, progress: Any) -> PatternedTunic:
    for step in range(4):
        progress("Sewing the pieces", step / 4)
    if "tight" in (one.fabric for one in order.garments):
        raise problem_error("garment.undressable", "the seam between front and back stayed open", "Enlarge the pieces")
    if len(order.garments) > MOST_WORN:
        raise problem_error("garment.unfit", f"{order.over[-1].worn_as} is too tight over the others", "Enlarge it")
    specifications = {one.worn_as: one.specification or json.loads(one.pattern.read_text()) for one in order.garments}
    tunic = PatternedTunic({one.worn_as: one.fabric for one in order.garments}, specifications).ordered(order.preset)
    tunic.edited = order.of_edited.worn_as
    tunic.outfit = replace(tunic.outfit, size=FITTING_SIZE if order.size is None else order.size)
    return tunic
