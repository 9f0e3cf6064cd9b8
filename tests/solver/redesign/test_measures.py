"""Claims on a garment scaled from one body to another, held to girths that are measured on its pattern."""

import numpy as np
import pytest
from pattern_measures import outline, placed

from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.edits import ScaleGarment
from tryon_solver.redesign.plain import parse_edit, plain

BODY = {"chest": 0.88, "waist": 0.72, "hip": 0.96, "height": 1.68}
TRUNK = ("front", "back")


def girth(spec, drop: float) -> float:
    """Of the trunk so far [m] below the garment's highest point: the pieces' widths there, as they are placed."""
    pieces = [placed(spec, panel, outline(spec, panel)) for panel in TRUNK]
    total, level = 0.0, max(points[:, 1].max() for points in pieces) - drop
    for points in pieces:
        x, y = points[:, :2].T
        after = np.roll(np.arange(len(y)), -1)
        crossed = (y - level) * (y[after] - level) < 0
        share = (level - y[crossed]) / (y[after][crossed] - y[crossed])
        total += np.ptp(x[crossed] + share * (x[after][crossed] - x[crossed]))
    return total


def length(spec) -> float:
    """From the highest to the lowest point [m]."""
    heights = np.concatenate([placed(spec, panel, outline(spec, panel))[:, 1] for panel in TRUNK])
    return float(np.ptp(heights))


@pytest.mark.parametrize("drop", [0.3, 0.45, 0.6])
def test_girths_and_length_of_the_garment_grow_as_those_of_the_body(tshirt, drop):
    """From chest to hem: the wanted body is taller, so that each level lies lower by its height's factor."""
    wanted = {"chest": 0.96, "height": 1.764}
    made = apply(tshirt, ScaleGarment(made_for={"chest": 0.88, "height": 1.68}, wanted=wanted)).specification
    tall = 1.764 / 1.68
    assert girth(tshirt, drop) > 0.8
    assert girth(made, drop * tall) == pytest.approx(girth(tshirt, drop) * 0.96 / 0.88, rel=1e-4)
    assert length(made) == pytest.approx(length(tshirt) * tall, rel=1e-6)


def test_girths_alone_keep_the_length_and_a_height_alone_the_girths(tshirt):
    wider = apply(tshirt, ScaleGarment(made_for={"hip": 0.96}, wanted={"hip": 1.0})).specification
    assert length(wider) == pytest.approx(length(tshirt), rel=1e-6)
    assert girth(wider, 0.5) == pytest.approx(girth(tshirt, 0.5) / 0.96, rel=1e-4)
    taller = apply(tshirt, ScaleGarment(made_for={"height": 1.6}, wanted={"height": 1.76}))
    assert length(taller.specification) == pytest.approx(1.1 * length(tshirt), rel=1e-6)
    assert girth(taller.specification, 0.55) == pytest.approx(girth(tshirt, 0.5), rel=1e-4)
    assert taller.notes[0] == "scaled by 1.000 in width and 1.100 in height"


def test_a_grade_of_as_much_all_around_misses_each_girth_by_as_little_as_can_be(tshirt):
    """8 cm more: 9.09 % of the chest, 11.1 of the waist and 8.33 of the hip."""
    wanted = {name: BODY[name] + 0.08 for name in ("chest", "waist", "hip")}
    made_for = {name: BODY[name] for name in wanted}
    edit = ScaleGarment(made_for=made_for, wanted=wanted)
    ratios = {name: wanted[name] / made_for[name] for name in wanted}
    width, height = edit.scale
    assert height == 1.0
    missed = {name: width / ratio for name, ratio in ratios.items()}
    assert missed["hip"] * missed["waist"] == pytest.approx(1.0)
    assert max(missed.values()) < 1.015
    note = apply(tshirt, edit).notes[0]
    assert "a waist of 79.0 instead of 80.0 cm" in note
    assert "a hip of 105.3 instead of 104.0 cm" in note


def test_it_travels_as_json_and_factors_do_without_measures():
    for edit in (ScaleGarment((1.1, 0.9)), ScaleGarment(made_for={"chest": 0.9}, wanted={"chest": 1.0})):
        assert parse_edit(plain(edit)) == edit
    assert plain(ScaleGarment((1.1, 0.9))) == {"kind": "scale_garment", "factors": [1.1, 0.9]}


@pytest.mark.parametrize(
    ("fields", "place", "why"),
    [
        ({}, "factors", "not told what to scale"),
        ({"wanted": {"chest": 0.9}}, "made_for", "not told what to scale"),
        ({"factors": [1.1, 1.0], "made_for": {"chest": 0.9}, "wanted": {"chest": 1.0}}, "factors", "and measures"),
        ({"made_for": {"chest": 0.9}, "wanted": {"waist": 0.7}}, "made_for.waist", "told once"),
        ({"made_for": BODY, "wanted": {"chest": 0.9}}, "wanted.waist", "told once"),
        ({"made_for": {"chest": 0.9}, "wanted": {"chest": 90}}, "wanted.chest", "outside"),
        ({"made_for": {"bust": 0.9}, "wanted": {"bust": 0.9}}, "made_for", "no measure 'bust'"),
        ({"made_for": {}, "wanted": {}}, "made_for", "no measures"),
        ({"made_for": {"chest": 0.8, "waist": 0.8}, "wanted": {"chest": 0.8, "waist": 0.9}}, "wanted.chest", "too far"),
        ({"made_for": {"chest": 0.4}, "wanted": {"chest": 0.9}}, "wanted.chest", "a factor of 2.250"),
        ({"made_for": {"height": 0.4}, "wanted": {"height": 1.9}}, "wanted.height", "a factor of 4.750"),
    ],
)
def test_what_can_not_be_says_why(fields, place, why):
    with pytest.raises(EditError, match=why) as refused:
        parse_edit({"kind": "scale_garment", **fields})
    assert refused.value.place == place
    assert refused.value.remedy
