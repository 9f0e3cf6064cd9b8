"""Polygons of any outline are cut into triangles that fill them."""

import numpy as np
import pytest

from tryon_solver.files.obj import parse_obj
from tryon_solver.files.polygon import cut

ARROW = [(0, 0, 0), (2, 0, 0), (0.5, 0.5, 0), (0, 2, 0)]
CORNER = [(0, 0, 0), (2, 0, 0), (2, 1, 0), (1, 1, 0), (1, 2, 0), (0, 2, 0)]
ON_SIDES = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0), (3, 1, 0), (3, 2, 0), (0, 3, 0)]
KEYHOLE = [(0, 0, 0), (4, 0, 0), (4, 4, 0), (0, 4, 0), (0, 0, 0), (1, 1, 0), (1, 3, 0), (3, 3, 0), (3, 1, 0), (1, 1, 0)]
SQUARE_WITH_A_CORNER_TOO_MANY = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (1, 3, 0)]
STAR = [((1.0 + k % 2) * np.cos(np.pi * k / 8), (1.0 + k % 2) * np.sin(np.pi * k / 8), 0.0) for k in range(16)]


def areas(points, triangles):
    """Of the polygon and of each triangle, along the polygon's normal."""
    p = np.array(points, float)
    whole = 0.5 * np.cross(p, np.roll(p, -1, axis=0)).sum(axis=0)
    size = np.linalg.norm(whole)
    each = [0.5 * np.cross(p[b] - p[a], p[c] - p[a]) @ whole / size for a, b, c in triangles]
    return size, np.array(each)


@pytest.mark.parametrize("polygon", [ARROW, CORNER, ON_SIDES, KEYHOLE, SQUARE_WITH_A_CORNER_TOO_MANY, STAR])
def test_triangles_fill_a_polygon_and_none_is_turned_over_or_flat(polygon):
    """Wherever it begins, in either sense, and however it lies in space."""
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    for points in (polygon, polygon[::-1]):
        for start in range(len(points)):
            lies = (np.array(points[start:] + points[:start]) @ turn.T + 5.0).tolist()
            triangles, sound = cut(lies, range(len(lies)))
            whole, each = areas(lies, triangles)
            assert sound
            assert len(triangles) == len(lies) - 2
            assert each.min() > 1e-3 * whole
            assert each.sum() == pytest.approx(whole)


@pytest.mark.parametrize("steps", [2, 20])
def test_corners_on_straight_sides_leave_no_slivers_though_they_are_rounded(steps):
    """An exporter writes six digits: what is straight is bent a little, in or out."""
    u = np.linspace(0, 1, steps, endpoint=False)
    sides = [(u, 0 * u), (0 * u + 1, u), (1 - u, 0 * u + 1), (0 * u, 1 - u)]
    square = np.concatenate([np.column_stack([x, y, 0 * x]) for x, y in sides])
    rounded = (square + np.random.default_rng(2).normal(0, 3e-7, square.shape)).tolist()
    triangles, sound = cut(rounded, range(len(rounded)))
    whole, each = areas(rounded, triangles)
    assert sound
    assert each.min() > 0.1 * whole / steps**2
    quad = [(0.0, 0.0, 0.0), (1.0, -1e-6, 0.0), (2.0, 0.0, 0.0), (1.0, 3.0, 0.0)]
    assert areas(quad, cut(quad, range(4))[0])[1].min() > 1.0


def _comb(teeth, depth):
    back = [(0, 0), (2 * teeth - 1, 0)]
    for k in range(teeth - 1, -1, -1):
        gap = [(2 * k, 1), (2 * k - 1, 1)] if k else []
        back += [(2 * k + 1, depth + 1), (2 * k, depth + 1), *gap]
    return back


def _with_corners_on_its_sides(corners, steps):
    """`steps` edges along each unit of a side."""
    ends = np.array(corners, float)
    sides = []
    for a, b in zip(ends, np.roll(ends, -1, axis=0)):
        count = steps * int(np.abs(b - a).max())
        sides.append(a + (b - a) * np.arange(count)[:, None] / count)
    return np.concatenate(sides)


LETTERS = {
    "L": [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)],
    "T": [(0, 0), (1, 0), (1, 1), (2, 1), (2, 2), (-1, 2), (-1, 1), (0, 1)],
    "U": _comb(2, 1),
    "comb": _comb(3, 2),
}


@pytest.mark.parametrize("steps", [1, 2])
@pytest.mark.parametrize("letter", LETTERS)
def test_concave_polygons_of_a_file_leave_no_triangle_without_area(letter, steps):
    """Sheared, turned in space, in metres of six decimals: the corners on their sides are bent in and out."""
    rng = np.random.default_rng(4)
    outline = _with_corners_on_its_sides(LETTERS[letter], steps)
    for _ in range(500):
        sheared = 0.03 * outline @ (np.eye(2) + rng.normal(0, 0.15, (2, 2)))
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        lies = (np.column_stack([sheared, 0 * sheared[:, 0]]) @ turn + rng.normal(size=3)).round(6)
        points = np.roll(lies, int(rng.integers(len(lies))), axis=0).tolist()
        triangles, sound = cut(points, range(len(points)))
        whole, each = areas(points, triangles)
        assert sound
        assert each.min() > 0.1 * whole / len(points)
        assert each.sum() == pytest.approx(whole)


def test_both_copies_of_a_polygon_are_cut_alike():
    rng = np.random.default_rng(5)
    for _ in range(200):
        count = int(rng.integers(4, 24))
        angle = 2 * np.pi * np.arange(count) / count
        radius = rng.uniform(0.3, 1.0, count)
        points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0.05 * rng.normal(size=count)])
        names = rng.permutation(100)[:count]
        other = np.roll(np.arange(count)[::-1], int(rng.integers(count)))
        first, _ = cut(points.tolist(), names.tolist())
        second, _ = cut(points[other].tolist(), names[other].tolist())
        assert {frozenset(names[list(t)]) for t in first} == {frozenset(names[other[list(t)]]) for t in second}


def test_a_polygon_of_a_thousand_corners_is_filled():
    angle = np.linspace(0, 2 * np.pi, 1000, endpoint=False)
    radius = 1 + 0.5 * (np.arange(1000) % 2)
    points = np.column_stack([radius * np.cos(angle), 0 * angle, radius * np.sin(angle)]).tolist()
    triangles, sound = cut(points, range(1000))
    whole, each = areas(points, triangles)
    assert sound
    assert each.min() > 0
    assert each.sum() == pytest.approx(whole)


@pytest.mark.parametrize(
    "polygon", [[0, 2, 1, 3], [0, 1, 5, 4], [0, 6, 3, 2, 1]], ids=["crosses itself", "flat", "five that cross"]
)
def test_a_polygon_that_can_not_be_filled_is_told_by_its_line(polygon):
    points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (3, 0, 0), (2, 0, 0), (0.4, 2, 0)]
    text = "".join("v {} {} {}\n".format(*p) for p in points) + "f 1 2 3\nf " + " ".join(str(k + 1) for k in polygon)
    mesh = parse_obj(text, "shirt.obj")
    assert len(mesh.faces) == len(polygon) - 1
    (note,) = mesh.notes
    assert note.startswith("1 of its polygons cross or cover themselves, or have no area (shirt.obj, line 9)")
    assert parse_obj(text.rsplit("\n", 1)[0]).notes == ()


def test_a_corner_named_twice_in_a_row_is_one():
    square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
    assert len(parse_obj(square + "f 1 2 2 3 4 1\n").faces) == 2
    assert parse_obj(square + "f 1 2 2 3 4 1\n").notes == ()
    assert len(parse_obj(square + "f 1 2 2\n").faces) == 1


def test_a_pieces_outline_as_one_polygon_becomes_its_fabric():
    """A front with a deep neck, as one n-gon: a fan would cover the neck, and itself."""
    front = [(0, 0), (40, 0), (40, 55), (28, 60), (25, 45), (15, 45), (12, 60), (0, 55)]
    text = "".join(f"v {x} {y} 0\nvt {x} {y}\n" for x, y in front)
    mesh = parse_obj(text + "f " + " ".join(f"{k + 1}/{k + 1}" for k in range(len(front))))
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    neck, shoulders = 0.5 * (10 + 16) * 15, 2 * 0.5 * 12 * 5 + 16 * 5
    fabric = 40 * 55 + shoulders - neck
    np.testing.assert_allclose(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum(), fabric)
    np.testing.assert_array_equal(mesh.uv, mesh.vertices[mesh.faces][..., :2])
