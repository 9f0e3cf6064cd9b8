"""Incremental potential contact: candidates, distances, barrier, friction, continuous collision detection, bounds.

The step's verbs are one list for all scenes, and some of them call contact where a scene touches something. So that a
scene which touches nothing neither imports contact nor, on a GPU, compiles it, `from tryon_solver.contact import pairs`
hands out a module that is imported when something of it is first asked for. Effects that let cloth touch something
import all that a step calls (`import_for_steps`), before kernels are compiled.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

FOR_STEPS = (
    *("bounds", "broad_phase", "candidates", "coasting", "crossings", "deflect", "distances", "filtering"),
    *("found", "hold", "nearest", "packets", "pairs", "pooled", "region", "surfaces", "verify"),
)


class Deferred:
    """A module that is imported when it is first asked for something. Use what it has as the module's own."""

    __slots__ = ("_name",)  # so that it has nothing but what the module has

    def __init__(self, name: str) -> None:
        object.__setattr__(self, "_name", name)

    def _module(self) -> Any:
        return sys.modules.get(self._name) or import_module(self._name)

    def __getattr__(self, attribute: str) -> Any:
        return getattr(self._module(), attribute)

    def __setattr__(self, attribute: str, value: object) -> None:
        setattr(self._module(), attribute, value)


def import_for_steps() -> None:
    """Import all that the steps of a scene with contact call. What names these modules has them itself from here on:
    each use of one that stands for them takes a microsecond, and a step has hundreds."""
    for name in FOR_STEPS:
        import_module(f"{__name__}.{name}")
    package = __name__.partition(".")[0]
    for caller in [module for name, module in sys.modules.items() if name.startswith(f"{package}.")]:
        for name, value in list(vars(caller).items()):
            if type(value) is Deferred:
                setattr(caller, name, value._module())


if not TYPE_CHECKING:  # the import of a submodule puts it in the place of what stands for it here
    globals().update({name: Deferred(f"{__name__}.{name}") for name in FOR_STEPS})
