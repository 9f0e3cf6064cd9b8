"""Edges through triangles: what is counted is what crosses, where many points lie in one plane and on one line, too."""

import ipctk
import numpy as np
import pytest
from small_scenes import fabric, sheet

from tryon_solver.contact.crossings import CrossingSearch
from tryon_solver.scene import Scene, SelfContact
from tryon_solver.simulation import build


def counted(corners):
    """Of each edge and triangle, corners (K, 5, 3), the edge first: is it counted? Far from all others."""
    k = np.arange(len(corners))
    far = corners + 16.0 * np.column_stack([k % 20, k // 20 % 20, k // 400])[:, None]
    ids = np.arange(5 * len(corners)).reshape(-1, 5)
    found = CrossingSearch(ids[:, :2], ids[:, 2:], np.arange(ids.size), "cpu").find(far.reshape(-1, 3))
    assert (found[:, 0] == found[:, 1]).all()
    return np.isin(np.arange(len(corners)), found[:, 0])


@pytest.mark.parametrize("scale", [1.0, 0.125])
def test_only_what_crosses_is_counted_among_points_of_a_grid(rng, scale):
    """Of whole numbers up to 2 each: a third of the edges lie in the triangle's plane or end there."""
    corners = scale * rng.integers(-2, 3, (6000, 5, 3)).astype(float)
    flat = np.linalg.norm(np.cross(corners[:, 3] - corners[:, 2], corners[:, 4] - corners[:, 2]), axis=1) == 0
    corners = corners[~flat & (corners[:, 0] != corners[:, 1]).any(1)]
    found = counted(corners)
    p, q, a, b, c = np.moveaxis(corners, 1, 0)
    n = np.cross(b - a, c - a)
    above, below = ((p - a) * n).sum(1), ((q - a) * n).sum(1)
    through = above * below < 0
    met = p + np.divide(above, above - below, out=np.zeros_like(above), where=through)[:, None] * (q - p)
    apart = np.array([ipctk.point_triangle_distance(*each) for each in zip(met, a, b, c)])
    assert min((through & (apart < 1e-20)).sum(), (~through).sum(), (above * below == 0).sum()) > 300
    np.testing.assert_array_equal(found, through & (apart < 1e-20))


@pytest.mark.parametrize("turned", [False, True])
def test_a_sheet_whose_strips_are_flat_crosses_nowhere(turned):
    """Its triangles lie in common planes by columns, and their edges on common lines; rounding gives volumes a sign."""
    garment, x = sheet(25, 25, 0.4, 0.4)
    x = x + 0.1
    wave = np.column_stack([x[:, 0], x[:, 2], 0.02 * np.sin(20 * x[:, 0])])
    places = wave[:, [2, 0, 1]] if turned else wave
    mesh = ipctk.CollisionMesh(places, garment.edges(), garment.faces)
    assert not ipctk.has_intersections(mesh, places.astype(np.float32).astype(float))
    build(Scene(garment, places, None, fabric(), (SelfContact(),)), None, "cpu")
