"""Claims on filling one outline: exact cover, kept outline, well-shaped triangles, awkward outlines, determinism."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tryon_solver.geometry import outline
from tryon_solver.geometry import triangulate as triangulation
from tryon_solver.geometry.constrained import TriangulationError
from tryon_solver.geometry.triangulate import corner_angles, signed_areas, split_edges, triangulate


def sampled(corners, step):
    """The polygon with each side cut into pieces of about the step, in the same order."""
    corners = np.asarray(corners, dtype=float)
    sides = []
    for start, end in zip(corners, np.roll(corners, -1, axis=0)):
        count = max(1, round(np.hypot(*(end - start)) / step))
        sides.append(start + (end - start) * np.arange(count)[:, None] / count)
    return np.vstack(sides)


def assert_fills(boundary, points, faces):
    """The faces turn counter-clockwise, cover the outline exactly and use each of its segments once and every point."""
    assert np.array_equal(points[: len(boundary)], boundary)
    areas = signed_areas(points, faces)
    assert areas.min() > 0
    assert areas.sum() == pytest.approx(outline.signed_area(boundary), rel=1e-9)
    assert np.array_equal(np.unique(faces), np.arange(len(points)))
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    pairs, uses = np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)
    assert uses.max() <= 2
    ids = np.arange(len(boundary))
    segments = np.sort(np.stack([ids, np.roll(ids, -1)], axis=1), axis=1)
    assert np.array_equal(pairs[uses == 1], np.unique(segments, axis=0))


def dart(width):
    return [[0, 0], [0.2, 0], [0.2 + width / 2, 0.2], [0.2 + width, 0], [0.4, 0], [0.4, 0.3], [0, 0.3]]


def comb(teeth):
    """A bar with teeth 4 mm wide and 28 cm long."""
    points = [[0, -0.01], [0.1 * teeth, -0.01]]
    for tooth in reversed(range(teeth)):
        x = 0.1 * tooth
        points += [[x + 0.05, 0.02], [x + 0.05, 0.3], [x + 0.046, 0.3], [x + 0.046, 0.02]]
    return [*points, [0, 0.02]]


OUTLINES = {
    "square": [[0, 0], [0.4, 0], [0.4, 0.4], [0, 0.4]],
    "concave": [[0, 0], [0.4, 0], [0.4, 0.4], [0.2, 0.1], [0, 0.4]],
    "dart": dart(0.04),
    "slit": dart(0.002),
    "strip narrower than the edges": [[0, 0], [0.5, 0], [0.5, 0.005], [0, 0.005]],
    "comb": comb(4),
}


@pytest.mark.parametrize("edge_length", [0.008, 0.02, 0.3])
@pytest.mark.parametrize("name", OUTLINES)
def test_awkward_outlines_are_filled_exactly(name, edge_length):
    boundary = sampled(OUTLINES[name], edge_length)
    points, faces = triangulate(boundary, edge_length)
    assert_fills(boundary, points, faces)


@pytest.mark.parametrize("name", OUTLINES)
def test_what_is_inside_at_a_glance_is_what_a_search_finds(name, monkeypatch):
    """Where a glance does not tell, the search is made."""
    boundary = sampled(OUTLINES[name], 0.02)
    looks = []

    def look(points, faces, count, sides):
        ids = np.arange(count, dtype=np.int32)
        glance = at_a_glance(points, faces, count, sides)
        looks.append((glance, triangulation._inside(points, faces, np.stack([ids, np.roll(ids, -1)], axis=1))))
        return glance

    at_a_glance = triangulation._inside_at_a_glance
    monkeypatch.setattr(triangulation, "_inside_at_a_glance", look)
    triangulate(boundary, 0.02)
    told = [(glance, found) for glance, found in looks if glance is not None]
    assert told or name == "strip narrower than the edges"
    for glance, found in told:
        np.testing.assert_array_equal(glance, found)


@given(
    st.lists(st.tuples(st.floats(-0.3, 0.3), st.floats(0.15, 0.6)), min_size=3, max_size=9),
    st.sampled_from([0.02, 0.05]),
)
@settings(max_examples=30, deadline=None)
def test_angles_exceed_20_degrees_unless_a_corner_is_sharper(spokes, edge_length):
    angles = (np.arange(len(spokes)) + [a for a, _ in spokes]) * 2 * np.pi / len(spokes)
    corners = np.array([r for _, r in spokes])[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    before, after = corners - np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0) - corners
    cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    inner_angles = 180 - np.degrees(np.arctan2(cross, np.sum(before * after, axis=1)))
    boundary = sampled(corners, edge_length)
    points, faces = triangulate(boundary, edge_length)
    assert_fills(boundary, points, faces)
    # A sharp corner's own triangle has its angle; the next ones share the shortage of room.
    assert corner_angles(points, faces).min() > min(20.0, 0.6 * inner_angles.min())


def test_the_count_of_vertices_follows_from_the_area():
    boundary = sampled(OUTLINES["concave"], 0.01)
    points, _ = triangulate(boundary, 0.01)
    # An inner vertex of an equilateral mesh owns e^2 sqrt(3)/2, one on the outline half of that.
    expected = outline.signed_area(boundary) / (0.01**2 * np.sqrt(3) / 2) + len(boundary) / 2
    assert len(points) == pytest.approx(expected, rel=0.05)


def test_two_runs_give_the_same_bytes():
    boundary = sampled(OUTLINES["dart"], 0.015)
    first, second = triangulate(boundary, 0.015), triangulate(boundary, 0.015)
    assert first[0].tobytes() == second[0].tobytes()
    assert first[1].tobytes() == second[1].tobytes()


def test_an_outline_through_its_own_vertex_is_refused():
    touching = np.array([[0, 0], [0.4, 0], [0.4, 0.4], [0.2, 0], [0, 0.4]])
    with pytest.raises(TriangulationError):
        triangulate(touching, 0.4)


def test_splitting_an_inner_edge_leaves_no_such_edge():
    boundary = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=float)
    faces = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)
    points, faces = split_edges(boundary, faces, np.array([[0, 2]], dtype=np.int32), 4)
    assert_fills(boundary, points, faces)
    assert len(points) == 5
    assert corner_angles(points, faces).min() == pytest.approx(45)
