"""Claims on outlines: area with sign, inside test, distance, and the finding of self-contact."""

import numpy as np
import pytest

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
