"""Claims on a piece moved by its outline: it stays at rest, goes along any affine map, and never overshoots."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tryon_solver.geometry.cage import build_cage, mean_value_weights
from tryon_solver.geometry.triangulate import signed_areas, triangulate

EDGE = 0.03  # m
CORNERS = {
    "square": [(0, 0), (0.4, 0), (0.4, 0.4), (0, 0.4)],
    "angle": [(0, 0), (0.5, 0), (0.5, 0.15), (0.15, 0.15), (0.15, 0.5), (0, 0.5)],
    "star": [(0.3 * r * np.cos(a), 0.3 * r * np.sin(a)) for a, r in zip(np.arange(10) * np.pi / 5, [1, 0.45] * 5)],
}


def outlined(corners):
    """The outline through the corners, its sides cut into parts of about EDGE."""
    points = []
    for start, end in zip(np.array(corners), np.roll(corners, -1, axis=0)):
        count = max(1, round(np.hypot(*(end - start)) / EDGE))
        points.append(start + np.linspace(0, 1, count, endpoint=False)[:, None] * (end - start))
    return np.vstack(points)


def piece(name):
    """Points, faces and how many points are the outline's."""
    boundary = outlined(CORNERS[name])
    return *triangulate(boundary, EDGE), len(boundary)


PIECES = {name: piece(name) for name in CORNERS}
NAMED = pytest.mark.parametrize("name", sorted(CORNERS))


@NAMED
def test_weights_of_inner_vertices_are_positive_and_hold_them_at_rest(name):
    points, faces, count = PIECES[name]
    weights = mean_value_weights(points, faces)
    assert weights.data.min() > 0
    inner = weights[count:]
    assert inner.shape[0] > 20
    assert np.abs(inner @ points / inner.sum(axis=1)[:, None] - points[count:]).max() < 1e-14


def test_weights_are_those_of_the_formula():
    points = np.array([[0.0, 0.0], [1.0, 0.0], [0.2, 0.9], [-0.7, 0.3], [0.1, -1.3]])
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]])
    weights = mean_value_weights(points, faces)
    around = points[1:] @ [1, 1j]
    angles = np.angle(np.roll(around, -1) / around) % (2 * np.pi)
    wanted = (np.tan(angles / 2) + np.tan(np.roll(angles, 1) / 2)) / np.abs(around)
    assert weights[[0], 1:].toarray()[0] == pytest.approx(wanted, rel=1e-13)


@NAMED
def test_at_rest_it_is_as_it_was_to_the_last_bit(name):
    points, faces, count = PIECES[name]
    assert np.array_equal(build_cage(points, faces, count).moved(points[:count]), points)


@NAMED
@settings(max_examples=20)
@given(matrix=st.tuples(*[st.floats(-2, 2)] * 4), by=st.tuples(*[st.floats(-3, 3)] * 2))
def test_an_affine_map_of_the_outline_is_one_of_the_whole_piece(name, matrix, by):
    points, faces, count = PIECES[name]
    wanted = points @ np.reshape(matrix, (2, 2)) + by
    assert np.abs(build_cage(points, faces, count).moved(wanted[:count]) - wanted).max() < 1e-13


@NAMED
def test_the_outline_goes_exactly_where_it_is_put_and_no_vertex_further_than_it(name):
    points, faces, count = PIECES[name]
    rng = np.random.default_rng(5)
    by = rng.uniform(-0.02, 0.03, (count, 2))
    moved = build_cage(points, faces, count).moved(points[:count] + by)
    assert np.array_equal(moved[:count], points[:count] + by)
    inside = moved[count:] - points[count:]
    assert (inside > by.min(axis=0)).all()
    assert (inside < by.max(axis=0)).all()
    assert np.ptp(inside) > 1e-3


@NAMED
def test_inner_vertices_that_are_to_stay_do_and_the_others_go_between(name):
    points, faces, count = PIECES[name]
    middle = count + np.argsort(np.linalg.norm(points[count:] - points[:count].mean(axis=0), axis=1))[:3]
    still = [0, *middle]  # of the outline nothing stays by being told to
    cage = build_cage(points, faces, count, still)
    moved = cage.moved(points[:count] + [0.02, 0.0])
    np.testing.assert_array_equal(moved[middle], points[middle])
    np.testing.assert_array_equal(moved[:count], points[:count] + [0.02, 0.0])
    others = np.setdiff1d(np.arange(count, len(points)), middle)
    way = moved[others] - points[others]
    assert ((way[:, 0] > 0) & (way[:, 0] < 0.02)).all()
    assert np.abs(way[:, 1]).max() < 1e-15
    weights = mean_value_weights(points, faces)[others]
    means = weights @ (moved - points) / weights.sum(axis=1)[:, None]
    np.testing.assert_allclose(means, way, atol=1e-15)


def test_a_square_drawn_onto_any_convex_outline_keeps_all_its_triangles_upright():
    points, faces, count = PIECES["square"]
    square = np.array(CORNERS["square"])
    at = np.concatenate([np.linspace(0, 2 * np.pi, count, endpoint=False)])
    assert count == len(outlined(square))
    for width, height in ((1.0, 1.0), (0.3, 1.4), (2.0, 0.05)):
        ellipse = np.stack([width * np.cos(at), height * np.sin(at)], axis=1)
        assert signed_areas(build_cage(points, faces, count).moved(ellipse), faces).min() > 0


def test_a_piece_without_inner_vertices_is_its_outline():
    points = np.array([[0.0, 0.0], [0.1, 0.0], [0.1, 0.02], [0.0, 0.02]])
    cage = build_cage(points, np.array([[0, 1, 2], [0, 2, 3]], np.int32), 4)
    assert np.array_equal(cage.moved(2 * points), 2 * points)
