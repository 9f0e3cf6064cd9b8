"""What an effect is called, and which parameters it takes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from tryon_solver.effect_words.fields import Field, checked


@dataclass(frozen=True)
class EffectWord:
    """An effect by name: a `title` and what it is `about`, for people, and its parameters. `kept`: it can't be taken
    off, since what frames promise rests on it. `takes_place_of` names what is left out while it is active. `lined`: it
    acts on the lines and spots that its lists name, and is nothing without one.

    `module` is where its `bind` and kernels are, of its name among the solver's own unless it is told. One from outside
    (outside.py) has there, besides, `spec(parameters, cut)`, what a scene lists for it, and, where fields are `live`,
    `values(parameters, cut)`, the values of its contribution by name."""

    name: str
    title: str
    about: str
    fields: tuple[Field, ...] = ()
    kept: bool = False
    takes_place_of: tuple[str, ...] = ()
    lined: bool = False
    module: str = ""

    @property
    def home(self) -> str:
        """The module that a scene imports for it."""
        return self.module or f"tryon_solver.effects.{self.name}"

    @property
    def changes_live(self) -> bool:
        """May a running scene be told any of its parameters?"""
        return any(field.live for field in self.fields)

    def parameters(self, given: Any = None) -> dict[str, Any]:
        """All of its parameters, plain JSON, those that are not given by default. Raises EffectError."""
        return checked(self.fields, {} if given is None else given, "parameters")

    def described(self) -> dict[str, Any]:
        """The word as plain JSON."""
        fields = [field.described() for field in self.fields]
        told = {"name": self.name, "title": self.title, "about": self.about, "kept": self.kept, "lined": self.lined}
        return {**told, "fields": fields}
