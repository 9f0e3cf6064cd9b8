"""Effects that installed packages bring into the catalogue, without a change of this one: by entry points.

A package names, in the group `tryon.effects`, an EffectWord that says which module the effect is in:

    [project.entry-points."tryon.effects"]
    hem_weights = "hem_weights_word:WORD"

Every process finds it there: the server that checks what is asked for, and the sessions' own that bind it. The word's
module should be as light as this package; it may import `fields` and `word` of it, not `table`, which is being made
while it is loaded. The effect's own is imported where a scene lists it.
"""

from __future__ import annotations

from collections.abc import Set
from importlib.metadata import EntryPoint, entry_points

from tryon_solver.effect_words.word import EffectWord

GROUP = "tryon.effects"


class OutsideError(RuntimeError):
    """An entry point brings no effect that can be had; the message names it, and says what to change."""


def words_from_outside(known: Set[str]) -> tuple[EffectWord, ...]:
    """The words of all installed packages, by the names of their entry points; none may be of a `known` effect.

    Raises OutsideError.
    """
    found: dict[str, EffectWord] = {}
    for point in sorted(entry_points(group=GROUP), key=lambda point: (point.name, point.value)):
        word = _loaded(point)
        if word.name in known or word.name in found:
            raise _fault(point, f"there is an effect {word.name!r} already", "Give it another name")
        found[word.name] = word
    return tuple(found.values())


def _loaded(point: EntryPoint) -> EffectWord:
    try:
        word = point.load()
    except Exception as error:
        raise _fault(point, f"can't be loaded: {error!r:.300}", "Mend its package, or uninstall it") from error
    if not isinstance(word, EffectWord):
        raise _fault(point, f"is of type {type(word).__name__}, not EffectWord", "Name an EffectWord there")
    if not word.module:
        raise _fault(point, f"says no module of {word.name!r}", "Tell its word the module that has `spec` and `bind`")
    return word


def _fault(point: EntryPoint, what: str, remedy: str) -> OutsideError:
    return OutsideError(f"entry point {point.name} = {point.value!r} of {GROUP}: {what}. {remedy}")
