"""Claims on mirrored edits: the garment stays its own mirror image, or the reason why there is none is given."""

from copy import deepcopy

import numpy as np
import pytest
from pattern_measures import area, demo, outline, placed, rectangle, seams, sewn

from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import parse_pattern
from tryon_solver.redesign import edits
from tryon_solver.redesign.apply import apply
from tryon_solver.redesign.both_sides import apply_to_both
from tryon_solver.redesign.edit_error import EditError
from tryon_solver.redesign.mirroring import mirrored


def asymmetry(spec):
    """How far, m, the corners of the placed pieces and points between are from their mirror images, at most.

    A point has an image when one of the same piece or another lies where it is seen in the mirror x = 0.
    """
    points = np.vstack([placed(spec, name, outline(spec, name, 9)) for name in spec["pattern"]["panels"]])
    images = points * [-1, 1, 1]
    return max(float(np.linalg.norm(points - image, axis=1).min()) for image in images)


BOTH = {
    "vertex": edits.MoveVertex("front", 2, (0.02, -0.01)),
    "vertex of a sleeve": edits.MoveVertex("left_sleeve_front", 2, (0.02, -0.01)),
    "handle": edits.MoveHandle("front", 4, 0, (0.01, -0.02)),
    "handle of a sleeve": edits.MoveHandle("right_sleeve_back", 0, 1, (0.005, 0.01)),
    "two handles of one edge": edits.MoveHandle("front", 0, 0, (0.0, -0.02)),
    "sleeve": edits.Lengthen("left_sleeve_front", 2, 0.1),
    "side": edits.TakeIn("front", 1, 0.015),
    "under the arm": edits.TakeIn("right_sleeve_front", 2, -0.01),
    "piece": edits.ScalePiece("left_sleeve_back", (1.1, 0.95)),
    "removed": edits.RemovePiece("left_sleeve_back"),
    "cut of a sleeve": edits.Cut("left_sleeve_front", ((0.15, -1.0), (0.12, 1.0)), True),
    "cut of a corner": edits.Cut("front", ((-0.5, 0.2), (0.05, -0.2)), True),
    "dart": edits.Dart("front", 0, 0.3, 0.03, 0.1),
    "dart at the side": edits.Dart("back", 1, 0.3, 0.03, 0.1),
}


@pytest.mark.parametrize("name", BOTH)
def test_an_edit_of_both_sides_leaves_the_garment_symmetric(tshirt, name):
    assert asymmetry(tshirt) < 1e-9
    before = deepcopy(tshirt)
    made = apply_to_both(tshirt, BOTH[name])
    assert tshirt == before
    assert asymmetry(made.specification) < 1e-6
    assert asymmetry(apply(tshirt, BOTH[name]).specification) > 1e-3, "of one side it is not"
    assert not any(note.startswith("done once") for note in made.notes)
    mesh_pattern(parse_pattern(made.specification), 0.03)


@pytest.mark.parametrize("name", [name for name, edit in BOTH.items() if not isinstance(edit, edits.Cut | edits.Dart)])
def test_the_image_of_the_image_is_the_edit(tshirt, name):
    image = mirrored(tshirt, BOTH[name])
    assert image.edit != BOTH[name]
    assert image.reason == ""
    assert mirrored(tshirt, image.edit).edit == BOTH[name]


SEAMS = {
    "gather": (edits.Gather("left_sleeve_front", 0), edits.Gather("right_sleeve_front", 3)),
    "ease": (edits.Ease("front", 3), edits.Ease("front", 6)),
    "open": (edits.OpenSeam("front", 1), edits.OpenSeam("front", 8)),
    "close": (
        edits.CloseSeam("front", 4, "left_sleeve_back", 1, gather=True),
        edits.CloseSeam("front", 5, "right_sleeve_back", 2, gather=True),
    ),
}


@pytest.mark.parametrize("name", SEAMS)
def test_seams_of_the_other_side_are_found(tshirt, name):
    edit, image = SEAMS[name]
    assert mirrored(tshirt, edit).edit == image


def test_opening_both_sides_opens_two_seams(tshirt):
    made = apply_to_both(tshirt, edits.OpenSeam("left_sleeve_front", 1)).specification
    assert len(seams(made)) == len(seams(tshirt)) - 2
    assert not any("left_sleeve_front" in str(pair) and "('left_sleeve_back', 2)" in str(pair) for pair in seams(made))


ITSELF = "it is its own mirror image"
NONE = {
    "vertex in the middle": (edits.MoveVertex("front", 5, (0.01, 0.01)), ITSELF),
    "hem": (edits.Lengthen("front", 0, 0.1), ITSELF),
    "symmetric piece": (edits.ScalePiece("front", (1.1, 1.0)), ITSELF),
    "level cut": (edits.Cut("front", ((-1.0, 0.2), (0.5, 0.2))), ITSELF),
    "upright cut": (edits.Cut("front", ((0.0, -1.0), (0.0, 1.0))), ITSELF),
    "dart in the middle": (edits.Dart("front", 0, 0.5, 0.03, 0.1), ITSELF),
    "garment": (edits.ScaleGarment((1.1, 1.1)), "it is of the whole garment"),
}


@pytest.mark.parametrize("name", NONE)
def test_what_is_its_own_image_is_done_once(tshirt, name):
    edit, reason = NONE[name]
    image = mirrored(tshirt, edit)
    assert (image.edit, image.reason) == (None, reason)
    once, both = apply(tshirt, edit), apply_to_both(tshirt, edit)
    assert both.specification == once.specification
    assert both.change == once.change
    assert both.notes == (*once.notes, f"done once: {reason}")


def test_what_meets_its_own_image_is_refused_as_that_and_may_be_made_alone(tshirt):
    """A patch across the middle of the front; one that lies over the edge is refused for itself."""
    middle = edits.Patch("front", (0.03, 0.1), 0.08, 0.08, 0.0)
    overlapping = r"^panels\.patch_2\.on\.at: on both sides .*'patch_2' and 'patch' overlap"
    with pytest.raises(EditError, match=overlapping) as refused:
        apply_to_both(tshirt, middle)
    assert refused.value.remedy.endswith("or on one side alone")
    apply(tshirt, middle)
    with pytest.raises(EditError, match=r"^panels\.patch\.on\.at: it would .*'patch' reaches over the edge"):
        apply_to_both(tshirt, edits.Patch("front", (0.03, -0.4), 0.08, 0.08, 0.0))


def test_a_seam_between_mirror_images_is_its_own():
    # The trousers' way: a left and a right piece, sewn in the middle.
    panels = {"left": rectangle(20, 40, translation=[2, 0, 10]), "right": rectangle(20, 40, translation=[-22, 0, 10])}
    spec = sewn(panels, ("left", 3, "right", 1))
    assert mirrored(spec, edits.TakeIn("left", 3, 0.01)).reason == ITSELF
    assert mirrored(spec, edits.Lengthen("left", 1, 0.01)).edit == edits.Lengthen("right", 3, 0.01)
    assert mirrored(spec, edits.CloseSeam("left", 1, "right", 3)).reason == ITSELF


@pytest.mark.parametrize(("moved", "found"), [(0.8, True), (1.2, False)])
def test_pieces_are_symmetric_within_a_centimetre(tshirt, moved, found):
    tshirt["pattern"]["panels"]["right_sleeve_front"]["translation"][1] += moved
    image = mirrored(tshirt, edits.Lengthen("left_sleeve_front", 2, 0.1))
    assert (image.edit is not None) == found
    assert found or image.reason == "no piece is the mirror image of 'left_sleeve_front' to within 1 cm"


def test_another_shape_in_the_same_place_is_no_image(tshirt):
    tshirt["pattern"]["panels"]["right_sleeve_front"]["edges"][1]["curvature"] = [0.5, 0.2]
    assert mirrored(tshirt, edits.RemovePiece("left_sleeve_front")).edit is None
    assert apply_to_both(tshirt, edits.RemovePiece("left_sleeve_front")).notes[-1].startswith("done once: no piece is")


@pytest.mark.parametrize("turned", [90, 30])
def test_a_mirror_image_drawn_at_another_angle_is_found(turned):
    """The right piece is drawn turned in its plane, and turned back where it is placed."""
    spec = demo("tshirt")
    right = spec["pattern"]["panels"]["right_sleeve_front"]
    turn = np.exp(1j * np.radians(turned))
    points = [complex(*point) * turn for point in right["vertices"]]
    right["vertices"] = [[point.real, point.imag] for point in points]
    right["rotation"][2] -= turned
    assert asymmetry(spec) < 1e-9
    made = apply_to_both(spec, edits.MoveVertex("left_sleeve_front", 2, (0.02, -0.01))).specification
    assert asymmetry(made) < 1e-6
    wide = mirrored(spec, edits.ScalePiece("left_sleeve_front", (1.2, 0.9)))
    if turned == 90:
        assert wide.edit == edits.ScalePiece("right_sleeve_front", (0.9, 1.2))
    else:
        assert "drawn at another angle" in wide.reason
        assert mirrored(spec, edits.ScalePiece("left_sleeve_front", (1.2, 1.2))).edit is not None


def run_backwards(spec, name):
    """Lists the edges of a piece the other way around, nothing moved: seams then join starts to starts."""
    panel = spec["pattern"]["panels"][name]
    last = len(panel["edges"]) - 1
    backwards = []
    for edge in panel["edges"][::-1]:
        turned = {"endpoints": edge["endpoints"][::-1]}
        if "curvature" in edge:
            params = [[1 - u, -v] for u, v in edge["curvature"]["params"][::-1]]
            turned["curvature"] = {"type": "cubic", "params": params}
        backwards.append(turned)
    panel["edges"] = backwards
    for stitch in spec["pattern"]["stitches"]:
        for side in stitch[:2]:
            if side["panel"] == name:
                side["edge"] = last - side["edge"]
                stitch.append("right_wrong")


RUN_BACKWARDS = [
    edits.MoveHandle("left_sleeve_front", 0, 0, (0.005, 0.01)),
    edits.MoveVertex("left_sleeve_front", 1, (0.005, 0.01)),
    edits.Dart("left_sleeve_front", 2, 0.3, 0.02, 0.05),
    edits.Dart("left_sleeve_front", 1, 0.3, 0.01, 0.03),
]


@pytest.mark.parametrize("edit", RUN_BACKWARDS, ids=lambda edit: f"{edit.kind} {getattr(edit, 'edge', '')}")
def test_a_mirror_image_whose_edges_run_the_other_way_is_found(tshirt, edit):
    run_backwards(tshirt, "right_sleeve_front")
    assert asymmetry(tshirt) < 1e-9
    made = apply_to_both(tshirt, edit)
    assert not any(note.startswith("done once") for note in made.notes)
    assert asymmetry(made.specification) < 1e-6
    mesh_pattern(parse_pattern(made.specification), 0.03)


def test_cuts_that_cross_each_other_cut_both_parts(tube):
    # Two diagonals of the front: four parts.
    edit = edits.Cut("front", ((-0.1, -0.1), (0.5, 0.5)), True)
    made = apply_to_both(tube, edit).specification
    parts = [name for name in made["pattern"]["panels"] if name.startswith("front")]
    assert sorted(parts) == ["front", "front_2", "front_2_2", "front_3"]
    assert [area(made, part) for part in parts] == pytest.approx([0.04] * 4)
    assert asymmetry(made) < 1e-9


@pytest.mark.parametrize(
    ("edit", "place"),
    [
        (edits.RemovePiece("xyz"), "panel"),
        (edits.MoveVertex("front", 9, (0, 0)), "vertex"),
        (edits.MoveHandle("front", 0, 2, (0, 0)), "handle"),
        (edits.Lengthen("front", 9, 0.1), "edge"),
        (edits.TakeIn("front", 0, 0.1), "edge"),
        (edits.CloseSeam("front", 0, "xyz", 1), "to_panel"),
        (edits.CloseSeam("front", 0, "back", 9), "to_edge"),
    ],
)
def test_what_is_not_there_has_no_image(tshirt, edit, place):
    with pytest.raises(EditError) as caught:
        mirrored(tshirt, edit)
    assert caught.value.place == place
