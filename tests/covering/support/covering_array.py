"""Pairwise covering arrays: few rows, in which any two levels of any two factors that may meet do meet.

Greedy, a row at a time, after AETG (Cohen, Dalal, Fredman, Patton 1997, "The AETG system"): of CANDIDATES rows that
are begun at random among the pairs that are not covered yet, the one that covers most of them is taken. What must not
meet is given as parts of rows; a row is filled by trying levels, best first, and taking back what leads nowhere.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from itertools import combinations

import numpy as np

Row = dict[str, str]
Pair = tuple[tuple[str, str], tuple[str, str]]
CANDIDATES = 40


class Factors:
    """`levels` of each factor by its name; `forbidden` parts of rows, of any number of factors, that no row has."""

    def __init__(self, levels: Mapping[str, Sequence[str]], forbidden: Sequence[Row]) -> None:
        """Raises ValueError for a part that names what is not there."""
        for part in forbidden:
            for factor, level in part.items():
                if level not in levels.get(factor, ()):
                    raise ValueError(f"forbidden: {factor} has no level {level!r}; it has {levels.get(factor, ())}")
        self.levels = levels
        self._names = list(levels)
        self._place = {name: k for k, name in enumerate(levels)}
        self._about = {name: [part for part in forbidden if name in part] for name in levels}

    def allows(self, row: Row, name: str) -> bool:
        """May what this factor has in the row, whole or in part, stand with the others?"""
        return not any(all(row.get(f) == level for f, level in part.items()) for part in self._about[name])

    def valid(self, row: Row) -> bool:
        """Has it one of the levels of each factor, and no forbidden part?"""
        known = all(row.get(name) in levels for name, levels in self.levels.items())
        return known and len(row) == len(self.levels) and all(self.allows(row, name) for name in row)

    @cached_property
    def pairs(self) -> frozenset[Pair]:
        """Those that some valid row has."""
        found: set[Pair] = set()
        for a, b in combinations(self._names, 2):
            for first in self.levels[a]:
                for second in self.levels[b]:
                    pair = ((a, first), (b, second))
                    if pair in found:
                        continue
                    row = self.completed({a: first, b: second}, set(), np.random.default_rng(0))
                    if row is not None:
                        found |= set(pairs_of(row, self._names))
        return frozenset(found)

    def completed(self, part: Row, wanted: set[Pair], rng: np.random.Generator) -> Row | None:
        """The part filled up to a valid row with many of the `wanted` pairs; None where no row has it."""
        if not all(self.allows(part, name) for name in part):
            return None
        order = [str(name) for name in rng.permutation(self._names) if name not in part]
        open_ = sorted(order, key=lambda name: not self._about[name])  # bound ones first: less is taken back
        row = dict(part)
        return row if self._fill(row, open_, wanted, rng) else None

    def _fill(self, row: Row, open_: list[str], wanted: set[Pair], rng: np.random.Generator) -> bool:
        if not open_:
            return True
        name, rest = open_[0], open_[1:]
        for level in self._best_first(row, name, wanted, rng):
            row[name] = level
            if self.allows(row, name) and self._fill(row, rest, wanted, rng):
                return True
            del row[name]
        return False

    def _best_first(self, row: Row, name: str, wanted: set[Pair], rng: np.random.Generator) -> list[str]:
        levels = [str(level) for level in rng.permutation(list(self.levels[name]))]
        if not wanted:
            return levels
        place = self._place[name]  # a pair is in the factors' order
        before = [item for item in row.items() if self._place[item[0]] < place]
        after = [item for item in row.items() if self._place[item[0]] > place]

        def gained(level: str) -> int:
            own = name, level
            return sum((item, own) in wanted for item in before) + sum((own, item) in wanted for item in after)

        return sorted(levels, key=gained, reverse=True)


def pairs_of(row: Row, names: Sequence[str]) -> Iterator[Pair]:
    """All pairs of a row's levels, in the order of the factors' names."""
    for a, b in combinations(names, 2):
        yield (a, row[a]), (b, row[b])


def covering_array(factors: Factors, seed: int = 0) -> list[Row]:
    """Rows that have every pair that may be had."""
    rng = np.random.default_rng(seed)
    names = list(factors.levels)
    left = set(factors.pairs)
    rows: list[Row] = []
    while left:
        waiting = sorted(left)
        best: Row | None = None
        most = 0
        for k in rng.choice(len(waiting), min(CANDIDATES, len(waiting)), replace=False):
            row = factors.completed(dict(waiting[k]), left, rng)
            gained = 0 if row is None else len(left.intersection(pairs_of(row, names)))
            if gained > most:
                best, most = row, gained
        assert best is not None
        rows.append({name: best[name] for name in names})
        left.difference_update(pairs_of(best, names))
    return rows
