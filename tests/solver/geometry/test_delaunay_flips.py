"""A triangulation kept by flips is the one that is found from scratch."""

import numpy as np
import pytest
from scipy.spatial import Delaunay

from tryon_solver.geometry.delaunay_flips import KeptDelaunay
from tryon_solver.geometry.triangulate import signed_areas


def as_set(faces):
    """Triangles, whatever the order and the first corner."""
    return {tuple(sorted(face)) for face in faces.tolist()}


def in_a_circle(count, rng):
    """Points of which the first 40 go around a circle; their triangles."""
    angle = 2 * np.pi * np.arange(40) / 40
    points = np.vstack([np.stack([np.cos(angle), np.sin(angle)], axis=1), rng.uniform(-0.6, 0.6, (count, 2))])
    return points, Delaunay(points).simplices.astype(np.int32)


@pytest.mark.parametrize("seed", range(5))
def test_moved_points_have_the_triangles_that_are_found_from_scratch(seed):
    rng = np.random.default_rng(seed)
    points, faces = in_a_circle(400, rng)
    kept = KeptDelaunay(faces)
    changed = 0
    for _ in range(10):
        way = np.zeros_like(points)
        way[40:] = rng.normal(0.0, 0.01, (400, 2))
        while (signed_areas(points + way, kept.faces) <= 0).any():
            turned = kept.faces[signed_areas(points + way, kept.faces) <= 0]
            way[turned] = 0.0
        points = points + way
        before = as_set(kept.faces)
        kept.restore(points)
        changed += len(before - as_set(kept.faces))
        assert as_set(kept.faces) == as_set(Delaunay(points).simplices)
        assert (signed_areas(points, kept.faces) > 0).all()
    assert changed > 100


def test_added_points_are_in_the_triangulation():
    rng = np.random.default_rng(7)
    points, faces = in_a_circle(100, rng)
    kept = KeptDelaunay(faces)
    more = np.vstack([points, rng.uniform(-0.6, 0.6, (30, 2))])
    kept.add(more, range(len(points), len(more)))
    assert as_set(kept.faces) == as_set(Delaunay(more).simplices)


def test_an_outline_that_turns_in_keeps_its_edges():
    """The two edges of the notch are not Delaunay in their points' hull; nothing is flipped across them."""
    notch = np.array([[0, 0], [4, 0], [4, 3], [2, 0.2], [0, 3], [1.0, 1.0], [3.0, 1.0]], float)
    faces = np.array([[0, 1, 3], [1, 6, 3], [1, 2, 6], [2, 3, 6], [0, 3, 5], [0, 5, 4], [5, 3, 4]], np.int32)
    assert (signed_areas(notch, faces) > 0).all()
    kept = KeptDelaunay(faces)
    kept.restore(notch)
    assert signed_areas(notch, kept.faces).sum() == pytest.approx(signed_areas(notch, faces).sum())
    sides = {tuple(sorted(pair)) for face in kept.faces.tolist() for pair in zip(face, face[1:] + face[:1])}
    assert {(2, 3), (3, 4)} <= sides


def test_a_flat_triangle_at_a_straight_edge_is_flipped_away():
    points = np.array([[0, 0], [1, 0], [2, 0], [1, 1.0]])
    kept = KeptDelaunay(np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    kept.restore(points)
    assert as_set(kept.faces) == {(0, 1, 3), (1, 2, 3)}


def test_four_points_of_a_circle_are_left_as_they_are():
    points = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])
    for faces in ([[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]):
        kept = KeptDelaunay(np.array(faces, np.int32))
        kept.restore(points)
        assert as_set(kept.faces) == as_set(np.array(faces))
