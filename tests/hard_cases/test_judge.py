"""The judge itself: what it must catch is shown to it, and the figures it reports are those of known shapes."""

import numpy as np
import pytest
from frame_judge import FrameJudge, enclosed_bone, principal_stretches, turns_around, winding_numbers
from pinched_skin import PinchedSkin
from small_scenes import icosphere, sheet


@pytest.fixture(scope="module")
def ball():
    return icosphere(0.1, 2)


@pytest.fixture
def over_ball(ball):
    """A sheet lying above the ball, and a judge for both."""
    vertices, faces = ball
    garment, x = sheet(9, 9, 0.3, 0.3)
    x[:, 1] += 0.11
    return x, vertices, FrameJudge(garment.faces, faces, x, vertices)


def test_clean_frame_is_clean(over_ball):
    cloth, body, judge = over_ball
    assert judge.judge(cloth, body).clean


def test_nan_is_caught(over_ball):
    cloth, body, judge = over_ball
    cloth[3, 1] = np.nan
    assert not judge.judge(cloth, body).finite


def test_crossing_the_body_is_caught(over_ball):
    cloth, body, judge = over_ball
    cloth[:, 1] -= 0.05
    assert judge.judge(cloth, body).body_intersecting


def test_a_single_vertex_through_the_skin_is_caught(over_ball):
    cloth, body, judge = over_ball
    cloth[np.argmin(np.linalg.norm(cloth[:, [0, 2]], axis=1)), 1] = 0.08
    assert judge.judge(cloth, body).body_intersecting


def test_crossing_itself_is_caught(over_ball):
    cloth, body, judge = over_ball
    right = cloth[:, 0] > 0.05
    cloth[right, 0] = 0.1 - cloth[right, 0]
    cloth[right, 1] += 0.02 * np.sign(cloth[right, 2] - 0.01)
    assert judge.judge(cloth, body).self_intersecting


def test_a_piece_wholly_inside_is_counted(ball):
    vertices, faces = ball
    garment, x = sheet(5, 5, 0.05, 0.05)
    verdict = FrameJudge(garment.faces, faces, x, vertices).judge(x, vertices)
    assert verdict.inside == 25
    assert not verdict.body_intersecting
    assert not verdict.clean


def test_winding_numbers_of_overlapping_balls(ball):
    """0 outside, 1 in one, 2 where two overlap."""
    vertices, faces = ball
    two = np.vstack([vertices, vertices + np.array([0.1, 0, 0])])
    both = np.vstack([faces, faces + len(vertices)])
    points = np.array([[0.3, 0, 0], [-0.05, 0, 0], [0.05, 0.0, 0.01]])
    np.testing.assert_allclose(winding_numbers(points, two, both), [0, 1, 2], atol=1e-6)


def test_principal_stretches_of_a_known_map():
    garment, x = sheet(4, 4, 0.2, 0.2)
    pulled = x * [1.2, 1.0, 0.9]
    found = principal_stretches(pulled, garment.faces, garment.uv_corners)
    np.testing.assert_allclose(found, np.tile([0.9, 1.2], (len(garment.faces), 1)), atol=1e-9)


def test_linking_number_of_loops_and_bones():
    angle = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    ring = np.column_stack([np.cos(angle), 0.1 * np.sin(3 * angle), -np.sin(angle)])
    up, down = np.array([0.2, 2.0, 0.1]), np.array([0.1, -2.0, 0.0])
    assert turns_around(ring, down, up) == 1
    assert turns_around(ring[::-1], down, up) == -1
    assert turns_around(ring, up, down) == -1
    assert turns_around(ring + np.array([3.0, 0, 0]), down, up) == 0
    twice = np.vstack([ring, 1.1 * ring])
    assert turns_around(twice, down, up) == 2


def test_enclosed_bone_is_the_nearest_one_encircled():
    angle = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    ring = np.column_stack([0.1 * np.cos(angle), 0.52 + 0 * angle, 0.1 * np.sin(angle)])
    joints = np.array([[0, 0, 0], [0, 0.5, 0], [0, 0.6, 0], [1.0, 0, 0]])
    parents = np.array([-1, 0, 1, 0])
    assert enclosed_bone(ring, joints, parents)[0] == 2
    with pytest.raises(ValueError, match="no bone"):
        enclosed_bone(ring + np.array([5.0, 0, 0]), joints, parents)


def test_pinched_skin_of_two_slabs_closing():
    """A body of two blocks joined at the bottom: nothing is pinched while they are apart, then facing, then covered."""
    vertices, faces = u_shape()
    reach = PinchedSkin.reach(1.8e-3, 2e-3)
    pinch = PinchedSkin(vertices, faces, reach)
    assert reach == pytest.approx(9.4e-3)
    right = vertices[:, 0] > 0.02

    def closed_to(gap):
        skin = vertices.copy()
        skin[right, 0] -= 0.06 - gap
        return skin

    assert not pinch.pinched(closed_to(0.03)).any()
    near = closed_to(0.006)
    assert not pinch.covered(near).any()
    assert pinch.facing(near).any()
    assert 0 < pinch.area(near, pinch.pinched(near)) < 0.2
    through = closed_to(-0.02)
    assert pinch.covered(through).any()
    assert pinch.depth(near) == 0
    assert pinch.depth(through) == pytest.approx(0.02, abs=5e-4)
    inside = winding_numbers(through - 1e-3 * pinch.normals(through)[1], through, faces) > 1.5
    # the tree's winding number is an approximation, felt in corners only
    assert (pinch.covered(through) != inside).mean() < 0.01


def u_shape():
    """Two pillars of 10 cm edge and 30 cm height, 6 cm apart, on a bridge: one closed surface."""
    import trimesh

    right = np.array([[0.0, 0.0], [0.13, 0.0], [0.13, 0.4], [0.03, 0.4], [0.03, 0.1], [0.0, 0.1]])
    outline = np.vstack([right[1:5], right[4:0:-1] * [-1, 1]])
    mesh = trimesh.Trimesh(*extruded(outline, 0.1), process=True).subdivide_to_size(0.03)
    mesh.merge_vertices()
    assert mesh.is_watertight
    assert mesh.volume > 0
    return np.array(mesh.vertices), np.array(mesh.faces, np.int32)


def extruded(outline, depth):
    """Vertices and outward faces of a prism over the U's outline, given counter-clockwise."""
    n = len(outline)
    front = np.column_stack([outline, np.full(n, depth / 2)])
    back = np.column_stack([outline, np.full(n, -depth / 2)])
    caps = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 7], [4, 5, 6], [4, 6, 7]]
    sides = [[[i, i + n, (i + 1) % n], [(i + 1) % n, i + n, (i + 1) % n + n]] for i in range(n)]
    faces = [*caps, *([a + n, c + n, b + n] for a, b, c in caps), *(t for pair in sides for t in pair)]
    return np.vstack([front, back]), np.array(faces)
