"""Measures that a tailor knows are what they say, and finer meshes come nearer to closed forms."""

import numpy as np
import pytest
from discretisation import MEASUREMENTS
from discretisation_disc import DISC, circle, disc_scene, of_shadow
from discretisation_rest import live_with
from discretisation_strip import bending_length, chord_angle, ratio_of_angle, wrinkle_wavelength

from tryon_solver.settings import PRESETS


def test_a_discs_shadow_is_all_of_it_flat_and_none_of_the_overhang_straight_down():
    """Drape coefficients 1 and 0; in between, of a cone, (r^2 - p^2)/(R^2 - p^2) with r its outline's radius."""
    scene = disc_scene(20.0, live_with())
    flat = scene.x_start * [1, 0, 1]
    radius = np.linalg.norm(flat, axis=1)
    assert of_shadow(scene, flat)[0] == pytest.approx(1.0, abs=0.01)
    for outline in (DISC.pedestal, 0.12):
        pulled_in = np.interp(radius, [0, DISC.pedestal, DISC.radius], [0, DISC.pedestal, outline])
        draped = flat * (pulled_in / np.maximum(radius, 1e-9))[:, None]
        expected = (outline**2 - DISC.pedestal**2) / (DISC.radius**2 - DISC.pedestal**2)
        assert of_shadow(scene, draped)[0] == pytest.approx(expected, abs=0.012)


def test_folds_are_counted():
    scene = disc_scene(10.0, live_with())
    flat = scene.x_start * [1, 0, 1]
    angle = np.arctan2(flat[:, 2], flat[:, 0])
    wavy = flat * (1 + 0.1 * np.cos(7 * angle))[:, None]
    assert of_shadow(scene, wavy)[1] == 7


def test_the_polygon_has_the_circles_area():
    x, y = circle(0.15).T
    assert 0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() == pytest.approx(np.pi * 0.15**2, rel=1e-12)


def test_little_loaded_cantilevers_sink_as_beams_do():
    """w L^4/(8 B) for small loads, and the ratio of an angle is found again."""
    assert chord_angle(0.1) == pytest.approx(0.1 / 8, rel=1e-3)
    assert ratio_of_angle(chord_angle(9.0)) == pytest.approx(9.0, rel=1e-5)


def test_bending_length_is_near_the_closed_form():
    """In coarse cloth as well, seven edges to what juts out."""
    for edge in (8.0, 5.0):
        found = bending_length(edge=edge)
        assert found["value"] == pytest.approx(found["exact"], rel=0.03)
    assert found["vertices"] > 200


@pytest.mark.long
def test_wrinkles_are_as_long_as_the_closed_form_says():
    """Half waves are whole numbers, 13 of 46 mm across 300 mm, so that one more or less is 8 %; coarse cloth, four
    edges to a wave, has shorter ones."""
    coarse, fine = (wrinkle_wavelength(edge=edge) for edge in (12.0, 6.0))
    assert fine["value"] == pytest.approx(fine["exact"], rel=0.09)
    assert abs(coarse["value"] - coarse["exact"]) > abs(fine["value"] - fine["exact"])
    assert fine["height"] > 0.5


def test_every_measurement_varies_one_thing():
    """Names are their files'."""
    assert len(MEASUREMENTS) > 30
    assert {name for name in MEASUREMENTS if name.startswith("settled-")} == {f"settled-{name}" for name in PRESETS}
    for name, made in MEASUREMENTS.items():
        assert len(made.keywords) == 1, name
