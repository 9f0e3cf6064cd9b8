"""Claims on placing pieces: none crosses or is nearer than the clearance, none is stretched, faults name the piece."""

import ipctk
import numpy as np
import pytest

from tryon_solver.body.model import BodyError, default_body
from tryon_solver.geometry import seams
from tryon_solver.geometry.body_parts import find_trunk
from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import parse_pattern
from tryon_solver.geometry.placement import PlacementError, place_around
from tryon_solver.geometry.rolling import profile_around, roll, roll_on_cone

CLEARANCE = 0.004


@pytest.fixture(scope="module")
def body():
    """The default body's vertices and faces."""
    try:
        model = default_body()
    except BodyError as error:
        pytest.skip(str(error))
    return model.rest_vertices, model.faces


def column(radius_x, radius_z, height, rings=40, spokes=48):
    """A closed upright column of elliptic section around the y axis, feet at y = 0: vertices and outward faces."""
    angle = 2 * np.pi * np.arange(spokes) / spokes
    ring = np.stack([radius_x * np.sin(angle), np.zeros(spokes), radius_z * np.cos(angle)], axis=1)
    levels = np.linspace(0, height, rings)
    rows = [ring + np.array([0, y, 0]) for y in levels]
    vertices = np.vstack([*rows, [[0, 0, 0], [0, height, 0]]])
    faces = []
    for row in range(rings - 1):
        for k in range(spokes):
            a, b = row * spokes + k, row * spokes + (k + 1) % spokes
            faces += [[a, b, b + spokes], [a, b + spokes, a + spokes]]
    bottom, top = rings * spokes, rings * spokes + 1
    last = (rings - 1) * spokes
    for k in range(spokes):
        faces += [[bottom, (k + 1) % spokes, k], [top, last + k, last + (k + 1) % spokes]]
    return vertices, np.array(faces, dtype=np.int32)


def assert_clear(mesh, positions, body_vertices, body_faces):
    """No intersections by ipctk, and no two different surfaces nearer than the clearance."""
    vertices = np.vstack([positions, body_vertices])
    faces = np.vstack([mesh.faces, body_faces + len(positions)]).astype(np.int32)
    scene = ipctk.CollisionMesh(vertices, ipctk.edges(faces), faces)
    assert not ipctk.has_intersections(scene, vertices)
    surface = np.concatenate([mesh.panel_of_vertex, np.full(len(body_vertices), -1)])
    collisions = ipctk.NormalCollisions()
    collisions.build(scene, vertices, 0.999 * CLEARANCE)
    for k in range(len(collisions)):
        ids = [v for v in collisions[k].vertex_ids(scene.edges, scene.faces) if v >= 0]
        assert len(set(surface[ids])) == 1


def stretch(mesh, positions):
    """Lengths of the mesh edges in space over those in the pattern."""
    sides = seams.face_edges(mesh.faces)
    flat = np.linalg.norm(np.diff(mesh.uv[sides], axis=1), axis=2)
    return np.linalg.norm(np.diff(positions[sides], axis=1), axis=2) / flat


def test_every_pattern_is_placed_clear_and_unstretched(pattern_path, body, meshed):
    mesh = meshed(pattern_path, 0.03)
    positions = place_around(mesh, *body, CLEARANCE)
    assert_clear(mesh, positions, *body)
    # A chord of length s on a bend of radius R is shorter than its arc by the share s^2 / (24 R^2). The tightest bend
    # is that of a cuff, R = 4 cm; the longest edges have 1.5 times the mean length.
    ratio = stretch(mesh, positions)
    assert ratio.max() < 1 + 1e-6
    assert ratio.min() > 1 - 0.045**2 / (24 * 0.04**2)


@pytest.mark.parametrize("name", ["dress", "skirt", "tshirt"])
def test_seams_of_the_demo_start_shorter_than_between_flat_pieces(name, body, demo_patterns, meshed):
    mesh = meshed(demo_patterns / f"{name}.json", 0.05)
    positions = place_around(mesh, *body, CLEARANCE)

    def mean_gap(x):
        return np.linalg.norm(x[mesh.stitches[:, 0]] - x[mesh.stitches[:, 1]], axis=1).mean()

    assert mean_gap(positions) < 0.5 * mean_gap(mesh.placed)
    assert mean_gap(positions) < 0.15


def test_trunk_and_arms_of_the_default_body_are_told_apart(body):
    vertices, faces = body
    trunk = find_trunk(vertices, faces)
    left = trunk.arms(vertices, 1)
    assert trunk.half_width == pytest.approx(0.173, abs=0.02)
    assert 1.2 < trunk.armpit < 1.32
    assert 0.05 < left.mean() < 0.3
    assert np.count_nonzero(left) == pytest.approx(np.count_nonzero(trunk.arms(vertices, -1)), rel=0.1)
    # Hands are arms, feet and hips are not.
    assert left[np.argmax(vertices[:, 0])]
    assert not trunk.arms(vertices[vertices[:, 1] < 0.1], 1).any()
    assert not trunk.arms(vertices[np.abs(vertices[:, 1] - 0.9) < 0.005], 1)[:5].any()
    assert trunk.arm_side(np.array([0.3, 1.2, 0.1]), "arm") == 1
    assert trunk.arm_side(np.array([-0.3, 1.2, 0.1]), "arm") == -1
    assert trunk.arm_side(np.array([0.1, 1.2, 0.1]), "body") == 0
    assert trunk.arm_side(np.array([-0.3, 1.2, 0.1]), "") == -1


def test_a_body_without_arms_has_none():
    vertices, faces = column(0.15, 0.1, 1.7)
    trunk = find_trunk(vertices, faces)
    assert not trunk.arms(vertices, 1).any()
    assert trunk.arm_side(np.array([0.5, 1.0, 0.0]), "arm") == 0


def test_two_pieces_close_around_a_column(rectangle, specification):
    vertices, faces = column(0.15, 0.1, 1.7)
    panels = {
        "front": rectangle(44, 50, translation=[-22, 80, 30], label="body"),
        "back": rectangle(44, 50, translation=[22, 80, -30], rotation=[0, 180, 0], label="body"),
    }
    spec = specification(panels, [("front", 1, "back", 3), ("front", 3, "back", 1)])
    mesh = mesh_pattern(parse_pattern(spec), 0.02)
    positions = place_around(mesh, vertices, faces, CLEARANCE)
    assert_clear(mesh, positions, vertices, faces)
    # Heights stay; pieces face outwards; the seams' gaps are what the column's girth leaves over 88 cm, twice.
    assert np.allclose(positions[:, 1], mesh.placed[:, 1])
    corners = positions[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outward = np.sum(normals * corners.mean(axis=1) * [1, 0, 1], axis=1)
    assert (outward > 0).all()
    gaps = np.linalg.norm(positions[mesh.stitches[:, 0]] - positions[mesh.stitches[:, 1]], axis=1)
    assert gaps.max() < 0.06


@pytest.mark.parametrize("flare", [0, 6])
def test_the_halves_of_a_front_stay_side_by_side(flare, rectangle, specification):
    """Each is too wide for its own quarter of the column; together they fit around its front half."""
    vertices, faces = column(0.15, 0.1, 1.7)

    def half(side):
        corners = [[0, 0], [24 + flare, 0], [24, 50], [0, 50]]
        panel = rectangle(24, 50, vertices=[[side * x, y] for x, y in corners], label="leg")
        return {**panel, "translation": [0, 80, 30]}

    panels = {"right": half(-1), "left": half(1)}
    mesh = mesh_pattern(parse_pattern(specification(panels, [("right", 3, "left", 3, "right_wrong")])), 0.03)
    positions = place_around(mesh, vertices, faces, CLEARANCE)
    assert_clear(mesh, positions, vertices, faces)
    seam = positions[mesh.stitches]
    assert np.linalg.norm(seam[:, 0] - seam[:, 1], axis=1).max() < 3 * CLEARANCE
    left = mesh.panel_of_vertex == 1
    assert positions[left, 0].min() > positions[~left, 0].max()


def test_pieces_that_overlap_in_the_pattern_are_placed_one_by_one(rectangle, specification):
    """A godet lies before the slit it is sewn into; only what lies beside is rolled together."""
    vertices, faces = column(0.15, 0.1, 1.7)
    panels = {
        "front": rectangle(44, 50, translation=[-22, 80, 20], label="body"),
        "pocket": rectangle(15, 15, translation=[-7, 90, 25], label="body"),
    }
    mesh = mesh_pattern(parse_pattern(specification(panels, [("front", 0, "pocket", 0, "gather")])), 0.03)
    positions = place_around(mesh, vertices, faces, CLEARANCE)
    assert_clear(mesh, positions, vertices, faces)
    pocket = mesh.panel_of_vertex == 1
    assert abs(positions[pocket, 0].mean() - mesh.placed[pocket, 0].mean()) < 0.01
    assert positions[pocket, 2].min() > positions[~pocket, 2].max() - 0.05


def sleeve_and_cuff(rectangle, specification):
    """A left sleeve and its cuff in front and back halves, straight out at 45 degrees, before and behind the trunk."""
    panels = {}
    for name, z in (("f", 17.5), ("b", -12.5)):
        place = {"rotation": [0, 0, 45], "label": "arm"}
        panels[f"sleeve_{name}"] = rectangle(20, 40, translation=[47, 98, z], **place)
        panels[f"cuff_{name}"] = rectangle(20, 6, translation=[53, 92, z], **place)
    stitches = [(f"{piece}_f", edge, f"{piece}_b", edge) for piece in ("sleeve", "cuff") for edge in (1, 3)]
    stitches += [(f"cuff_{name}", 2, f"sleeve_{name}", 0) for name in ("f", "b")]
    return specification(panels, [(*s, "right_wrong") if s[1] == s[3] else s for s in stitches])


def test_sleeve_and_cuff_follow_an_arm_held_forward(body, rectangle, specification):
    """The default body's hands are before its trunk, further than the pattern puts the front of the cuff."""
    mesh = mesh_pattern(parse_pattern(sleeve_and_cuff(rectangle, specification)), 0.03)
    vertices, faces = body
    positions = place_around(mesh, vertices, faces, CLEARANCE)
    assert_clear(mesh, positions, vertices, faces)
    arm = vertices[find_trunk(vertices, faces).arms(vertices, 1)]

    def before_the_arm(name):
        """Mean distance in z of the piece from the arm's vertices nearest in x and y."""
        points = positions[mesh.panel_of_vertex == mesh.panel_names.index(name)]
        nearest = np.linalg.norm(points[:, None, :2] - arm[None, :, :2], axis=2).argsort(axis=1)[:, :8]
        return float((points[:, 2] - arm[nearest, 2].mean(axis=1)).mean())

    for piece in ("sleeve", "cuff"):
        assert before_the_arm(f"{piece}_f") > 0.02
        assert before_the_arm(f"{piece}_b") < -0.02
    gaps = np.linalg.norm(positions[mesh.stitches[:, 0]] - positions[mesh.stitches[:, 1]], axis=1)
    for seam in range(6):
        assert gaps[mesh.seam_of_stitch == seam].mean() < 0.16


def test_a_piece_within_a_huge_body_is_named(rectangle, specification):
    vertices, faces = column(3.0, 3.0, 3.0)
    lying = rectangle(40, 40, translation=[-20, 100, 20], rotation=[-90, 0, 0], label="body")
    spec = specification({"front": lying})
    with pytest.raises(PlacementError, match="no place clear") as caught:
        place_around(mesh_pattern(parse_pattern(spec), 0.1), vertices, faces, CLEARANCE)
    assert caught.value.place == "panels.front"
    assert "translation" in caught.value.remedy


def test_a_lying_piece_is_only_moved(rectangle, specification):
    vertices, faces = column(0.15, 0.1, 1.7)
    spec = specification({"hat": rectangle(20, 20, translation=[-10, 165, 10], rotation=[-90, 0, 0], label="body")})
    mesh = mesh_pattern(parse_pattern(spec), 0.05)
    moved = place_around(mesh, vertices, faces, CLEARANCE) - mesh.placed
    assert np.ptp(moved, axis=0) == pytest.approx([0, 0, 0], abs=1e-12)
    assert moved[0, 1] > 0.05


def test_a_profile_is_convex_and_keeps_its_distance_from_a_smooth_section():
    angle = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    for centre in ([0.0, 0.0], [0.9, -0.3]):
        points = profile_around(0.1 * np.stack([np.sin(angle), np.cos(angle)], axis=1) + centre, 0.02).points
        assert np.linalg.norm(points - centre, axis=1) == pytest.approx(0.12, abs=1e-4)
    square = np.array([[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]])
    steps = np.diff(profile_around(square, 0.01).points, axis=0)
    turns = steps[:-1, 0] * steps[1:, 1] - steps[:-1, 1] * steps[1:, 0]
    assert (turns <= 1e-15).all()


def grid(width, height, taper=0.0):
    """Points of a flat piece around c = 0, a from 0 to the height, wider by the taper at the bottom, and its grid."""
    u, a = np.meshgrid(np.linspace(-0.5, 0.5, 41), np.linspace(0, height, 41))
    return np.stack([u * (width + taper * (1 - a / height)), a], axis=-1)


PART = np.column_stack([0.1 * np.sin(np.arange(60)), 0.1 * np.cos(np.arange(60)), np.linspace(0, 0.4, 60)])


@pytest.mark.parametrize(("function", "taper"), [(roll, 0.0), (roll_on_cone, 0.15)])
def test_rolling_keeps_lengths_and_clears_the_part(function, taper):
    flat = grid(0.24, 0.4, taper)
    rolled = function(flat.reshape(-1, 2), PART, 0.03).reshape(41, 41, 3)
    for axis in (0, 1):
        lengths = np.linalg.norm(np.diff(flat, axis=axis), axis=2)
        assert np.linalg.norm(np.diff(rolled, axis=axis), axis=2) == pytest.approx(lengths, rel=2e-3)
    diagonals = np.linalg.norm(flat[1:, 1:] - flat[:-1, :-1], axis=2)
    assert np.linalg.norm(rolled[1:, 1:] - rolled[:-1, :-1], axis=2) == pytest.approx(diagonals, rel=2e-3)
    assert np.linalg.norm(rolled[..., :2], axis=2).min() > 0.1
    assert rolled[..., 1].min() > -0.01


def test_a_piece_wider_than_half_the_cylinder_is_not_rolled():
    assert roll(grid(0.45, 0.4).reshape(-1, 2), PART, 0.03) is None


def test_a_piece_off_centre_slides_round_until_it_fits():
    flat = grid(0.36, 0.4).reshape(-1, 2) + np.array([0.1, 0.0])
    rolled = roll(flat, PART, 0.03)
    assert rolled is not None
    assert rolled[:, 1].min() > -0.01


def test_a_piece_of_steady_width_has_no_cone():
    assert roll_on_cone(grid(0.24, 0.4).reshape(-1, 2), PART, 0.03) is None
