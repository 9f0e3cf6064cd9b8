"""Claims on a mesh that is kept through value edits: it lies on the new pattern, is sound, and is the start's.

Where the outline's vertices belong, and where the pattern places them, is worked out by formulas of the tests' own.
"""

from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pattern_measures import area, demo, edge_points, outline, placed, sewn, two_squares, vertices

from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import parse_pattern
from tryon_solver.geometry.size import in_size
from tryon_solver.redesign import edits
from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.drag import begin_drag
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.remesh import Remesh

GARMENTS = {"tshirt": demo("tshirt"), "dress": demo("dress"), "skirt": demo("skirt"), "tube": two_squares()}
EDGES = (0.06, 0.025)  # m
XI = 2e-4  # m
LENGTHS = st.floats(-0.06, 0.06)
MOVES = st.tuples(LENGTHS, LENGTHS)


@lru_cache
def drag(name, edge):
    pattern = parse_pattern(GARMENTS[name])
    return begin_drag(mesh_pattern(pattern, edge), pattern, XI)


def moved(start, spec):
    return start.moved(parse_pattern(spec))


def value_edits(spec):
    """One of every kind of value edit of everything that the garment has."""
    for name, panel in spec["pattern"]["panels"].items():
        yield edits.ScalePiece(name, (1.06, 0.97))
        for i in range(len(panel["edges"])):
            yield edits.MoveVertex(name, i, (0.012, -0.008))
            yield edits.MoveHandle(name, i, 0, (0.006, 0.009))
            yield edits.Lengthen(name, i, 0.015)
    for first, _ in (stitch[:2] for stitch in spec["pattern"]["stitches"]):
        yield edits.TakeIn(first["panel"], first["edge"], 0.008)
        yield edits.Gather(first["panel"], first["edge"])
        yield edits.Gather(first["panel"], first["edge"], 0.9)
        yield edits.Ease(first["panel"], first["edge"], 0.006)
    yield edits.ScaleGarment((1.1, 1.1))
    yield edits.ScaleGarment((0.95, 1.05))


def seen_from_the_right(spec, panel, points):
    """Complex points of a piece as (K, 2) m, mirrored where its outline turns clockwise."""
    polygon = outline(spec, panel, 65)
    clockwise = np.imag(np.conj(polygon) * np.roll(polygon, -1)).sum() < 0
    return np.stack([-points.real if clockwise else points.real, points.imag], axis=1)


def pieces(mesh, spec):
    """(name, its vertices, into how many parts its edges are cut) of every piece."""
    first = 0
    for index, name in enumerate(mesh.panel_names):
        count = len(spec["pattern"]["panels"][name]["edges"])
        yield name, np.flatnonzero(mesh.panel_of_vertex == index), mesh.segments[first : first + count]
        first += count


def assert_on_the_outline(mesh, spec):
    """Every edge's vertices cut it into equal lengths; what became one vertex is in the middle of what it joins."""
    for name, mine, segments in pieces(mesh, spec):
        count = int(segments.sum())
        at = 0
        wanted = [[] for _ in range(count)]
        for edge, n in enumerate(segments.tolist()):
            curve = edge_points(spec, name, edge)
            along = np.concatenate([[0], np.cumsum(np.abs(np.diff(curve)))])
            shares = np.linspace(0, along[-1], max(n, 1) + 1)[:-1]
            there = np.interp(shares, along, curve.real) + 1j * np.interp(shares, along, curve.imag)
            wanted[at % count].append(there[0])
            for k in range(1, n):
                wanted[at + k].append(there[k])
            at += n
        middle = np.array([np.mean(points) for points in wanted])
        assert np.abs(mesh.uv[mine[:count]] - seen_from_the_right(spec, name, middle)).max() < 2e-6, name


def assert_sound(mesh, spec):
    """Triangles that lie on their right side and are no slivers; together they cover each piece's area."""
    a, b, c = (mesh.uv[mesh.faces[:, k]] @ [1, 1j] for k in range(3))
    double_area = np.imag(np.conj(b - a) * (c - a))
    longest = np.max(np.abs([b - a, c - b, a - c]), axis=0)
    assert double_area.min() > 0
    assert (longest**2 / double_area).max() < 1000
    assert (double_area / longest).min() * 0.4 > XI
    for index, (name, _, _) in enumerate(pieces(mesh, spec)):
        covered = double_area[mesh.panel_of_face == index].sum() / 2
        assert covered == pytest.approx(area(spec, name), rel=0.02)


def assert_kept(mesh, start):
    """All but where things are is the start's."""
    assert mesh.panel_names == start.mesh.panel_names
    assert mesh.panel_labels == start.mesh.panel_labels
    for name in ("panel_of_vertex", "faces", "stitches", "seam_of_stitch", "sewn_edges", "segments"):
        assert np.array_equal(getattr(mesh, name), getattr(start.mesh, name)), name


def assert_placed(mesh, spec):
    """Every piece lies flat where the pattern places it."""
    for name, mine, _ in pieces(mesh, spec):
        flat = mesh.uv[mine] @ [1, 1j]
        drawn = seen_from_the_right(spec, name, flat) @ [1, 1j]  # the mirror image of one is the other
        assert np.abs(mesh.placed[mine] - placed(spec, name, drawn)).max() < 1e-12, name


@pytest.mark.parametrize(
    "name", ["skirt", "tube", *(pytest.param(name, marks=pytest.mark.long) for name in ("dress", "tshirt"))]
)
def test_every_value_edit_moves_the_mesh_onto_the_new_pattern(name):
    spec = GARMENTS[name]
    kept = told = 0
    for edit in value_edits(spec):
        try:
            made = apply(spec, edit)
        except EditError:
            continue
        assert made.change == "value"
        for edge in EDGES:
            mesh = moved(drag(name, edge), made.specification)
            if isinstance(mesh, Remesh):
                told += 1
                continue
            kept += 1
            assert_kept(mesh, drag(name, edge))
            assert_on_the_outline(mesh, made.specification)
            assert_placed(mesh, made.specification)
            assert_sound(mesh, made.specification)
    assert kept >= 20
    assert told <= 0.02 * kept


@pytest.mark.parametrize("edge", EDGES)
@pytest.mark.parametrize("name", sorted(GARMENTS))
def test_the_pattern_of_the_start_gives_the_mesh_of_the_start_to_the_last_bit(name, edge):
    start = drag(name, edge)
    mesh = moved(start, GARMENTS[name])
    assert np.array_equal(mesh.uv, start.mesh.uv)
    assert np.array_equal(mesh.placed, start.mesh.placed)


@pytest.mark.parametrize("name", sorted(GARMENTS))
def test_another_size_is_the_mesh_in_that_size(name):
    start = drag(name, EDGES[1])
    mesh = moved(start, apply(GARMENTS[name], edits.ScaleGarment((1.1, 1.1))).specification)
    wanted = in_size(start.mesh, 1.1)
    assert np.abs(mesh.uv - wanted.uv).max() < 1e-12
    assert np.abs(mesh.placed - wanted.placed).max() < 1e-12
    assert np.abs(mesh.uv - start.mesh.uv).max() > 0.02


def test_a_piece_that_is_made_wider_is_so_all_over():
    start = drag("tube", EDGES[1])
    mesh = moved(start, apply(GARMENTS["tube"], edits.ScalePiece("front", (1.2, 0.9))).specification)
    mine = mesh.panel_of_vertex == 0
    assert np.abs(mesh.uv[mine] - (0.2 + (start.mesh.uv[mine] - 0.2) * [1.2, 0.9])).max() < 1e-13


def test_a_piece_that_is_not_touched_stays_to_the_last_bit():
    start = drag("tshirt", EDGES[1])
    made = apply(GARMENTS["tshirt"], edits.Lengthen("front", 0, 0.03)).specification
    mesh = moved(start, made)
    assert not np.array_equal(mesh.uv, start.mesh.uv)
    for index, name in enumerate(mesh.panel_names):
        if np.array_equal(vertices(made, name), vertices(GARMENTS["tshirt"], name)):
            mine = mesh.panel_of_vertex == index
            assert np.array_equal(mesh.uv[mine], start.mesh.uv[mine])


@st.composite
def a_value_edit(draw, spec):
    panels = spec["pattern"]["panels"]
    panel = draw(st.sampled_from(sorted(panels)))
    edge = draw(st.integers(0, len(panels[panel]["edges"]) - 1))
    kinds = (edits.MoveVertex, edits.MoveHandle, edits.Lengthen, edits.TakeIn, edits.ScalePiece, edits.ScaleGarment)
    match draw(st.sampled_from(kinds)):
        case edits.MoveVertex:
            return edits.MoveVertex(panel, edge, draw(MOVES))
        case edits.MoveHandle:
            return edits.MoveHandle(panel, edge, 0, draw(MOVES))
        case edits.ScalePiece:
            return edits.ScalePiece(panel, draw(st.tuples(*[st.floats(0.7, 1.4)] * 2)))
        case edits.ScaleGarment:
            return edits.ScaleGarment((draw(st.floats(0.7, 1.4)),) * 2)
        case kind:
            return kind(panel, edge, draw(LENGTHS))


@settings(max_examples=30)
@given(st.sampled_from(sorted(GARMENTS)), st.sampled_from(EDGES), st.data())
def test_after_any_value_edits_the_mesh_is_sound_or_the_piece_and_the_reason_are_told(name, edge, data):
    start, spec = drag(name, edge), GARMENTS[name]
    for _ in range(4):
        try:
            spec = apply(spec, data.draw(a_value_edit(spec))).specification
        except EditError:
            continue
        mesh = moved(start, spec)
        if isinstance(mesh, Remesh):
            assert mesh.place in start.mesh.panel_names
            assert repr(mesh.place) in mesh.message
            continue
        assert_kept(mesh, start)
        assert_on_the_outline(mesh, spec)
        assert_sound(mesh, spec)


def test_a_drag_ends_where_its_last_edit_alone_would():
    spec = GARMENTS["skirt"]
    pattern = parse_pattern(spec)
    mesh = mesh_pattern(pattern, EDGES[0])
    start = begin_drag(mesh, pattern, XI)
    before = mesh.uv.copy()
    for by in np.linspace(0.001, 0.05, 100):
        made = apply(spec, edits.Lengthen("skirt_front", 0, by)).specification
        last = moved(start, made)
    alone = moved(begin_drag(mesh, pattern, XI), made)
    assert np.array_equal(last.uv, alone.uv)
    assert np.array_equal(last.placed, alone.placed)
    assert np.array_equal(mesh.uv, before)


def test_the_next_drag_starts_where_one_ended():
    made = apply(GARMENTS["tshirt"], edits.MoveVertex("front", 2, (0.02, -0.01))).specification
    mesh = moved(drag("tshirt", EDGES[0]), made)
    following = begin_drag(mesh, parse_pattern(made), XI)
    assert np.array_equal(moved(following, made).uv, mesh.uv)
    again = apply(made, edits.MoveVertex("front", 2, (-0.03, 0.02))).specification
    assert_on_the_outline(moved(following, again), again)


def test_corners_that_became_one_vertex_stay_one_between_them():
    def cornered(short):
        corners = [[0, 0], [40, 0], [40, 40 - short], [40 - short, 40], [0, 40]]
        panel = {"vertices": corners, "edges": [{"endpoints": [i, (i + 1) % 5]} for i in range(5)]}
        around = (("front", edge, "back", edge, "right_wrong") for edge in (1, 2, 3))
        return sewn({"front": panel, "back": panel}, *around)

    pattern = parse_pattern(cornered(1.2))
    start = begin_drag(mesh_pattern(pattern, EDGES[0]), pattern, XI)
    assert start.mesh.segments[2] == start.mesh.segments[7] == 0
    for short in (0.6, 2.5):
        mesh = moved(start, cornered(short))
        assert_kept(mesh, start)
        assert_on_the_outline(mesh, cornered(short))
        at = mesh.uv[start.mesh.segments[:2].sum()]
        assert at == pytest.approx([0.4 - short / 200] * 2, abs=1e-9)
