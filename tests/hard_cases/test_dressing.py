"""Every garment of the demo in every fabric, dressed; and what dressing says of garments that are too tight."""

from __future__ import annotations

import json

import numpy as np
import pytest
from frame_judge import FrameJudge, principal_stretches
from worn_garment import DEMO

from tryon_solver.body.model import default_body
from tryon_solver.dressing.dress import dress
from tryon_solver.dressing.fit import DressingError
from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import load_pattern, parse_pattern
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.settings import PRESETS

EDGE = 0.04  # m, coarse: fifteen garments in a minute or two
GARMENTS = sorted(path.stem for path in (DEMO / "patterns").glob("*.json"))
QUICKEST = ("skirt", "denim")


def every_fabric_once():
    """All garments in all fabrics; but for the one that takes the least time they are long tests."""
    return [
        pytest.param(garment, fabric, marks=[] if (garment, fabric) == QUICKEST else pytest.mark.long)
        for garment in GARMENTS
        for fabric in FABRICS
    ]


@pytest.fixture(scope="module")
def body():
    return default_body()


@pytest.mark.parametrize(("garment", "fabric"), every_fabric_once())
def test_each_garment_fits_in_each_fabric(garment, fabric, body):
    """At rest: clean by IPC Toolkit, no void step, every gap above the offset, stretched within the limit."""
    panels = mesh_pattern(load_pattern(DEMO / "patterns" / f"{garment}.json"), EDGE)
    dressed = dress(panels, body, FABRICS[fabric], PRESETS["draft"])
    sim = dressed.simulation
    report = sim.reported
    assert (report.retries, report.overlapping) == (0, 0)
    assert report.min_gap > 0
    assert report.body_lag < 3e-3
    cloth, surface = sim.cloth_positions(), sim.body_positions()
    faces = sim.scene.garment.faces
    judge = FrameJudge(faces, body.faces, cloth.astype(np.float64), surface.astype(np.float64))
    assert judge.judge(cloth, surface).clean
    stretch = principal_stretches(cloth, faces, sim.scene.garment.uv_corners)[:, 1]
    assert np.quantile(stretch, 0.999) <= 1.02 * FABRICS[fabric].strain_limit
    assert stretch.max() <= 1.1 * FABRICS[fabric].strain_limit


def scaled(garment: str, share: float):
    """The demo's garment in another size, meshed."""
    spec = json.loads((DEMO / "patterns" / f"{garment}.json").read_text())
    spec["properties"]["units_in_meter"] /= share
    return mesh_pattern(parse_pattern(spec), EDGE)


@pytest.mark.long
def test_a_skirt_too_tight_for_its_fabric_fits_in_one_that_stretches(body):
    """A tenth smaller, the waist must stretch by 12 %: denim bears 5, cotton jersey 15."""
    panels = scaled("skirt", 0.9)
    with pytest.raises(DressingError) as caught:
        dress(panels, body, FABRICS["denim"], PRESETS["draft"])
    error = caught.value
    assert error.place in ("panels.skirt_front", "panels.skirt_back")
    assert "the seam between skirt_front and skirt_back stays" in error.message
    assert "denim bears 5 %; the garment is too tight for this body" in error.message
    assert "larger size" in error.remedy
    assert "cotton_jersey: 15 %" in error.remedy
    assert dress(panels, body, FABRICS["cotton_jersey"], PRESETS["draft"]).simulation.reported.min_gap > 0


@pytest.mark.long
def test_a_skirt_too_tight_for_any_fabric_is_to_be_larger(body):
    with pytest.raises(DressingError, match="too tight for this body") as caught:
        dress(scaled("skirt", 0.8), body, FABRICS["cotton_jersey"], PRESETS["draft"])
    assert "larger size" in caught.value.remedy
    assert "fabric that stretches" not in caught.value.remedy
