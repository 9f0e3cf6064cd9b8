"""Claims on when a mesh is given up in a drag: another structure, triangles that the solver refuses, another start."""

import numpy as np
import pytest
from pattern_measures import demo, rectangle, sewn, two_squares

from tryon_solver.geometry.panel_mesh import PanelMesh, mesh_pattern
from tryon_solver.geometry.pattern import parse_pattern
from tryon_solver.geometry.size import in_size
from tryon_solver.redesign import edits
from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.drag import begin_drag
from tryon_solver.redesign.remesh import Remesh

EDGES = (0.06, 0.025)  # m
XI = 2e-4  # m
GARMENTS = {"tshirt": demo("tshirt"), "skirt": demo("skirt"), "tube": two_squares()}


def drag(name, edge):
    pattern = parse_pattern(GARMENTS[name])
    return begin_drag(mesh_pattern(pattern, edge), pattern, XI)


def moved(start, spec):
    return start.moved(parse_pattern(spec))


@pytest.mark.parametrize(
    ("edit", "piece"),
    [
        (edits.Dart("back", 0, 0.5, 0.03, 0.1), "back"),
        (edits.Cut("front", ((-0.9, 0.2), (0.9, 0.2)), True), None),
        (edits.OpenSeam("front", 1), "front"),
        (edits.RemovePiece("left_sleeve_front"), "left_sleeve_front"),
    ],
    ids=lambda value: getattr(value, "kind", value),
)
def test_what_changes_the_structure_is_told_as_such(edit, piece, tshirt):
    made = apply(tshirt, edit)
    assert made.change == "topology"
    why = moved(drag("tshirt", EDGES[0]), made.specification)
    assert isinstance(why, Remesh)
    assert why.place == piece or piece is None
    assert repr(why.place) in why.message


def test_a_seam_sewn_the_other_way_round_needs_another_mesh(tube):
    tube["pattern"]["stitches"][0].append("right_wrong")
    why = moved(drag("tube", EDGES[0]), tube)
    assert why == Remesh("'front' is sewn otherwise at edge 1", "front")


def test_pieces_in_another_order_need_another_mesh(tube):
    tube["pattern"]["panel_order"] = ["back", "front"]
    why = moved(drag("tube", EDGES[0]), tube)
    assert why == Remesh("the pieces come in another order, 'back' first", "back")


def test_a_piece_that_is_turned_over_needs_another_mesh(tube):
    for corner in tube["pattern"]["panels"]["back"]["vertices"]:
        corner[0] *= -1
    why = moved(drag("tube", EDGES[0]), tube)
    assert isinstance(why, Remesh)
    assert why.place == "back"
    assert "turned over" in why.message


def notched(depth, width=2.0):
    """A square of 40 cm with a notch in its upper edge, cm deep, the notch's ends at half height to either side."""
    corners = [[0, 0], [40, 0], [40, 40], [20 + width, 40], [20, 40 - depth], [20 - width, 40], [0, 40]]
    panel = {"vertices": corners, "edges": [{"endpoints": [i, (i + 1) % 7]} for i in range(7)]}
    return sewn({"front": panel})


@pytest.mark.parametrize("turn", [1, -1], ids=["counter-clockwise", "clockwise"])
def test_what_would_fold_is_told_with_the_place_where_it_is_drawn(turn):
    def to_the_right(depth):
        spec = notched(depth, 18.0)
        panel = spec["pattern"]["panels"]["front"]
        panel["vertices"] = [[x + 100, y] for x, y in panel["vertices"]]
        if turn < 0:
            panel["edges"] = [{"endpoints": edge["endpoints"][::-1]} for edge in panel["edges"][::-1]]
        return spec

    pattern = parse_pattern(to_the_right(2.0))
    start = begin_drag(mesh_pattern(pattern, EDGES[1]), pattern, XI)
    why = moved(start, to_the_right(38.0))
    assert isinstance(why, Remesh)
    assert why.place == "front"
    place = why.message.partition("fold over itself near (")[2]
    assert 100 < float(place.partition(",")[0]) < 140


def aspects(uv, faces):
    """The longest side over the altitude on it, and that altitude in m, of every triangle."""
    a, b, c = (uv[faces[:, k]] @ [1, 1j] for k in range(3))
    longest = np.max(np.abs([b - a, c - b, a - c]), axis=0)
    altitude = np.imag(np.conj(b - a) * (c - a)) / longest
    return longest / altitude, altitude


@pytest.mark.parametrize(("aspect", "told"), [(980, False), (1020, True)])
def test_what_would_be_almost_without_width_is_told(aspect, told):
    pattern = parse_pattern(sewn({"front": rectangle(40, 40)}))
    mesh = mesh_pattern(pattern, EDGES[1])
    heights = np.geomspace(0.1, 1.0, 400)  # cm, of a piece 3 m wide
    worst = [aspects(mesh.uv * [300 / 40, height / 40], mesh.faces)[0].max() for height in heights]
    height = np.interp(-aspect, -np.array(worst), heights)
    made = moved(begin_drag(mesh, pattern, 0.0), sewn({"front": rectangle(300, height)}))
    assert isinstance(made, Remesh if told else PanelMesh)
    assert not told or "'front' is squeezed so far" in made.message


@pytest.mark.parametrize(("share", "told"), [(0.39, False), (0.41, True)])
def test_what_would_be_too_low_for_the_thickness_is_told_with_both(share, told):
    pattern = parse_pattern(sewn({"front": rectangle(40, 40)}))
    mesh = mesh_pattern(pattern, EDGES[1])
    low = aspects(mesh.uv * [1, 0.1], mesh.faces)[1].min()
    made = moved(begin_drag(mesh, pattern, share * low), sewn({"front": rectangle(40, 4)}))
    assert isinstance(made, Remesh if told else PanelMesh)
    assert not told or f"only {1e3 * low:.2f} mm high" in made.message
    assert not told or f"{1e3 * share * low:.2f} mm thick" in made.message


def test_a_mesh_of_another_pattern_or_size_starts_no_drag():
    pattern = parse_pattern(GARMENTS["tube"])
    mesh = mesh_pattern(pattern, EDGES[0])
    with pytest.raises(ValueError, match="not in its own size"):
        begin_drag(in_size(mesh, 1.01), pattern, XI)
    with pytest.raises(ValueError, match="other pieces"):
        begin_drag(mesh, parse_pattern(GARMENTS["skirt"]), XI)
