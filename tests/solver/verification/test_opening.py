"""The opening that a garment hangs by, against a body whose girths are known: a cone that widens downwards."""

from dataclasses import replace

import numpy as np
import pytest
from small_scenes import fabric

from tryon_solver.dressing.holding import NOTHING, holding
from tryon_solver.dressing.opening import girth_around, opening_as_drawn, upper_opening
from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.lines import chain
from tryon_solver.geometry.panel_mesh import PanelMesh
from tryon_solver.scene import Elastic, ElasticLine, Fasteners

SPOKES = 48
HEIGHT = 1.7  # m
CHORDS = SPOKES * 2 * np.sin(np.pi / SPOKES)  # girth of a regular polygon over the radius of its corners


def radius(height):
    """Of the cone [m]."""
    return 0.24 - 0.1 * height


def tube(levels, radii):
    """Rings around the y axis (L * SPOKES, 3) m, and the faces between them, outwards."""
    angle = 2 * np.pi * np.arange(SPOKES) / SPOKES
    ring = np.stack([np.sin(angle), np.zeros(SPOKES), np.cos(angle)], axis=1)
    points = np.vstack([r * ring + [0, y, 0] for y, r in zip(levels, radii)])
    lower = np.arange(SPOKES * (len(levels) - 1))
    beside = lower - lower % SPOKES + (lower + 1) % SPOKES
    below, above = np.stack([lower, beside, beside + SPOKES], 1), np.stack([lower, beside + SPOKES, lower + SPOKES], 1)
    return points, np.vstack([below, above]).astype(np.int32)


def cone():
    levels = np.linspace(0, HEIGHT, 40)
    points, faces = tube(levels, radius(levels))
    ends = np.array([[0, 0, 0], [0, HEIGHT, 0]])
    k = np.arange(SPOKES)
    bottom = np.stack([np.full(SPOKES, len(points)), (k + 1) % SPOKES, k], axis=1)
    last = len(points) - SPOKES
    top = np.stack([np.full(SPOKES, len(points) + 1), last + k, last + (k + 1) % SPOKES], axis=1)
    return np.vstack([points, ends]), np.vstack([faces, bottom, top]).astype(np.int32)


def skirt(top, bottom, girth, *between):
    """A tube of that girth [m] in its pattern, hanging between the heights around the cone, with rings `between`."""
    levels = np.array([bottom, *between, top])
    x, faces = tube(levels, radius(levels) + 0.01)
    column, row = faces % SPOKES, faces // SPOKES
    column = np.where((np.ptp(column, axis=1) > 1)[:, None] & (column == 0), SPOKES, column)  # across the row's end
    corners = np.stack([column * girth / SPOKES, levels[row] - bottom], axis=2)
    return Garment(faces, corners, np.zeros(len(faces), np.int32), len(x)), x


def test_a_wide_waist_slips_to_where_the_body_is_as_wide():
    body, body_faces = cone()
    girth = CHORDS * radius(0.8)
    garment, x = skirt(1.1, 0.6, girth)
    opening = upper_opening(garment, x, ("band",), body, body_faces)
    assert opening.pieces == ("band",)
    assert opening.height == pytest.approx(1.1)
    assert opening.girth == pytest.approx(girth)
    assert opening.body_girth == pytest.approx(CHORDS * radius(1.1), rel=1e-3)
    assert opening.rests_at == pytest.approx(0.8, abs=0.006)
    assert opening.fitting_size == pytest.approx(radius(1.1) / radius(0.8), rel=1e-3)
    assert "18.8 cm too wide at a height of 1.10 m" in opening.advice
    assert "slips to a height of 0.80 m" in opening.advice
    assert "feet" not in opening.advice


def test_the_opening_is_measured_where_the_pattern_places_it():
    """A tube in one piece, its side sewn to itself, drawn standing around the cone."""
    body, body_faces = cone()
    girth = CHORDS * radius(0.8)
    garment, x = skirt(1.1, 0.6, girth)
    column = np.append(np.arange(SPOKES), 0)
    copies = np.concatenate([column, column + SPOKES])
    uv = np.stack([np.tile(np.arange(SPOKES + 1), 2) * girth / SPOKES, np.repeat([0.0, 0.5], SPOKES + 1)], axis=1)
    k = np.arange(SPOKES)
    above = k + SPOKES + 1
    faces = np.concatenate([np.stack([k, k + 1, above + 1], 1), np.stack([k, above + 1, above], 1)]).astype(np.int32)
    panels = PanelMesh(
        uv=uv,
        panel_of_vertex=np.zeros(len(uv), np.int32),
        panel_names=("band",),
        faces=faces,
        placed=x[copies],
        stitches=np.array([[0, SPOKES], [SPOKES + 1, 2 * SPOKES + 1]], np.int32),
        seam_of_stitch=np.zeros(2, np.int32),
        panel_labels=("",),
        sewn_edges=np.array([[[0, SPOKES + 1], [SPOKES, 2 * SPOKES + 1]]], np.int32),
        segments=np.array([SPOKES, 1, SPOKES, 1], np.int32),
    )
    drawn, worn = opening_as_drawn(panels, body, body_faces), upper_opening(garment, x, ("band",), body, body_faces)
    assert drawn.girth == pytest.approx(girth)
    assert drawn.height == pytest.approx(worn.height)
    assert drawn.fitting_size == pytest.approx(worn.fitting_size)


def test_a_waist_that_is_stretched_holds():
    body, body_faces = cone()
    garment, x = skirt(1.1, 0.6, 0.9 * CHORDS * radius(1.1))
    opening = upper_opening(garment, x, ("band",), body, body_faces)
    assert opening.too_wide < 0
    assert opening.advice == ""


def test_what_is_wider_than_all_of_the_body_falls_off():
    body, body_faces = cone()
    garment, x = skirt(1.1, 0.6, 1.1 * CHORDS * radius(0))
    opening = upper_opening(garment, x, ("band",), body, body_faces)
    assert opening.rests_at is None
    assert "falls off" in opening.advice


def test_a_size_is_advised_unless_it_is_known_not_to_help():
    body, body_faces = cone()
    garment, x = skirt(1.1, 0.6, CHORDS * radius(0.8))
    opening = upper_opening(garment, x, ("band",), body, body_faces)
    fits = opening.fitting_size
    assert opening.advised_size == fits
    assert opening.advice.endswith(f"size {fits:.2f} fits there")
    tight = replace(opening, too_small=0.95)
    assert tight.advised_size is None
    assert tight.advice.endswith("but in size 0.95 it can't be put on: narrow the opening in the pattern")
    tiny = replace(opening, size=0.6)
    assert tiny.advised_size is None
    assert tiny.advice.endswith("no size of this pattern fits there, not even 0.5: narrow the opening in the pattern")
    assert replace(opening, girth=0.9 * opening.body_girth).advised_size is None


def test_a_long_one_that_slips_is_trodden_on():
    body, body_faces = cone()
    garment, x = skirt(1.1, 0.05, CHORDS * radius(0.8))
    assert "under the feet" in upper_opening(garment, x, ("band",), body, body_faces).advice


def test_a_garment_over_the_armpits_hangs_from_the_shoulders():
    body, body_faces = cone()
    garment, x = skirt(1.65, 0.6, CHORDS * radius(0.8))
    assert upper_opening(garment, x, ("band",), body, body_faces) is None


CLOTH = fabric(areal_density=0.2, mu_body=0.4, strain_limit=1.15)
WIDE = CHORDS * radius(0.8)  # of a skirt whose waist is at 1.1 m


def ring(row):
    return chain(np.arange(SPOKES, dtype=np.int32) + row * SPOKES, closed=True)


def hangs(garment, x, *effects):
    body, body_faces = cone()
    return upper_opening(garment, x, ("band",), body, body_faces, holding(effects, garment, CLOTH))


def test_elastic_holds_where_its_pull_carries_the_garment():
    """Stretched to L (r + W/(2 pi mu k)) it presses with W/mu in all; what pulls less than the garment weighs is as
    long as the cloth is."""
    garment, x = skirt(1.1, 0.6, WIDE)
    weight = 0.2 * 9.81 * WIDE * 0.5
    for ratio, stiffness in ((0.7, 40.0), (0.7, 2.0)):
        opening = hangs(garment, x, Elastic((ElasticLine(ring(1), ratio, stiffness),)))
        assert opening.girth == pytest.approx(WIDE * (ratio + weight / (2 * np.pi * 0.4 * stiffness)), rel=1e-6)
        assert opening.height == pytest.approx(1.1)
        assert (opening.advice == "") == (stiffness == 40.0)
    for line in (ElasticLine(ring(1), 0.7, 0.5), ElasticLine(ring(1), 1.3, 40.0), ElasticLine(ring(1), 0.7, 0.0)):
        slips = hangs(garment, x, Elastic((line,)))
        assert slips.girth == pytest.approx(WIDE)
        assert "slips to a height of 0.80 m" in slips.advice


def test_a_belt_below_the_opening_holds_and_a_drawn_hem_does_not():
    garment, x = skirt(1.1, 0.6, WIDE, 1.05)
    belt = hangs(garment, x, Elastic((ElasticLine(ring(1), 0.7, 100.0),)))
    assert belt.height == pytest.approx(1.05)
    assert belt.pieces == ("band",)
    assert belt.advice == ""
    assert "slips" in hangs(garment, x, Elastic((ElasticLine(ring(0), 0.7, 100.0),))).advice


def test_what_is_fastened_is_closed():
    """A tube that is open all along at the back: its border is one line around all of it, 1 m longer than twice."""
    girth = 0.95 * CHORDS * radius(1.1)
    garment, x = skirt(1.1, 0.6, girth)
    column = np.rint(garment.uv_corners[:, :, 0] / girth * SPOKES).astype(np.int32)
    row = (garment.faces // SPOKES).astype(np.int32)
    faces = np.where(column == SPOKES, 2 * SPOKES + row, garment.faces).astype(np.int32)
    apart = np.vstack([x, x[[0, SPOKES]] + [-1e-3, 0, 0]])
    open_at_back = Garment(faces, garment.uv_corners, garment.panel_of_face, len(apart))
    whole = hangs(open_at_back, apart)
    assert whole.girth == pytest.approx(2 * (girth + 0.5))
    zip_ = np.array([[0, 2 * SPOKES], [SPOKES, 2 * SPOKES + 1]], np.int32)
    closed = hangs(open_at_back, apart, Fasteners(zip_))
    assert closed.girth == pytest.approx(girth)
    assert closed.height == pytest.approx(1.1)
    assert closed.advice == ""


def test_no_size_is_named_that_is_too_tight_below():
    """A straight skirt that fits the waist goes over no hips that are a fifth wider, in cloth that bears 15 %."""
    garment, x = skirt(1.1, 0.6, WIDE)
    opening = hangs(garment, x)
    assert opening.advised_size is None
    assert "but is too tight at a height of" in opening.advice
    lower = opening.tightest
    assert lower.body_girth == pytest.approx(CHORDS * radius(lower.height), rel=1e-3)
    assert lower.girth == pytest.approx(WIDE)
    body, body_faces = cone()
    assert replace(opening, tightest=replace(lower, bears=1.3)).advised_size == opening.fitting_size
    assert upper_opening(garment, x, ("band",), body, body_faces, NOTHING).advised_size == opening.fitting_size


def test_a_pocket_goes_around_nothing():
    """A square of 20 cm on the hips is no part of the girth there."""
    body, body_faces = cone()
    garment, x = skirt(1.1, 0.6, WIDE)
    square = np.array([[0.0, 0.7], [0.2, 0.7], [0.2, 0.95], [0.0, 0.95]])
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    on = np.column_stack([square, np.full(4, radius(0.8) + 0.03)])
    both = Garment(
        np.vstack([garment.faces, faces + len(x)]),
        np.concatenate([garment.uv_corners, square[faces]]),
        np.append(garment.panel_of_face, [1, 1]).astype(np.int32),
        len(x) + 4,
    )
    held = holding((), garment, CLOTH)
    plain, names = upper_opening(garment, x, ("band",), body, body_faces, held), ("band", "pocket")
    with_pocket = upper_opening(both, np.vstack([x, on]), names, body, body_faces, held, [1])
    assert with_pocket.tightest == plain.tightest
    assert upper_opening(both, np.vstack([x, on]), names, body, body_faces, held).tightest != plain.tightest


def test_the_girth_of_what_hangs_is_that_of_its_folds_around_the_trunk_alone():
    """A tube in eight folds, which a tape would go around straight, and narrower ones beside it, as sleeves are."""
    angle = 2 * np.pi * np.arange(SPOKES) / SPOKES
    points, faces = tube(np.linspace(0.8, 1.2, 9), np.full(9, 0.2))
    folded = points.copy()
    folded[:, [0, 2]] *= np.tile(1.0 + 0.1 * np.cos(8 * angle), 9)[:, None]
    ring = folded[:SPOKES]
    length = np.linalg.norm(ring - np.roll(ring, -1, axis=0), axis=1).sum()
    sleeve = points * [0.2, 1, 0.2] + [0.5, 0, 0]
    both, all_faces = np.vstack([folded, sleeve]), np.vstack([faces, faces + len(points)])
    assert length > 1.05 * 0.2 * CHORDS
    assert girth_around(both, all_faces, 1.01, 0.0) == pytest.approx(length, rel=0.02)
    assert girth_around(both, all_faces, 1.01, 0.5) == pytest.approx(0.04 * CHORDS, rel=0.02)
    assert girth_around(both, all_faces, 1.3, 0.0) == 0.0, "it hangs lower"
