"""Of a point: the triangle it lies in, or nearest, and its place there."""

import numpy as np
from pattern_measures import demo

from tryon_solver.geometry.locate import barycentric, locate
from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import parse_pattern

SQUARE = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
HALVES = SQUARE[[[0, 1, 2], [0, 2, 3]]]


def test_points_of_the_plane_are_located():
    points = np.array([[0.75, 0.25], [0.1, 0.6]])
    face, weights = locate(points, HALVES)
    np.testing.assert_array_equal(face, [0, 1])
    np.testing.assert_allclose((weights[..., None] * HALVES[face]).sum(1), points, atol=1e-15)


def test_a_point_beside_the_mesh_goes_on_from_the_nearest_triangle():
    face, weights = locate(np.array([[1.5, 0.2]]), HALVES)
    assert face[0] == 0
    np.testing.assert_allclose(weights[0], [-0.5, 1.3, 0.2], atol=1e-15)


def test_every_vertex_of_a_garment_lies_in_a_triangle_of_its_own_piece():
    mesh = mesh_pattern(parse_pattern(demo("tshirt")), 0.06)
    face, weights = locate(mesh.placed, mesh.placed[mesh.faces])
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-12)
    found = np.einsum("vk,vkd->vd", weights, mesh.placed[mesh.faces[face]])
    np.testing.assert_allclose(found, mesh.placed, atol=1e-9)
    assert (mesh.panel_of_face[face] == mesh.panel_of_vertex).all()


def test_barycentric_coordinates_are_those_of_the_foot_in_the_plane(rng):
    a, b, c = rng.normal(size=(3, 5, 3))
    shares = rng.normal(size=(5, 3))
    shares /= shares.sum(axis=1, keepdims=True)
    point = np.einsum("nk,knd->nd", shares, np.array([a, b, c]))
    above = point + 0.3 * np.cross(b - a, c - a)
    np.testing.assert_allclose(barycentric(a, b, c, above), shares, atol=1e-9)
