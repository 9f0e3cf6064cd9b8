"""What the garment is made of, as its specification names it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tryon_solver.redesign.draft import Draft
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.edits import ChangeFabric


def change_fabric(draft: Draft, edit: ChangeFabric) -> None:
    """Edits ChangeFabric. Whoever dresses the garment knows which fabrics there are."""
    if draft.rest["properties"].get("fabric") == edit.fabric:
        raise EditError(f"it is of {edit.fabric!r} already", "fabric", "Choose another fabric")
    draft.rest["properties"]["fabric"] = edit.fabric


def named_fabric(specification: Mapping[str, Any]) -> str | None:
    """What a specification that parse_pattern passes is made of; None where it names nothing."""
    name: str | None = specification["properties"].get("fabric")
    return name


def made_of(specification: Mapping[str, Any], fabric: str) -> dict[str, Any]:
    """The same specification of this fabric."""
    return {**specification, "properties": {**specification["properties"], "fabric": fabric}}
