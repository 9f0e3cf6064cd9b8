"""Claims on edges gathered or eased by an amount, for which a piece is fanned out from its far side. A rectangle
becomes a sector of a ring: by its lengths and its area all of it is known."""

import numpy as np
import pytest
from pattern_measures import rectangle, sewn

from tryon_solver.geometry import curves, outline
from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.both_sides import apply_to_both
from tryon_solver.redesign.draft import read_draft
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.edits import Ease, Gather, Patch
from tryon_solver.redesign.fanning import Fan, derivative
from tryon_solver.redesign.history import History

WIDE, HIGH = 0.5, 0.4  # m, of the rectangle that is gathered
EXACT = 1e-8  # m, that a length may miss, which is found by bisection to 1e-9


def lengths(specification, name):
    draft = read_draft(specification)
    return [draft.length(edge) for edge in draft.pieces[name].edges]


def area(specification, name) -> float:
    """Of a piece [m^2], its edges sampled so closely that a chord's triangle is under 1e-8 of it."""
    draft = read_draft(specification)
    piece = draft.pieces[name]
    points = [curves.sample_by_arc_length(draft.curve(edge), 4000)[:-1] for edge in piece.edges]
    return abs(float(outline.signed_area(np.vstack(points))))


@pytest.fixture
def two():
    """A skirt of a rectangle, sewn to a band by its upper edge, and at its sides to another rectangle."""
    panels = {"skirt": rectangle(100 * WIDE, 100 * HIGH), "band": rectangle(50, 10), "back": rectangle(50, 40)}
    return sewn(
        panels, ("skirt", 2, "band", 0), ("skirt", 1, "back", 3), ("skirt", 3, "back", 1), ("back", 2, "band", 2)
    )


@pytest.mark.parametrize("to", [0.6, 0.8, 0.95])
def test_a_gathered_rectangle_becomes_a_sector_of_a_ring(two, to):
    """Its sides and its far edge keep their lengths, so that all other seams fit as they did: nothing follows."""
    made = apply(two, Gather("skirt", 2, to))
    low, right, top, left = lengths(made.specification, "skirt")
    assert top == pytest.approx(0.5 / to, abs=EXACT)
    assert (low, right, left) == (pytest.approx(WIDE, abs=EXACT), pytest.approx(HIGH, abs=EXACT), right)
    turn = (0.5 / to - WIDE) / HIGH
    assert area(made.specification, "skirt") == pytest.approx(WIDE * HIGH + turn * HIGH**2 / 2, rel=1e-6)
    for name in ("band", "back"):
        assert made.specification["pattern"]["panels"][name] == two["pattern"]["panels"][name]
    assert made.change == "value"
    (note,) = made.notes
    assert note == f"edge 2 of 'skirt' is {50 / to:.1f} cm long, gathered to {100 * to:g} % on edge 0 of 'band'"
    assert made.specification["pattern"]["stitches"][0][2:] == ["gather"]


@pytest.mark.parametrize(("ease", "by"), [({"by": 0.02}, 0.02), ({"by": -0.03}, -0.03), ({"percent": 4.0}, 0.02)])
def test_ease_is_so_much_more_than_the_other_side_has(two, ease, by):
    made = apply(two, Ease("skirt", 2, **ease)).specification
    low, right, top, left = lengths(made, "skirt")
    assert top == pytest.approx(0.5 + by, abs=EXACT)
    assert (low, right, left) == (pytest.approx(WIDE, abs=EXACT), pytest.approx(HIGH, abs=EXACT), right)
    assert area(made, "skirt") == pytest.approx(WIDE * HIGH + by * HIGH / 2, rel=1e-6)
    gathered = apply(two, Gather("skirt", 2, 0.7)).specification
    eased = apply(gathered, Ease("skirt", 2, **ease)).specification
    assert lengths(eased, "skirt")[2] == pytest.approx(0.5 + by, abs=EXACT)
    assert eased["pattern"]["stitches"][0][2:] == []


def test_it_is_undone_to_the_bit(two):
    edit = Gather("skirt", 2, 0.6)
    history = History(two).append(edit, apply(two, edit).specification)
    assert history.specification != two
    assert history.undo().specification == two
    again = apply(two, edit).specification
    assert again == history.specification
    assert apply(again, edit).specification == again, "it is gathered so already"


def test_curved_edges_get_the_length_too_and_what_is_sewn_beside_follows(dress):
    """The waist of the bodice of a dress on that of its skirt; its sides are oblique and change a little."""
    before = read_draft(dress)
    waist = before.length(before.edge("skirt_front", 2))
    made = apply(dress, Gather("front", 0, 0.6)).specification
    after = read_draft(made)
    ratios = [after.length(seam.first) / after.length(seam.second) for seam in after.seams]
    gathered = after.length(after.edge("front", 0)) / after.length(after.edge("skirt_front", 2))
    assert gathered == pytest.approx(1 / 0.6, rel=1e-6)
    assert after.length(after.edge("front", 0)) == pytest.approx(waist / 0.6, rel=1e-6)
    for seam, ratio in zip(before.seams, ratios):
        own = before.length(seam.first) / before.length(seam.second)
        if before.edge("front", 0) not in (seam.first, seam.second):
            assert ratio == pytest.approx(own, abs=1e-6)


def test_it_is_gathered_on_both_sides(tshirt):
    made = apply_to_both(tshirt, Gather("left_sleeve_front", 0, 0.8)).specification
    left, right = lengths(made, "left_sleeve_front"), lengths(made, "right_sleeve_front")
    assert sorted(left) == pytest.approx(sorted(right), abs=1e-4)
    assert left != pytest.approx(lengths(tshirt, "left_sleeve_front"), abs=1e-3)


def test_what_is_sewn_on_the_piece_goes_with_its_fabric(two):
    """Two thirds up and aside: turned by as much as the strip below it."""
    at = (0.15, 0.3)
    patched = apply(two, Patch("skirt", at, 0.05, 0.05)).specification
    made = apply(patched, Gather("skirt", 2, 0.6)).specification
    (name,) = set(made["pattern"]["panels"]) - set(two["pattern"]["panels"])
    on = made["pattern"]["panels"][name]["on"]
    k = (0.5 / 0.6 - WIDE) / HIGH / WIDE
    u, v = at[0] - WIDE / 2, at[1]
    place = WIDE / 2 + (1 / k + v) * np.sin(k * u), (1 / k + v) * np.cos(k * u) - 1 / k
    assert np.array(on["at"]) / 100 == pytest.approx(place, abs=1e-7)
    assert on["turn"] == pytest.approx(-np.degrees(k * u), abs=1e-5)


@pytest.mark.parametrize("k", [0.0, 1e-9, 1.3, -0.9])
def test_the_differential_is_that_of_the_map(k):
    fan = Fan(np.array([0.1, -0.2]), np.array([0.6, 0.8]), np.array([-0.8, 0.6]), k)
    points, vectors = np.random.default_rng(3).normal(scale=0.3, size=(2, 8, 2))
    step = 1e-6
    difference = (fan.moved(points + step * vectors) - fan.moved(points - step * vectors)) / (2 * step)
    assert np.abs(difference).max() > 0.1
    assert fan.carried(points, vectors) == pytest.approx(difference, abs=1e-8)


def test_a_curve_s_derivative_is_that_of_its_points():
    controls = np.array([[0.0, 0.0], [0.2, 0.3], [0.5, -0.1], [0.6, 0.2]])
    t, step = np.linspace(0.1, 0.9, 5), 1e-6
    curve = curves.Bezier(controls)
    difference = (curve.points(t + step) - curve.points(t - step)) / (2 * step)
    assert derivative(controls, t) == pytest.approx(difference, abs=1e-8)


@pytest.mark.parametrize(
    ("edit", "place", "why"),
    [
        (Gather("band", 2, 0.25), "edge", "turn back on itself"),
        (Ease("skirt", 2, by=0.01, percent=2.0), "percent", "twice"),
        (Ease("skirt", 2, by=-0.6), "by", "only 0.500 m long"),
        (Gather("skirt", 0, 0.6), "edge", "not sewn"),
    ],
)
def test_what_can_not_be_is_refused(two, edit, place, why):
    with pytest.raises(EditError, match=why) as refused:
        apply(two, edit)
    assert refused.value.place == place
    assert refused.value.remedy


@pytest.mark.parametrize("fields", [{"to": 0.2}, {"to": 1.2}, {"to": True}, {"to": float("nan")}])
def test_an_amount_is_a_share_from_a_quarter_to_all(fields):
    with pytest.raises(EditError):
        Gather("skirt", 2, **fields)


def test_of_a_dart_no_side_is_gathered():
    """Both sides are of one piece."""
    spec = sewn({"a": rectangle(40, 40)}, ("a", 1, "a", 3))
    with pytest.raises(EditError, match="both sides"):
        apply(spec, Gather("a", 1, 0.8))
