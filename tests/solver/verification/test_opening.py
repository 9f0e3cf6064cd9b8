"""The opening that a garment hangs by, against a body whose girths are known: a cone that widens downwards."""

from dataclasses import replace

import numpy as np
import pytest

from tryon_solver.dressing.opening import opening_as_drawn, upper_opening
from tryon_solver.geometry.garment import Garment
from tryon_solver.geometry.panel_mesh import PanelMesh

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


def skirt(top, bottom, girth):
    """A tube of that girth [m] in its pattern, hanging between the heights around the cone."""
    x, faces = tube([bottom, top], [radius(bottom) + 0.01, radius(top) + 0.01])
    column, row = faces % SPOKES, faces // SPOKES
    column = np.where((np.ptp(column, axis=1) > 1)[:, None] & (column == 0), SPOKES, column)  # across the row's end
    corners = np.stack([column * girth / SPOKES, row * (top - bottom)], axis=2)
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
