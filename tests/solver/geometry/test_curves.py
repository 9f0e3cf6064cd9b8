"""Claims on curves: closed forms of length and position, the four arcs of the flags, samples at equal arc length."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tryon_solver.geometry import curves

COORDINATES = st.floats(-1.0, 1.0, allow_nan=False).map(lambda v: round(v, 3))


def test_a_line_has_its_end_points_distance_as_length():
    line = curves.line([0.1, 0.2], [0.4, 0.6])
    assert curves.length(line) == pytest.approx(0.5, abs=1e-12)
    assert curves.is_straight(line)


def test_a_quadratic_curve_has_the_length_of_its_parabola():
    # y = x^2 on [0, 1] has the control points (0,0), (1/2,0), (1,1) and the length sqrt(5)/2 + asinh(2)/4.
    parabola = curves.Bezier(np.array([[0.0, 0.0], [0.5, 0.0], [1.0, 1.0]]))
    assert curves.length(parabola) == pytest.approx(np.sqrt(5) / 2 + np.arcsinh(2) / 4, abs=1e-12)
    t = np.linspace(0, 1, 7)
    assert np.allclose(parabola.points(t), np.stack([t, t**2], axis=1), atol=1e-15)


def test_relative_control_points_are_measured_along_and_left_of_the_edge():
    # The edge runs up from (1, 1) to (1, 3); half way along it and a quarter to its left is (1 - 0.5, 2).
    quadratic = curves.relative_bezier([1, 1], [1, 3], [[0.5, 0.25]])
    assert np.allclose(quadratic.controls[1], [0.5, 2.0])
    cubic = curves.relative_bezier([0, 0], [2, 0], [[0.25, 0.5], [0.75, -0.5]])
    assert np.allclose(cubic.controls, [[0, 0], [0.5, 1.0], [1.5, -1.0], [2, 0]])


# On the unit circle through (1, 0) and (0, 1) the small arcs turn by 90 degrees and the large ones by 270. The circle
# left of the chord is centred at the origin, the one right of it at (1, 1).
@pytest.mark.parametrize(
    ("large", "counter_clockwise", "centre", "turn"),
    [
        (False, True, (0, 0), np.pi / 2),
        (True, False, (0, 0), -3 * np.pi / 2),
        (True, True, (1, 1), 3 * np.pi / 2),
        (False, False, (1, 1), -np.pi / 2),
    ],
)
def test_the_flags_choose_among_four_arcs(large, counter_clockwise, centre, turn):
    arc = curves.arc_by_flags([1, 0], [0, 1], 1.0, large, counter_clockwise)
    assert np.allclose(arc.centre, centre, atol=1e-12)
    assert arc.sweep_angle == pytest.approx(turn, abs=1e-12)
    assert curves.length(arc) == pytest.approx(abs(turn), abs=1e-12)
    assert np.allclose(arc.points([0.0, 1.0]), [[1, 0], [0, 1]], atol=1e-12)


def test_a_half_circle_whose_radius_was_rounded_down_is_read():
    arc = curves.arc_by_flags([0, 0], [2, 0], 1.0 - 5e-5, False, False)
    assert curves.length(arc) == pytest.approx(np.pi, abs=1e-9)
    assert arc.points([0.5])[0] == pytest.approx([1, 1])


def test_an_arc_too_small_for_its_chord_is_refused():
    with pytest.raises(ValueError, match="points 2 m apart"):
        curves.arc_by_flags([0, 0], [2, 0], 0.9, False, True)


@settings(deadline=None)
@given(st.lists(st.tuples(COORDINATES, COORDINATES), min_size=4, max_size=4), st.integers(1, 12))
def test_samples_divide_a_cubic_into_equal_lengths(controls, segments):
    if controls[0] == controls[-1]:
        controls[-1] = (controls[-1][0] + 0.5, controls[-1][1])
    curve = curves.Bezier(np.array(controls, dtype=float))
    points = curves.sample_by_arc_length(curve, segments)
    assert np.array_equal(points[0], controls[0])
    assert np.array_equal(points[-1], controls[-1])
    # The vertices of a fine polygon, numbered by the length travelled, must lie where the samples lie.
    t = np.linspace(0, 1, 20001)
    fine = curve.points(t)
    travelled = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(fine, axis=0), axis=1))])
    expected = curve.points(np.interp(np.linspace(0, travelled[-1], segments + 1), travelled, t))
    # A cubic can stand still (a cusp); around it the length travelled, hence the sample, is off by the piece there.
    tolerance = 2 * travelled[-1] / curves.TABLE_PIECES
    assert np.linalg.norm(points - expected, axis=1).max() < tolerance


HALF_CIRCLE = curves.arc_by_flags([0, 0], [2, 0], 1.0, False, True)  # below its chord, from the left end to the right
PARABOLA = curves.Bezier(np.array([[0.0, 0.0], [0.5, 0.0], [1.0, 1.0]]))  # y = x^2, x = t


def test_the_share_of_an_arcs_length_is_that_of_its_angle():
    assert curves.parameter_at(HALF_CIRCLE, 0.25) == pytest.approx(0.25, abs=1e-9)
    assert curves.share_at(HALF_CIRCLE, 0.8) == pytest.approx(0.8, abs=1e-9)


def test_the_share_of_a_parabolas_length_is_its_closed_form():
    def length(x):
        return (2 * x * np.sqrt(1 + 4 * x**2) + np.arcsinh(2 * x)) / 4

    share = length(0.3) / length(1.0)
    assert share < 0.25, "it is slower at its start"
    assert curves.share_at(PARABOLA, 0.3) == pytest.approx(share, abs=1e-6)
    assert curves.parameter_at(PARABOLA, share) == pytest.approx(0.3, abs=1e-6)


def test_tangents_at_the_ends_have_the_curves_direction():
    assert np.allclose(curves.end_tangents(PARABOLA), [[1, 0], np.array([1, 2]) / np.sqrt(5)])
    assert np.allclose(curves.end_tangents(HALF_CIRCLE), [[0, -1], [0, 1]], atol=1e-12)
    other_way = curves.arc_by_flags([0, 0], [2, 0], 1.0, False, False)
    assert np.allclose(curves.end_tangents(other_way), [[0, 1], [0, -1]], atol=1e-12)


def test_a_control_point_on_an_end_leaves_the_direction_to_the_next():
    curve = curves.Bezier(np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 1.0], [2.0, 1.0]]))
    assert np.allclose(curves.end_tangents(curve), [[np.sqrt(0.5), np.sqrt(0.5)], [1, 0]])


def test_a_curve_is_the_same_as_one_drawn_alike_and_no_other():
    def drawn():
        """Curves between two points: of each kind one, and neighbours that differ in one number."""
        ends = [0.0, 0.0], [0.2, 0.1]
        yield curves.line(*ends)
        yield curves.line(ends[0], [0.2, np.nextafter(0.1, 1)])
        yield curves.relative_bezier(*ends, [(0.5, 0.1)])
        yield curves.relative_bezier(*ends, [(0.5, 0.2)])
        yield curves.relative_bezier(*ends, [(0.3, 0.1), (0.6, 0.1)])
        arc = curves.arc_by_flags(*ends, 0.2, False, True)
        yield arc
        for name in ("centre", "radius", "start_angle", "sweep_angle"):
            yield replace(arc, **{name: getattr(arc, name) + 1e-3})

    for i, one in enumerate(drawn()):
        assert [curves.same(one, other) for other in drawn()] == [i == k for k in range(10)]
