"""What a worn mesh depends on besides lengths: the fabric, the pieces, their edges, and how these are sewn."""

from __future__ import annotations

import numpy as np

from tryon_solver.geometry.pattern import Panel, Pattern, Stitch
from tryon_solver.redesign.remesh import Remesh

ALONG = np.linspace(0.0, 1.0, 5)  # where on two curves of one kind a difference of theirs shows


def difference(before: Pattern, after: Pattern) -> Remesh | None:
    """The first thing in which the structures of the two patterns differ; None when one mesh can serve both."""
    if before.fabric != after.fabric:
        return Remesh(f"it is of {after.fabric} instead of {before.fabric}")
    old = {panel.name: len(panel.edges) for panel in before.panels}
    new = {panel.name: len(panel.edges) for panel in after.panels}
    for name in [*old, *new]:
        if name not in new or name not in old:
            return Remesh(f"the piece {name!r} is {'new' if name in new else 'gone'}", name)
        if old[name] != new[name]:
            return Remesh(f"{name!r} has {new[name]} edges instead of {old[name]}", name)
    if list(old) != list(new):
        first = next(name for name, other in zip(new, old) if name != other)
        return Remesh(f"the pieces come in another order, {first!r} first", first)
    had, has = _sewn(before), _sewn(after)
    if had != has:
        others = [s for s in after.stitches if _how(s) not in had] + [s for s in before.stitches if _how(s) not in has]
        stitch = [*others, *after.stitches][0]
        name = before.panels[stitch.first.panel].name
        return Remesh(f"{name!r} is sewn otherwise at edge {stitch.first.edge}", name)
    for name in old:
        if _laid(before, name) != _laid(after, name):
            return Remesh(f"{name!r} is sewn on another piece otherwise", name)
    return None


def _laid(pattern: Pattern, name: str) -> object:
    """How a piece lies on another; None of one that does not. Its own shape is a part of that, by which its stitches
    find their places on the mesh beneath; what the shape beneath does to these a drag sees."""
    for patch in pattern.patches:
        if pattern.panels[patch.panel].name == name:
            host = pattern.panels[patch.host]
            return host.name, patch.at, patch.turn, patch.open, _shape(pattern.panels[patch.panel])
    return None


def _shape(panel: Panel) -> list[bytes]:
    return [edge.curve.points(ALONG).tobytes() for edge in panel.edges]


def _sewn(pattern: Pattern) -> list[tuple[object, ...]]:
    return [_how(stitch) for stitch in pattern.stitches]


def _how(stitch: Stitch) -> tuple[object, ...]:
    return stitch.first, stitch.second, stitch.reversed
