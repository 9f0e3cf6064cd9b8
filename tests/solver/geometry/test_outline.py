"""Claims on outlines: area with sign, inside test, distance, and the finding of self-contact."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tryon_solver.geometry import outline

ARROW = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, 0.5], [0.0, 2.0]])


def test_area_counts_counter_clockwise_positive():
    assert outline.signed_area(ARROW) == pytest.approx(4 - 1.5)
    assert outline.signed_area(ARROW[::-1]) == pytest.approx(-2.5)


def test_points_in_the_notch_of_a_concave_outline_are_outside():
    points = np.array([[1.0, 0.4], [1.0, 0.6], [0.2, 1.5], [-0.1, 0.0], [1.0, 1.9]])
    assert outline.contains(ARROW, points).tolist() == [True, False, True, False, False]


def test_inside_test_agrees_with_the_winding_number_on_a_star():
    angles = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    radii = np.where(np.arange(40) % 2, 0.4, 1.0)
    star = radii[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    points = np.random.default_rng(0).uniform(-1.1, 1.1, (500, 2))
    to = star[None] - points[:, None]
    turned = np.angle(np.exp(1j * np.diff(np.unwrap(np.arctan2(to[..., 1], to[..., 0])), axis=1, append=np.nan)))
    first, last = np.arctan2(to[:, 0, 1], to[:, 0, 0]), np.arctan2(to[:, -1, 1], to[:, -1, 0])
    turned[:, -1] = np.angle(np.exp(1j * (first - last)))
    winding = np.rint(turned.sum(axis=1) / (2 * np.pi))
    inside = outline.contains(star, points)
    assert inside.any()
    assert not inside.all()
    assert np.array_equal(inside, winding != 0)


def test_distance_is_to_the_nearest_segment_not_the_nearest_corner():
    assert outline.distance(ARROW, np.array([[1.0, -0.3], [2.4, -0.3], [1.0, 0.2]])) == pytest.approx([0.3, 0.5, 0.2])


def test_a_simple_outline_has_no_self_contact():
    assert outline.self_contact(ARROW, 1e-6) is None


@pytest.mark.parametrize(
    ("corners", "pair"),
    [
        ([[0, 0], [1, 1], [1, 0], [0, 1]], {0, 2}),  # a bow tie
        ([[0, 0], [2, 0], [2, 2], [1, 0], [0, 2]], {0, 2, 3}),  # a notch that reaches the opposite edge
        ([[0, 0], [2, 0], [1, 0], [1, 1]], {0, 1, 2}),  # an edge that runs back along the one before
    ],
)
def test_crossing_touching_and_folding_outlines_are_found(corners, pair):
    found = outline.self_contact(np.array(corners, dtype=float), 1e-6)
    assert found is not None
    assert set(found) <= pair


def meets_itself(points, tolerance):
    """Every pair of segments, one by one, by the distance of segments and by the sides that their ends lie on."""
    count = len(points)
    for i in range(count):
        for j in range(count):
            a, b, c, d = points[i], points[(i + 1) % count], points[j], points[(j + 1) % count]
            if i != j and (j + 1) % count != i and nearest(a, c, d) < tolerance:
                return True
            apart = i != j and (i + 1) % count != j and (j + 1) % count != i
            if apart and turn(a, b, c) * turn(a, b, d) < 0 and turn(c, d, a) * turn(c, d, b) < 0:
                return True
    return False


def turn(a, b, c):
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def nearest(p, a, b):
    along = (b[0] - a[0], b[1] - a[1])
    t = ((p[0] - a[0]) * along[0] + (p[1] - a[1]) * along[1]) / (along[0] ** 2 + along[1] ** 2)
    t = min(1.0, max(0.0, t))
    return math.hypot(p[0] - a[0] - t * along[0], p[1] - a[1] - t * along[1])


@given(st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), min_size=3, max_size=9, unique=True))
def test_self_contact_finds_what_looking_at_every_pair_finds(corners):
    points = np.array(corners, float)
    assert (outline.self_contact(points, 1e-6) is not None) == meets_itself(corners, 1e-6)


def test_self_contact_of_a_long_outline_is_found_in_any_block(monkeypatch):
    """The same answer however the rows are cut into blocks."""
    angle = np.linspace(0, 2 * np.pi, 300, endpoint=False)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    crossed = circle.copy()
    crossed[[200, 201]] = crossed[[201, 200]]
    for pairs in (10_000_000, 3000):
        monkeypatch.setattr(outline, "PAIRS_AT_ONCE", pairs)
        assert outline.self_contact(circle, 1e-6) is None
        first, second = outline.self_contact(crossed, 1e-6)
        assert {first, second} <= set(range(198, 204))
