"""Edits to and from plain JSON: an object with the edit's kind and its fields."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, asdict, fields
from typing import Any

from tryon_solver.redesign.edit_error import EditError, choose_one_of
from tryon_solver.redesign.edits import KINDS, Edit


def plain(edit: Edit) -> dict[str, Any]:
    """The edit as JSON can hold it, without what was left out; parse_edit reads it back as an equal one."""
    told = {name: value for name, value in asdict(edit).items() if value is not None}
    return {"kind": edit.kind, **{name: _listed(value) for name, value in told.items()}}


def _listed(value: Any) -> Any:
    return [_listed(each) for each in value] if isinstance(value, tuple) else value


def parse_edit(given: Any) -> Edit:
    """The edit that the parsed JSON describes. Raises EditError naming the field that is at fault."""
    if not isinstance(given, Mapping):
        raise EditError("not an edit", "edit", 'Give an object with a "kind" and the fields of that kind')
    if not isinstance(given.get("kind"), str):
        raise EditError("the kind of edit is not stated", "kind", f"Use one of {', '.join(KINDS)}")
    if given["kind"] not in KINDS:
        raise EditError(f"there is no edit {given['kind']!r:.60}", "kind", choose_one_of(given["kind"], KINDS))
    kind = KINDS[given["kind"]]
    known = {field.name: field for field in fields(kind)}
    held = {name: value for name, value in given.items() if name != "kind"}
    for name in held:
        if name not in known:
            raise EditError(f"{kind.kind} has no field {name!r:.60}", f"{name!s:.60}", choose_one_of(f"{name}", known))
    for name, field in known.items():
        if name not in held and field.default is MISSING:
            raise EditError(f"{kind.kind} needs the field {name!r}", name, "Give it")
    return kind(**held)
