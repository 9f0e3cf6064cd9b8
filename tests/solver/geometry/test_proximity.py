"""Claims on nearness of triangle surfaces, against ipctk and closed forms."""

import ipctk
import numpy as np
import pytest

from tryon_solver.geometry.proximity import Surface

ONE = np.array([[0, 1, 2]], dtype=np.int32)


def exact_distance(a, b):
    """Distance of two triangles (3, 3) that do not cross: the least over points to triangle and edge to edge."""
    squared = [ipctk.point_triangle_distance(p, *triangle) for one, triangle in ((a, b), (b, a)) for p in one]
    squared += [
        ipctk.edge_edge_distance(a[i], a[(i + 1) % 3], b[k], b[(k + 1) % 3]) for i in range(3) for k in range(3)
    ]
    return np.sqrt(min(squared))


def crossing(a, b):
    vertices, faces = np.vstack([a, b]), np.array([[0, 1, 2], [3, 4, 5]], dtype=np.int32)
    return ipctk.has_intersections(ipctk.CollisionMesh(vertices, ipctk.edges(faces), faces), vertices)


def test_triangles_are_nearer_exactly_from_their_distance_on():
    random = np.random.default_rng(3)
    apart = 0
    for _ in range(300):
        a, b = random.uniform(-1, 1, (2, 3, 3))
        b += random.uniform(0, 1.5) * np.array([1, 0, 0])
        one, other = Surface(a, ONE), Surface(b, ONE)
        if crossing(a, b):
            assert one.is_nearer_than(1e-9, other)
            continue
        apart += 1
        distance = exact_distance(a, b)
        assert not one.is_nearer_than(0.999 * distance, other)
        assert one.is_nearer_than(1.001 * distance, other)
        assert other.is_nearer_than(1.001 * distance, one)
    assert 50 < apart < 290


def test_a_large_triangle_far_from_its_corners_is_near():
    large = np.array([[-10.0, 0, -10], [10, 0, -10], [0, 0, 20]])
    small = np.array([[0, 0.1, 0], [0.01, 0.2, 0], [0, 0.2, 0.01]])
    assert Surface(large, ONE).is_nearer_than(0.11, Surface(small, ONE))
    assert not Surface(large, ONE).is_nearer_than(0.09, Surface(small, ONE))


def octahedron(radius):
    vertices = radius * np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=float)
    faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    return Surface(vertices, np.array(faces, dtype=np.int32))


def test_points_inside_an_octahedron_have_absolute_coordinates_that_sum_to_less_than_its_radius():
    points = np.random.default_rng(1).uniform(-1, 1, (400, 3))
    sums = np.abs(points).sum(axis=1)
    inside = octahedron(1.0).contains(points)
    assert inside.any()
    assert np.array_equal(inside, sums < 1)


def test_a_surface_within_another_is_not_near_its_skin():
    assert not octahedron(1.0).is_nearer_than(0.5, octahedron(0.1))
    # Parallel faces of radii 1 and 0.9 are 0.1 / sqrt(3) apart.
    assert octahedron(1.0).is_nearer_than(0.1 / np.sqrt(3) + 1e-9, octahedron(0.9))
    assert not octahedron(1.0).is_nearer_than(0.1 / np.sqrt(3) - 1e-9, octahedron(0.9))


def test_no_points_are_inside():
    assert octahedron(1.0).contains(np.empty((0, 3))).shape == (0,)


def test_crossing_is_found_though_all_corners_and_edges_are_far():
    plate = np.array([[-1.0, 0, -1], [1, 0, -1], [0, 0, 2]])
    needle = np.array([[0, -1.0, 0], [0, 1, 0], [0.001, 1, 0]])
    assert crossing(plate, needle)
    assert Surface(plate, ONE).is_nearer_than(1e-9, Surface(needle, ONE))
    assert Surface(needle, ONE).is_nearer_than(1e-9, Surface(plate, ONE))


@pytest.mark.parametrize("distance", [0.01, 0.2])
def test_parallel_edges_are_as_far_as_their_lines(distance):
    a = np.array([[0, 0, 0], [1.0, 0, 0], [0.5, -1, 0]])
    b = np.array([[0.2, 0, distance], [0.8, 0, distance], [0.5, 1, distance]])
    assert Surface(a, ONE).is_nearer_than(distance * 1.001, Surface(b, ONE))
    assert not Surface(a, ONE).is_nearer_than(distance * 0.999, Surface(b, ONE))
