"""Claims on meshing and sewing pieces: matched seams, a sound surface, boundary loops, areas, sides of the fabric."""

import numpy as np
import pytest

from tryon_solver.geometry import curves, outline, seams
from tryon_solver.geometry.boundary_loops import boundary_loops
from tryon_solver.geometry.panel_mesh import VERTEX_BELOW, mesh_pattern
from tryon_solver.geometry.pattern import PatternError, load_pattern, parse_pattern
from tryon_solver.geometry.triangulate import corner_angles, signed_areas
from tryon_solver.geometry.weld import weld


def assert_sound(mesh, sewn):
    """The sewn surface is an edge-manifold without pinches, doubled faces or faces that repeat a vertex."""
    faces = sewn.vertex_of_corner
    assert signed_areas(mesh.uv, mesh.faces).min() > 0
    assert np.array_equal(np.unique(faces), np.arange(sewn.vertex_count))
    ordered = np.sort(faces, axis=1)
    assert (np.diff(ordered, axis=1) > 0).all()
    assert len(np.unique(ordered, axis=0)) == len(faces)
    edges, uses = np.unique(np.sort(seams.face_edges(faces), axis=1), axis=0, return_counts=True)
    assert uses.max() <= 2
    assert len(seams.pinched(faces, sewn.vertex_count)) == 0
    loops = boundary_loops(faces)
    assert sum(len(loop) for loop in loops) == np.count_nonzero(uses == 1)
    seam_uses = uses[np.isin(edges @ [sewn.vertex_count, 1], sewn.seam_edges @ [sewn.vertex_count, 1])]
    assert (seam_uses == 2).all()
    assert len(seam_uses) == len(sewn.seam_edges)
    return loops


def euler_characteristic(sewn):
    edges = np.unique(np.sort(seams.face_edges(sewn.vertex_of_corner), axis=1), axis=0)
    return sewn.vertex_count - len(edges) + len(sewn.vertex_of_corner)


@pytest.mark.parametrize("edge_length", [0.016, 0.05])
def test_patterns_sew_to_a_sound_surface(pattern_path, edge_length, meshed):
    mesh = meshed(pattern_path, edge_length)
    sewn = weld(mesh)
    loops = assert_sound(mesh, sewn)
    # One connected garment of genus 0: its Euler characteristic is two less the number of its openings.
    assert euler_characteristic(sewn) == 2 - len(loops)
    # Both faces of an inner edge pass it in opposite directions: the right side is outside everywhere.
    sides = seams.face_edges(sewn.vertex_of_corner)
    assert len(np.unique(sides, axis=0)) == len(sides)


def test_triangles_of_patterns_are_well_shaped(pattern_path, meshed):
    mesh = meshed(pattern_path, 0.016)
    angles = corner_angles(mesh.uv, mesh.faces).min(axis=1)
    assert angles.min() > 20
    assert np.median(angles) > 50
    lengths = np.linalg.norm(mesh.uv[mesh.faces] - np.roll(mesh.uv[mesh.faces], -1, axis=1), axis=2)
    assert lengths.mean() == pytest.approx(0.016, rel=0.1)


def test_mesh_area_is_the_area_of_the_pieces(pattern_path, meshed):
    pattern = load_pattern(pattern_path)
    edge_length = 0.016
    mesh = meshed(pattern_path, edge_length)
    areas = np.bincount(mesh.panel_of_face, weights=signed_areas(mesh.uv, mesh.faces))
    for panel, area in zip(pattern.panels, areas):
        fine = [curves.sample_by_arc_length(edge.curve, 200) for edge in panel.edges]
        exact = abs(outline.signed_area(np.vstack([points[:-1] for points in fine])))
        # A chord of length s leaves out k s^3 / 12 at curvature k: s^2 / 12 times the angle an edge turns by. A step is
        # at most twice the edge length. An edge that became a vertex moves two steps by half its length.
        steps = [np.diff(points, axis=0) for points in fine]
        headings = [np.unwrap(np.arctan2(step[:, 1], step[:, 0])) for step in steps]
        turning = sum(float(np.abs(np.diff(heading)).sum()) for heading in headings)
        short = sum(edge.length for edge in panel.edges if edge.length < 1.5 * VERTEX_BELOW * edge_length)
        assert abs(area - exact) <= (2 * edge_length) ** 2 / 12 * turning + short * edge_length + 1e-9


def test_sewn_vertices_divide_both_edges_equally(two_squares):
    # 40 cm on 44 cm of ease: 0.42 m / 0.02 m = 21 segments on either side.
    two_squares["pattern"]["panels"]["right"]["vertices"] = [[0, 0], [40, 0], [40, 44], [0, 44]]
    mesh = mesh_pattern(parse_pattern(two_squares), 0.02)
    assert len(mesh.stitches) == 22
    left, right = mesh.uv[mesh.stitches[:, 0]], mesh.uv[mesh.stitches[:, 1]]
    assert np.allclose(left, np.stack([np.full(22, 0.4), np.linspace(0, 0.4, 22)], axis=1))
    assert np.allclose(right, np.stack([np.zeros(22), np.linspace(0, 0.44, 22)], axis=1))
    assert (mesh.panel_of_vertex[mesh.stitches] == [0, 1]).all()


def test_right_wrong_sews_start_to_start(two_squares):
    two_squares["pattern"]["stitches"][0].append("right_wrong")
    mesh = mesh_pattern(parse_pattern(two_squares), 0.1)
    left, right = mesh.uv[mesh.stitches[:, 0], 1], mesh.uv[mesh.stitches[:, 1], 1]
    assert np.allclose(left + right, 0.4)


def test_a_piece_drawn_clockwise_is_seen_from_its_other_side(two_squares):
    two_squares["pattern"]["panels"]["right"].update(
        vertices=[[0, 0], [0, 40], [30, 40], [30, 0]], translation=[0, 0, -10]
    )
    two_squares["pattern"]["stitches"] = []
    mesh = mesh_pattern(parse_pattern(two_squares), 0.1)
    corners = mesh.placed[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.sign(normals[:, 2]) == np.where(mesh.panel_of_face == 0, 1, -1)).all()
    right = mesh.panel_of_vertex == 1
    assert mesh.uv[right, 0].min() == pytest.approx(-0.3)
    assert mesh.placed[right].max(axis=0) == pytest.approx([0.3, 0.4, -0.1])
    assert mesh.placed[right].min(axis=0) == pytest.approx([0.0, 0.0, -0.1])


def test_flat_pieces_keep_their_lengths_where_they_are_placed(pattern_path, meshed):
    mesh = meshed(pattern_path, 0.05)
    sides = seams.face_edges(mesh.faces)
    in_pattern = np.linalg.norm(np.diff(mesh.uv[sides], axis=1), axis=2)
    in_space = np.linalg.norm(np.diff(mesh.placed[sides], axis=1), axis=2)
    assert np.allclose(in_pattern, in_space, atol=1e-12)


SQUARE_SEWINGS = {
    "pillow": ([("a", i, "b", i, "right_wrong") for i in range(4)], 2, 0),
    "tube": ([("a", 1, "a", 3)], 0, 2),
    "torus": ([("a", 1, "a", 3), ("a", 0, "a", 2)], 0, 0),
    "cone": ([("a", 0, "a", 1)], 1, 1),
    "turnover": ([("a", 0, "a", 1), ("a", 2, "a", 3)], 2, 0),
}


@pytest.mark.parametrize("edge_length", [0.05, 0.13, 0.2, 0.4, 0.9])
@pytest.mark.parametrize("name", SQUARE_SEWINGS)
def test_coarse_meshes_stay_sound_when_sewn(rectangle, specification, name, edge_length):
    stitches, characteristic, openings = SQUARE_SEWINGS[name]
    panels = {"a": rectangle(40, 40)} | ({"b": rectangle(40, 40)} if name == "pillow" else {})
    mesh = mesh_pattern(parse_pattern(specification(panels, stitches)), edge_length)
    sewn = weld(mesh)
    assert len(assert_sound(mesh, sewn)) == openings
    assert euler_characteristic(sewn) == characteristic


@pytest.mark.parametrize("edge_length", [0.004, 0.05, 0.3])
def test_a_narrow_belt_stays_a_ring(rectangle, specification, edge_length):
    mesh = mesh_pattern(parse_pattern(specification({"a": rectangle(80, 0.5)}, [("a", 1, "a", 3)])), edge_length)
    assert [len(loop) for loop in assert_sound(mesh, weld(mesh))] == [max(3, round(0.8 / edge_length))] * 2


def test_a_short_sewn_edge_between_seams_becomes_a_vertex(rectangle, specification):
    panels = {"a": rectangle(40, 40), "b": rectangle(40, 40)}
    for panel in panels.values():
        panel["vertices"] = [[0, 0], [40, 0], [40, 39.5], [39.5, 40], [0, 40]]
        panel["edges"] = [{"endpoints": [i, (i + 1) % 5]} for i in range(5)]
    stitches = [("a", i, "b", i, "right_wrong") for i in range(4)]
    mesh = mesh_pattern(parse_pattern(specification(panels, stitches)), 0.05)
    assert_sound(mesh, weld(mesh))
    assert np.count_nonzero(mesh.seam_of_stitch == 2) == 1
    assert np.linalg.norm(mesh.uv - [0.3975, 0.3975], axis=1).min() == pytest.approx(0, abs=1e-12)
    finer = mesh_pattern(parse_pattern(specification(panels, stitches)), 0.01)
    assert np.count_nonzero(finer.seam_of_stitch == 2) == 2


def test_unsewn_pieces_stay_apart(rectangle, specification):
    mesh = mesh_pattern(parse_pattern(specification({"a": rectangle(40, 40), "b": rectangle(20, 20)})), 0.1)
    sewn = weld(mesh)
    assert sewn.vertex_count == len(mesh.uv)
    assert len(sewn.seam_edges) == 0
    assert len(boundary_loops(sewn.vertex_of_corner)) == 2


def test_means_over_sewn_vertices(two_squares):
    mesh = mesh_pattern(parse_pattern(two_squares), 0.2)
    sewn = weld(mesh)
    mean = sewn.mean_of_vertices(mesh.placed)
    a, b = mesh.stitches[0]
    assert sewn.welded_of_vertex[a] == sewn.welded_of_vertex[b]
    assert np.allclose(mean[sewn.welded_of_vertex[a]], (mesh.placed[a] + mesh.placed[b]) / 2)
    assert np.allclose(mean[sewn.welded_of_vertex[mesh.panel_of_vertex == 0]][0], mesh.placed[0])


def test_loops_run_with_the_surface_on_their_left():
    faces = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)
    assert [loop.tolist() for loop in boundary_loops(faces)] == [[0, 1, 2, 3]]


def test_two_fans_that_meet_in_a_vertex_have_a_loop_each():
    faces = np.array([[0, 1, 2], [0, 3, 4]], dtype=np.int32)
    assert sorted(loop.tolist() for loop in boundary_loops(faces)) == [[0, 1, 2], [0, 3, 4]]


def test_loops_refuse_an_edge_of_three_faces():
    with pytest.raises(ValueError, match="edge 0-1 is in 3 faces"):
        boundary_loops(np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]], dtype=np.int32))


@pytest.mark.parametrize(
    ("edge_length", "words"), [(0.0, "not an edge length"), (np.nan, "not an"), (1e-5, "vertices")]
)
def test_a_bad_edge_length_is_refused(two_squares, edge_length, words):
    with pytest.raises(PatternError, match=words) as caught:
        mesh_pattern(parse_pattern(two_squares), edge_length)
    assert caught.value.place == "edge_length"
