"""How long pieces are sewn: seams that were drawn together are held shut until they can be welded, and no longer."""

import numpy as np
import pytest
from worn_garment import DEMO

from tryon_solver.body.model import default_body
from tryon_solver.contact.candidates import FILLINGS, SOON
from tryon_solver.dressing import dress as dressing
from tryon_solver.dressing.dress import CLOSING_SECONDS, SEWING_SECONDS, SEWING_STEP, dress
from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import load_pattern
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.settings import PRESETS

DRAWN, MOST = round(SEWING_SECONDS / SEWING_STEP), round((SEWING_SECONDS + CLOSING_SECONDS) / SEWING_STEP)


def sewn_frames():
    """How many frames a T-shirt is sewn, once it is put on."""
    stages = []
    panels = mesh_pattern(load_pattern(DEMO / "patterns" / "tshirt.json"), 0.05)
    dressed = dress(
        panels,
        default_body(),
        FABRICS["cotton_jersey"],
        PRESETS["draft"],
        progress=lambda stage, _share: stages.append(stage),
    )
    assert np.isfinite(dressed.simulation.cloth_positions()).all()
    assert dressed.simulation.candidates.fillings == FILLINGS - SOON, "how much room it takes worn is asked soon"
    return stages.count("sewing")


def test_seams_that_are_closed_are_welded_at_once():
    assert DRAWN <= sewn_frames() < MOST - 6


@pytest.mark.parametrize("closes", [DRAWN + 5, MOST])
def test_seams_that_are_not_closed_yet_are_held_shut(monkeypatch, closes):
    """As where the last of their way is to be gone against folds: until they are closed, or for as long as there is."""
    asked = []
    welded = dressing._if_closed

    def later(*arguments):
        asked.append(arguments)
        return welded(*arguments) if DRAWN + len(asked) > closes else None

    monkeypatch.setattr(dressing, "_if_closed", later)
    assert sewn_frames() == closes
