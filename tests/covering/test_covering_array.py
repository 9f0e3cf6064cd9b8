"""The array covers every pair that may be, and nothing that must not be."""

from itertools import combinations, product

import pytest
from covering_array import Factors, covering_array, pairs_of
from covering_page import is_effect
from effect_factors import FACTORS, LEVELS, forbidden, rows

FEW = {"a": ("1", "2", "3"), "b": ("1", "2"), "c": ("1", "2"), "d": ("1", "2", "3")}


def by_trying_all(levels, parts):
    """All pairs of all rows without a forbidden part."""
    found = set()
    for chosen in product(*levels.values()):
        row = dict(zip(levels, chosen))
        if not any(part.items() <= row.items() for part in parts):
            found |= set(pairs_of(row, list(levels)))
    return found


@pytest.mark.parametrize(
    "parts", [[], [{"a": "1", "b": "2"}], [{"a": "1", "b": "1"}, {"a": "1", "c": "1"}, {"b": "2", "c": "2", "d": "3"}]]
)
def test_small_array_covers_what_trying_all_rows_finds(parts):
    factors = Factors(FEW, parts)
    wanted = by_trying_all(FEW, parts)
    assert factors.pairs == wanted
    array = covering_array(factors)
    assert {pair for row in array for pair in pairs_of(row, list(FEW))} == wanted
    assert len(array) < 18
    assert all(factors.valid(row) for row in array)


def test_every_pair_of_variants_meets_in_a_scene():
    """Forbidden pairs apart, and those that forbidden parts leave no row for: each is named."""
    array = rows()
    covered = {pair for row in array for pair in pairs_of(row, list(LEVELS))}
    every = {
        ((a, first), (b, second)) for a, b in combinations(LEVELS, 2) for first in LEVELS[a] for second in LEVELS[b]
    }
    assert covered == FACTORS.pairs
    missing = every - covered
    said = {frozenset(part.items()) for part in forbidden() if len(part) == 2}
    worn = {("cloth", "tshirt"), ("cloth", "skirt")}
    implied = {frozenset({cloth, ("body contact", "off")}) for cloth in worn}
    implied |= {frozenset({cloth, ("body", body)}) for cloth in worn for body in LEVELS["body"][:3]}
    implied |= {frozenset({("pressure", "gas"), ("body", "person")})}  # what is worn shuts no air in
    assert {frozenset(pair) for pair in missing} == said | implied
    assert all(FACTORS.valid(row) for row in array)
    assert len(array) < 40


def test_every_effect_is_in_a_scene():
    """A new effect needs a factor here."""
    import covered_scene

    from tryon_solver import scene

    kinds = {
        name
        for name, kind in vars(scene).items()
        if isinstance(kind, type) and issubclass(kind, scene.EffectSpec) and kind is not scene.EffectSpec
    }
    assert len(kinds) > 15
    assert kinds <= set(vars(covered_scene))
    assert is_effect("friction", "fabric")
    assert not is_effect("stretch", "fabric")


def test_a_factor_refuses_a_part_it_does_not_know():
    with pytest.raises(ValueError, match="a has no level '4'"):
        Factors(FEW, [{"a": "4"}])
