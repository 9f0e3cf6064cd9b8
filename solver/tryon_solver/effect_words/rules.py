"""What effects that are asked for have to do with each other, and which changes of them a running scene takes up."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from tryon_solver.effect_words.fields import Edges, Field, Panel, Panels, Rows
from tryon_solver.effect_words.table import BY_NAME

Parameters = Mapping[str, Any]
LINED = tuple(name for name, word in BY_NAME.items() if word.lined)
"""Effects along edges of the pattern, by their numbers."""


def in_scene(asked: Mapping[str, Parameters]) -> frozenset[str]:
    """Names of those that are not left out."""
    return frozenset(asked) - frozenset(left_out(asked))


def left_out(asked: Mapping[str, Parameters]) -> dict[str, str]:
    """Name of each effect that is not in the scene though it is asked for -> why, for people."""
    why = {
        name: f"{word.title.lower()} takes its place"
        for word in (BY_NAME[asked_name] for asked_name in asked)
        for name in word.takes_place_of
        if name in asked
    }
    if "sleep" in asked and gusty(asked):
        why["sleep"] = "cloth that is asleep feels no gusts"
    return why


def gusty(asked: Mapping[str, Parameters]) -> bool:
    """Does cloth never hang still with these, not on a body that stands either?"""
    return asked.get("wind", {}).get("gusts", 0.0) > 0


def same_but_values(name: str, before: Parameters, after: Parameters) -> bool:
    """Can a scene that has the effect as it was `before` be given `after` by its values alone?"""
    if name == "wind" and (before["gusts"] or after["gusts"]):  # their spectrum is that of the wind's speed
        return False
    if name == "gravity" and not (any(before["acceleration"]) and any(after["acceleration"])):
        return False  # none at all is left out of a scene
    fields = BY_NAME[name].fields
    return fixed(fields, before) == fixed(fields, after)


def with_pieces(name: str, parameters: Parameters, called: Callable[[str], str]) -> dict[str, Any]:
    """The effect's parameters with the pieces that they name `called` otherwise."""
    return _with_pieces(BY_NAME[name].fields, parameters, called)


def _with_pieces(fields: Sequence[Field], parameters: Parameters, called: Callable[[str], str]) -> dict[str, Any]:
    changed = dict(parameters)
    for field in fields:
        value = parameters[field.name]
        if isinstance(field, Panel):
            changed[field.name] = called(value)
        elif isinstance(field, Panels):
            changed[field.name] = [called(piece) for piece in value]
        elif isinstance(field, Edges):
            changed[field.name] = [{**edge, "panel": called(edge["panel"])} for edge in value]
        elif isinstance(field, Rows):
            changed[field.name] = [_with_pieces(field.fields, row, called) for row in value]
    return changed


def rows_of_garments(
    name: str, parameters: Parameters, wanted: Callable[[frozenset[str]], bool]
) -> dict[str, Any]:
    """The effect's parameters with those entries of its lists alone whose pieces are of `wanted` garments, by the names
    that these have before their pieces' and a slash; an entry that names no piece stays."""
    kept = dict(parameters)
    for field in BY_NAME[name].fields:
        if isinstance(field, Rows):
            named = [(row, _garments_of(field.fields, row)) for row in parameters[field.name]]
            kept[field.name] = [row for row, garments in named if not garments or wanted(garments)]
    return kept


def _garments_of(fields: Sequence[Field], row: Parameters) -> frozenset[str]:
    found = set()

    def note(piece: str) -> str:
        found.add(piece.rpartition("/")[0])
        return piece

    _with_pieces(fields, row, note)
    return frozenset(found)


def together(each: Sequence[Mapping[str, Parameters]]) -> dict[str, Parameters]:
    """The effects of several garments as those of an outfit: of one that more than one has, the rows of all."""
    found: dict[str, Parameters] = {}
    for own in each:
        for name, parameters in own.items():
            before = found.get(name, {})
            rows = {
                field.name: [*before.get(field.name, ()), *parameters[field.name]]
                for field in BY_NAME[name].fields
                if isinstance(field, Rows)
            }
            found[name] = {**parameters, **rows}
    return found


def fixed(fields: Sequence[Field], parameters: Parameters) -> list[Any]:
    """What of the parameters can't be written to a running scene, in the fields' order."""
    found: list[Any] = []
    for field in fields:
        if not field.live:
            found.append(parameters[field.name])
        elif isinstance(field, Rows):
            found.append([fixed(field.fields, row) for row in parameters[field.name]])
    return found
