"""A specification is parsed once, and never mistaken for another."""

import pytest
from pattern_measures import demo

from tryon_solver.geometry.pattern import PatternError, parse_pattern
from tryon_solver.redesign import parsed as module
from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.edits import Lengthen
from tryon_solver.redesign.history import History
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


def test_what_an_edit_made_is_parsed_once_though_the_history_holds_it_in_other_words(monkeypatch):
    seen, history = [], History(demo("tshirt"))
    monkeypatch.setattr(module, "parse_pattern", lambda given: seen.append(given) or parse_pattern(given))
    for number in range(1, 4):
        edit = Lengthen("front", 0, 0.01)
        made = apply(history.specification, edit).specification
        history = history.append(edit, made)
        assert history.specification is not made
        assert parsed(history.specification) is parsed(made)
        assert len(seen) == 1 + number, "and what it began with"


def test_what_is_alike_is_not_the_same():
    one, other = demo("tshirt"), demo("tshirt")
    assert parsed(one) is not parsed(other)


def test_what_is_no_pattern_is_refused_each_time():
    spec = {"pattern": {}}
    for _ in range(2):
        with pytest.raises(PatternError):
            parsed(spec)
