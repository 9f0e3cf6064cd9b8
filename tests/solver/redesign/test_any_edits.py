"""Claims on any edits in any order: each makes a garment that can be read, or is refused as an edit, and can be undone.

What is drawn here is mostly possible, else nearly all would be refused and nothing tried: one test counts that.
"""

import json
from copy import deepcopy

import pytest
from any_edit import any_edit
from hypothesis import given, settings
from hypothesis import strategies as st
from pattern_measures import area, demo, seam_ratios, seams, two_squares, vertices

from tryon_solver.geometry.pattern import parse_pattern
from tryon_solver.redesign import edits
from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.both_sides import apply_to_both
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.history import History
from tryon_solver.redesign.mirroring import mirrored
from tryon_solver.redesign.plain import parse_edit, plain

DEMO = ("tshirt", "dress", "skirt", "trousers")
GARMENTS = {**{name: demo(name) for name in DEMO}, "tube": two_squares()}
MOVES = st.tuples(st.floats(-0.04, 0.04), st.floats(-0.04, 0.04))


class Drawn:
    """The chance of any_edit, as hypothesis has it."""

    def __init__(self, draw):
        self._draw = draw

    def one_of(self, items):
        return self._draw(st.sampled_from(items))

    def whole(self, least, most):
        return self._draw(st.integers(least, most))

    def real(self, least, most):
        return self._draw(st.floats(least, most))


@st.composite
def an_edit(draw, spec, kind=None):
    """An edit of something that the garment has, or nearly: indices run one past the end."""
    return any_edit(Drawn(draw), spec, kind)


def connectivity(spec):
    """All that a value edit keeps: the fabric, pieces, how many vertices each has, its edges' ends, the seams; and of
    what lies on a piece its place and its own shape, by which its stitches find theirs."""
    panels = spec["pattern"]["panels"]
    ends = {name: [edge["endpoints"] for edge in panel["edges"]] for name, panel in panels.items()}
    counts = {name: len(panel["vertices"]) for name, panel in panels.items()}
    pattern = parse_pattern(spec)
    laid = [
        (str(patch), *(panels[pattern.panels[patch.panel].name][what] for what in ("vertices", "edges")))
        for patch in pattern.patches
    ]
    return spec["properties"].get("fabric"), counts, ends, seams(spec), laid


@settings(max_examples=40)
@given(st.sampled_from(sorted(GARMENTS)), st.data())
def test_every_sequence_of_edits_makes_garments_or_is_refused_and_can_be_undone(name, data):
    first = deepcopy(GARMENTS[name])
    history = History(deepcopy(first))
    passed = [deepcopy(first)]
    for _ in range(5):
        now = history.specification
        edit = data.draw(an_edit(now))
        assert parse_edit(json.loads(json.dumps(plain(edit)))) == edit
        do = data.draw(st.sampled_from([apply, apply_to_both]))
        try:
            made = do(now, edit)
        except EditError as error:
            refused = error
        else:
            refused = None
        assert now == passed[-1], "done or refused, it changes nothing of what was"
        if refused is not None:
            assert all((refused.message, refused.place, refused.remedy))
            continue
        parse_pattern(json.loads(json.dumps(made.specification, allow_nan=False)))
        assert (connectivity(now) == connectivity(made.specification)) == (made.change == "value")
        history = history.append(edit, made.specification)
        passed.append(deepcopy(made.specification))
    for wanted in passed[-2::-1]:
        history = history.undo()
        assert history.specification == wanted
    assert history.specification == first


@settings(max_examples=60)
@given(st.sampled_from(sorted(GARMENTS)), st.data())
def test_seams_that_do_not_keep_their_ratio_are_told(name, data):
    spec = GARMENTS[name]
    edit = data.draw(an_edit(spec).filter(lambda e: e.kind in ("move_vertex", "move_handle", "lengthen", "take_in")))
    try:
        made = apply(spec, edit)
    except EditError:
        return
    old, new = seam_ratios(spec), seam_ratios(made.specification)
    told = sum("cm long and" in note for note in made.notes)
    changed = [abs(now / before - 1) for now, before in zip(new, old)]
    assert sum(change > 0.02 for change in changed) <= told <= sum(change > 1e-4 for change in changed)


@settings(max_examples=40)
@given(st.sampled_from(DEMO), st.data())
def test_an_edit_and_its_image_do_the_same_to_the_areas(name, data):
    spec = GARMENTS[name]
    edit = data.draw(an_edit(spec))
    try:
        image = mirrored(spec, edit).edit
        here = apply(spec, edit)
    except EditError:
        return
    if image is None:
        return
    there = apply(spec, image)
    made = here.specification, there.specification
    total = [sum(area(one, panel) for panel in one["pattern"]["panels"]) for one in made]
    assert total[0] == pytest.approx(total[1], abs=1e-6)
    assert here.change == there.change


@pytest.mark.parametrize("kind", edits.KINDS.values(), ids=lambda kind: kind.kind)
def test_of_every_kind_some_that_are_drawn_can_be_done(kind):
    done = 0

    @settings(max_examples=25, database=None)
    @given(st.sampled_from(sorted(GARMENTS)), st.data())
    def count(name, data):
        nonlocal done
        edit = data.draw(an_edit(GARMENTS[name], kind))
        try:
            apply(GARMENTS[name], edit)
            done += 1
        except EditError:
            pass

    count()
    assert done >= 2


@settings(max_examples=20)
@given(st.sampled_from(["front", "back"]), st.integers(0, 8), MOVES)
def test_moving_a_vertex_back_brings_its_own_piece_back(panel, vertex, by):
    spec = GARMENTS["tshirt"]
    there = apply(spec, edits.MoveVertex(panel, vertex, by)).specification
    back = apply(there, edits.MoveVertex(panel, vertex, (-by[0], -by[1]))).specification
    assert vertices(back, panel) == pytest.approx(vertices(spec, panel), abs=1e-12)
