"""What the numbers of all effects have in common: the module that does what they ask for, and what several check."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

if TYPE_CHECKING:
    from tryon_solver.scene import Scene


@dataclass(frozen=True)
class EffectSpec:
    """What a scene asks for, in numbers; one class for each effect, those made outside this package among them
    (docs/effects.md says how).

    `module` is imported when a scene lists the effect, and not before: its `bind(spec, context)` returns the
    effect's Contribution (plan.py), or None where there is nothing to do. Nor is it where the spec itself says so, by
    `idle`: of what is named in `acts_by` there must be some, and no number may be 0.
    """

    module: ClassVar[str]
    acts_by: ClassVar[tuple[str, ...]] = ()

    def check(self, scene: Scene) -> None:
        """Raise ValueError, naming field, place and remedy, where the effect does not suit the scene."""

    def idle(self, scene: Scene) -> str:  # noqa: ARG002
        """Why the effect has nothing to do in the scene, for people; "" where it has, as far as its numbers tell."""
        for name in self.acts_by:
            value = getattr(self, name)
            if np.size(value) == 0:
                return f"it has no {name}"
            if not isinstance(value, np.ndarray) and not np.any(value):  # a lone index may be 0
                return f"its {name} is 0"
        return ""


def check_vertices(name: str, vertices: np.ndarray, scene: Scene) -> None:
    """Raise ValueError for the first of `vertices`, of any shape, that the garment does not have."""
    count = scene.garment.vertex_count
    outside = vertices[(vertices < 0) | (vertices >= count)]
    if len(outside):
        raise ValueError(f"{name}: there is no vertex {int(outside[0])}; use 0 to {count - 1}")


def check_panels(name: str, panels: tuple[int, ...], scene: Scene) -> None:
    """Raise ValueError for the first of `panels` that the garment does not have."""
    count = int(scene.garment.panel_of_face.max()) + 1
    for panel in panels:
        if not 0 <= panel < count:
            raise ValueError(f"{name}: there is no panel {panel}; the garment has {count}, numbered from 0")


def check_apart(name: str, pairs: np.ndarray, what: str) -> None:
    """Raise ValueError for the first of the `pairs` (K, 2), of what each is one, of which both vertices are one."""
    same = pairs[:, 0] == pairs[:, 1]
    if same.any():
        bad = int(np.argmax(same))
        raise ValueError(f"{name}: {what} {bad} is vertex {int(pairs[bad, 0])} twice; name two vertices")


def check_once(name: str, edges: np.ndarray, what: str = "edge") -> None:
    """Raise ValueError, beginning with `name`, where two of the `edges` (K, 2), or of `what` they are, are one,
    whichever end comes first: each would act by itself, and so twice on the cloth."""
    ends = np.sort(edges, axis=1)
    _, first, found = np.unique(ends, axis=0, return_index=True, return_inverse=True)
    earlier = first[found.ravel()]
    again = np.flatnonzero(earlier != np.arange(len(ends)))
    if len(again):
        k = int(again[0])
        a, b = ends[k]
        both = f"{what}s {int(earlier[k])} and {k} are both {int(a)}-{int(b)}"
        raise ValueError(f"{name}: {both}; list each {what} once")
