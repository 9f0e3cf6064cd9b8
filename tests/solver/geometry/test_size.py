"""A pattern in another size: every length by one factor, its highest point where it was, cut as finely as asked."""

import numpy as np
import pytest
from worn_garment import DEMO

from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import PatternError, load_pattern, parse_pattern
from tryon_solver.geometry.size import mesh_in_size, mesh_with_vertices
from tryon_solver.geometry.weld import weld


def test_a_seam_whose_sides_come_to_other_numbers_of_vertices_is_refused_by_number():
    shirt = load_pattern(DEMO / "patterns" / "tshirt.json")
    with pytest.raises(PatternError, match=r"its sides come to \d and \d vertices.*more vertices") as refused:
        mesh_with_vertices(shirt, 8)
    assert refused.value.place.startswith("stitches[")


@pytest.mark.parametrize("size", [0.8, 1.25])
def test_lengths_grow_by_the_factor_and_the_top_stays(size, two_squares):
    pattern = parse_pattern(two_squares)
    mesh, own = mesh_in_size(pattern, 0.05, size), mesh_pattern(pattern, 0.05)
    assert np.ptp(mesh.uv, axis=0) == pytest.approx(size * np.ptp(own.uv, axis=0))
    assert np.ptp(mesh.placed, axis=0) == pytest.approx(size * np.ptp(own.placed, axis=0))
    assert mesh.placed[:, 1].max() == pytest.approx(own.placed[:, 1].max())
    sides = mesh.uv[mesh.faces] - mesh.uv[np.roll(mesh.faces, -1, axis=1)]
    assert np.linalg.norm(sides, axis=2).mean() == pytest.approx(0.05, rel=0.15)


def test_its_own_size_changes_nothing(two_squares):
    pattern = parse_pattern(two_squares)
    mesh, own = mesh_in_size(pattern, 0.05, 1.0), mesh_pattern(pattern, 0.05)
    assert np.array_equal(mesh.uv, own.uv)
    assert np.allclose(mesh.placed, own.placed, atol=1e-15)


@pytest.mark.parametrize("size", [0.0, 0.3, 3.0, float("nan")])
def test_what_is_no_size_is_refused(size, two_squares):
    with pytest.raises(PatternError, match="no size") as caught:
        mesh_in_size(parse_pattern(two_squares), 0.05, size)
    assert caught.value.place == "size"


@pytest.mark.parametrize(("vertices", "size"), [(300, 1.0), (1200, 1.0), (1200, 1.25)])
def test_a_number_of_vertices_is_met_in_any_size(vertices, size, two_squares):
    pattern = parse_pattern(two_squares)
    mesh = mesh_with_vertices(pattern, vertices, size)
    assert weld(mesh).vertex_count == pytest.approx(vertices, rel=0.05)
    assert np.ptp(mesh.uv, axis=0) == pytest.approx(size * np.ptp(mesh_pattern(pattern, 0.05).uv, axis=0))


@pytest.mark.parametrize("vertices", [-5, 0, 2])
def test_fewer_vertices_than_a_triangle_are_refused(vertices, two_squares):
    with pytest.raises(ValueError, match=f"vertices: {vertices}"):
        mesh_with_vertices(parse_pattern(two_squares), vertices)
