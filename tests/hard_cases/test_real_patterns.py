"""Every GarmentCode pattern of the shared data folder, dressed; skipped where that folder is absent."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from frame_judge import FrameJudge

from tryon_solver.body.model import default_body
from tryon_solver.dressing.dress import dress
from tryon_solver.dressing.fit import DressingError
from tryon_solver.geometry.pattern import load_pattern
from tryon_solver.geometry.size import mesh_in_size
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.settings import PRESETS

REPOSITORY = Path(__file__).resolve().parents[2]
PATTERNS = Path(os.environ.get("TRYON_SHARED_DATA", REPOSITORY.parent / "shared" / "data")) / "patterns"
FILES = sorted(PATTERNS.glob("*_specification.json"))
EDGE = 0.03  # m
# The godet skirt's hem is 80 cm; the default body's legs, as it stands, measure 95 cm there. Jersey stretches by 15 %.
SIZES = {"godet_skirt": 1.2}

QUICK = "tshirt"  # the one that the short run of the tests has


def name_of(path):
    """Without the ending that all of them have."""
    return path.stem.removesuffix("_specification")


def dressed(path, size):
    """The pattern in that size on the default body."""
    panels = mesh_in_size(load_pattern(path), EDGE, size)
    return dress(panels, default_body(), FABRICS["cotton_jersey"], PRESETS["draft"])


@pytest.mark.skipif(not FILES, reason=f"no GarmentCode patterns in {PATTERNS}")
@pytest.mark.parametrize(
    "path",
    [pytest.param(path, marks=() if name_of(path) == QUICK else pytest.mark.long) for path in FILES],
    ids=name_of,
)
def test_each_real_pattern_is_dressed(path):
    """At rest: clean by IPC Toolkit, no void step, every gap above the offset, stretched within the limit."""
    sim = dressed(path, SIZES.get(name_of(path), 1.0)).simulation
    report = sim.reported
    assert (report.retries, report.overlapping) == (0, 0)
    assert report.min_gap > 0
    assert report.body_lag < 3e-3
    cloth, surface = sim.cloth_positions(), sim.body_positions()
    faces = sim.scene.garment.faces
    judge = FrameJudge(faces, sim.scene.body.faces, cloth.astype(np.float64), surface.astype(np.float64))
    assert judge.judge(cloth, surface).clean


@pytest.mark.long
@pytest.mark.skipif(not FILES, reason=f"no GarmentCode patterns in {PATTERNS}")
def test_trousers_for_a_wider_waist_are_told_to_slip():
    """The patterns were made for a waist of 84.3 cm; the default body's measures 77."""
    opening = dressed(PATTERNS / "pants_waistband_specification.json", 1.0).upper_opening()
    assert opening.pieces == ("wb_back", "wb_front")
    assert opening.girth == pytest.approx(0.843, abs=0.001)
    assert 0.05 < opening.too_wide < 0.08
    assert opening.fitting_size == pytest.approx(0.92, abs=0.02)
    assert "under the feet" in opening.advice


@pytest.mark.long
@pytest.mark.skipif(not FILES, reason=f"no GarmentCode patterns in {PATTERNS}")
def test_a_hem_too_narrow_for_the_legs_is_refused_as_too_tight():
    with pytest.raises(DressingError, match="too tight for this body") as caught:
        dressed(PATTERNS / "godet_skirt_specification.json", 1.0)
    assert "larger size" in caught.value.remedy
