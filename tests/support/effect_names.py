"""What each effect is called in Python, with what its constructor takes, and over REST, with its parameters: the table
in docs/effects.md, made of the code.

    python tests/support/effect_names.py --document docs/effects.md
"""

from __future__ import annotations

import argparse
import inspect
from collections.abc import Iterator
from pathlib import Path

from tryon_solver import scene
from tryon_solver.effect_spec import EffectSpec
from tryon_solver.effect_words.fields import Choice, Field, Rows
from tryon_solver.effect_words.table import BUILT_IN, CLINGS

BEGIN, END = "<!-- made by effect_names.py -->", "<!-- until here: names -->"
FEW = 5  # words to choose from are told


def write(page: Path) -> None:
    """Put the table into the page."""
    head, _, rest = page.read_text().partition(BEGIN)
    page.write_text(f"{head}{BEGIN}\n{table()}\n{END}{rest.partition(END)[2]}")


def table() -> str:
    """In Markdown."""
    kinds = ", ".join(f"`{kind}` `Adhesion({strength}, {work})`" for kind, (strength, work) in CLINGS.items())
    return "\n".join(("", "| in Python | by name |", "|---|---|", *rows(), "", f"Kinds of adhesion: {kinds}.", ""))


def rows() -> Iterator[str]:
    """One of each effect that a scene may list, in the order of the words; those that have none come last."""
    words = {word.home: word for word in BUILT_IN}
    homes = list(words)
    specs = [kind for _, kind in inspect.getmembers(scene, inspect.isclass) if is_effect(kind)]
    for kind in sorted(specs, key=lambda kind: homes.index(kind.module) if kind.module in words else len(homes)):
        word = words.get(kind.module)
        named = "-" if word is None else f"`{word.name}`" + (f": {fields(word.fields)}" if word.fields else "")
        yield f"| {called(kind)}{parts(kind)} | {named} |"


def is_effect(kind: type) -> bool:
    """Is it one, and not what all have in common?"""
    return issubclass(kind, EffectSpec) and kind is not EffectSpec


def called(kind: type) -> str:
    """A constructor as it is called, with its defaults."""
    given = inspect.signature(kind).parameters.values()
    told = (p.name if p.default is p.empty else f"{p.name}={p.default!r}" for p in given)
    return f"`{kind.__name__}({', '.join(told)})`"


def parts(kind: type) -> str:
    """The constructors of the classes that its parameters are made of, if any are."""
    own = [
        other
        for name, other in inspect.getmembers(scene, inspect.isclass)
        if not issubclass(other, EffectSpec)
        and other.__module__.endswith("_specs")
        and any(name in str(p.annotation) for p in inspect.signature(kind).parameters.values())
    ]
    return "".join(f", {called(other)}" for other in own)


def fields(each: tuple[Field, ...]) -> str:
    """Parameters with what they are where they are not told, and their units."""
    return ", ".join(one(field) for field in each)


def one(field: Field) -> str:
    """A list's entries in brackets."""
    if isinstance(field, Rows):
        return f"`{field.name}` of ({fields(field.fields)})"
    if isinstance(field, Choice) and len(field.of) <= FEW:
        return f"`{field.name}={field.of[0]}` (or {', '.join(f'`{word}`' for word in field.of[1:])})"
    known = "" if field.needed or field.default in ("", [], None) else f"={field.default}"
    return f"`{field.name}{known}`" + (f" {field.unit}" if field.unit else "")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--document", type=Path, required=True)
    write(parser.parse_args().document)
