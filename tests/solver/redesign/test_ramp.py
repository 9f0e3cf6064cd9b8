"""Claims on the way from one shape of a mesh to another: straight, and refused exactly when a triangle is."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from pattern_measures import demo, rectangle, sewn

from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import parse_pattern
from tryon_solver.redesign import edits
from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.drag import begin_drag
from tryon_solver.redesign.ramp import Ramp, begin_ramp
from tryon_solver.redesign.remesh import Remesh

LIMIT = 1000
TRIANGLE = mesh_pattern(parse_pattern(sewn({"front": rectangle(20, 20)})), 0.2)
COORDINATE = st.floats(-1, 1)
CORNERS = st.tuples(*[st.tuples(COORDINATE, COORDINATE)] * 3)


def slack(corners):
    """LIMIT times twice the signed area, less the longest side's square, (K,) m^2, of triangles (K, 3) complex m."""
    a, b, c = corners.T
    sides = np.abs([b - a, c - b, a - c])
    return LIMIT * np.imag(np.conj(b - a) * (c - a)) - np.max(sides, axis=0) ** 2


def least_slack(before, after):
    """The least slack on the straight way from one triangle (3,) complex m to another, found by looking finer twice."""
    low, high = 0.0, 1.0
    least = np.inf
    for _ in range(3):
        shares = np.linspace(low, high, 2001)[:, None]
        values = slack((1 - shares) * before + shares * after)
        at = int(np.argmin(values))
        least = min(least, values[at])
        low, high = shares[max(at - 1, 0), 0], shares[min(at + 1, 2000), 0]
    return least


def one_triangle(corners):
    """A mesh of one triangle with these corners."""
    uv = np.stack([np.real(corners), np.imag(corners)], axis=1)
    return replace(
        TRIANGLE, uv=uv, faces=np.array([[0, 1, 2]], np.int32), panel_of_vertex=np.zeros(3, np.int32), placed=uv
    )


@settings(max_examples=400)
@given(CORNERS, CORNERS)
@example(((0, 0), (1, 0), (0, 1)), ((0, 0), (-1, 0), (0, -1)))
@example(((0, 0), (1, 0), (0, 1)), ((0, 0), (-1, 0.1), (-0.1, -1)))
@example(((0, 0), (1, 0), (0, 1)), ((0, 0), (-1, 0.1), (-0.1, -0.5)))
@example(((0, 0), (1, 0), (0, 0.002)), ((0, 0), (0.002, 0), (0, 1)))
@example(((0, 0), (1, 0), (0, 0.002)), ((0, 0), (0.002, 0.9), (-0.9, 0.01)))
@example(((0, 0), (1, 0), (1, 0.002)), ((0, 0), (0, 1), (-0.002, 1)))
def test_a_triangle_is_refused_exactly_when_it_turns_over_or_is_too_flat_on_the_way(before, after):
    before, after = (np.array(corners) @ [1, 1j] for corners in (before, after))
    wanted = least_slack(before, after)
    assume(abs(wanted) > 1e-9 or wanted == 0)  # nearer, rounding decides
    assert isinstance(begin_ramp(one_triangle(before), one_triangle(after)), Ramp) == (wanted > 0)


@pytest.mark.parametrize("side", [0, 1, 2])
@pytest.mark.parametrize(("height", "sound"), [(0.0011, True), (0.0009, False)])
def test_whichever_side_is_the_longest_counts(side, height, sound):
    flat = one_triangle(np.roll([0, 1, 0.5 + 1j * height], side))
    larger = replace(flat, uv=2 * flat.uv)
    assert isinstance(begin_ramp(flat, larger), Ramp) == sound


def test_triangles_of_all_kinds_are_drawn():
    """Some that are sound at both ends go over in between, some do not: both answers of the claim above are tried."""
    rng = np.random.default_rng(3)
    answers = []
    while len(answers) < 200:
        corners = rng.uniform(-1, 1, (2, 3, 2)) @ [1, 1j]
        if (slack(corners) > 1e-3).all():
            found = isinstance(begin_ramp(*map(one_triangle, corners)), Ramp)
            assert found == (least_slack(*corners) > 0)
            answers.append(found)
    assert 20 <= sum(answers) <= 180


def dragged(edge_length=0.04):
    spec = demo("tshirt")
    pattern = parse_pattern(spec)
    start = begin_drag(mesh_pattern(pattern, edge_length), pattern, 1e-4)
    made = [apply(spec, edit) for edit in (edits.Lengthen("front", 0, 0.1), edits.TakeIn("front", 1, 0.03))]
    return start.mesh, *(start.moved(parse_pattern(each.specification)) for each in made)


def test_a_ramp_runs_straight_from_one_mesh_to_the_other_and_can_be_left_for_a_third():
    first, second, third = dragged()
    ramp = begin_ramp(first, second)
    assert np.array_equal(ramp.at(0.0).uv, first.uv)
    assert np.array_equal(ramp.at(1.0).uv, second.uv)
    middle = ramp.at(0.25)
    assert np.abs(middle.uv - first.uv - 0.25 * (second.uv - first.uv)).max() < 1e-15
    assert np.abs(middle.uv - first.uv).max() > 0.01
    for name in ("faces", "stitches", "sewn_edges", "panel_of_vertex", "segments"):
        assert np.array_equal(getattr(middle, name), getattr(first, name))
    assert np.array_equal(middle.placed, second.placed)
    onwards = begin_ramp(middle, third)
    assert np.array_equal(onwards.at(0.0).uv, middle.uv)
    assert np.array_equal(onwards.at(1.0).uv, third.uv)
    for share in np.linspace(0, 1, 41):
        corners = onwards.at(share).uv[first.faces] @ [1, 1j]
        assert slack(corners).min() > 0


def test_a_way_on_which_fabric_folds_is_refused_with_the_piece():
    first, _, _ = dragged()
    name = "right_sleeve_back"
    mine = first.panel_of_vertex == first.panel_names.index(name)
    turned = first.uv.copy()
    turned[mine] = first.uv[mine].mean(axis=0) * 2 - turned[mine]
    why = begin_ramp(first, replace(first, uv=turned))
    assert isinstance(why, Remesh)
    assert why.place == name
    assert repr(name) in why.message


@pytest.mark.parametrize(("degrees", "sound"), [(90, True), (170, True), (180, False)])
def test_a_turn_is_a_way_up_to_half_a_circle(degrees, sound):
    first, _, _ = dragged()
    turned = first.uv @ [1, 1j] * np.exp(1j * np.radians(degrees))
    after = replace(first, uv=np.stack([turned.real, turned.imag], axis=1))
    assert isinstance(begin_ramp(first, after), Ramp) == sound
