"""A specification is parsed once, and never mistaken for another."""

import pytest
from pattern_measures import demo

from tryon_solver.geometry.pattern import PatternError, parse_pattern
from tryon_solver.redesign import parsed as module
from tryon_solver.redesign.parsed import KEPT, parsed


def test_it_is_parsed_once(monkeypatch):
    seen = []
    monkeypatch.setattr(module, "parse_pattern", lambda given: seen.append(given) or parse_pattern(given))
    spec = demo("tshirt")
    assert parsed(spec) is parsed(spec)
    assert len(seen) == 1
    for _ in range(KEPT):
        parsed(demo("tshirt"))
    parsed(spec)
    assert len(seen) == KEPT + 2


def test_what_is_alike_is_not_the_same():
    one, other = demo("tshirt"), demo("tshirt")
    assert parsed(one) is not parsed(other)


def test_what_is_no_pattern_is_refused_each_time():
    spec = {"pattern": {}}
    for _ in range(2):
        with pytest.raises(PatternError):
            parsed(spec)
