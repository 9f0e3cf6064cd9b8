"""A garment whose collar is wider than the shoulders is too large, and is told so; one that is tight is not."""

from dataclasses import replace

import pytest
from worn_garment import DEMO

from tryon_solver.body.model import default_body
from tryon_solver.body.pose import Pose
from tryon_solver.dressing.collar import slips_off
from tryon_solver.dressing.dress import dress
from tryon_solver.dressing.fit import DressingError, TightError
from tryon_solver.geometry.pattern import load_pattern
from tryon_solver.geometry.size import mesh_with_vertices
from tryon_solver.materials.fabric import FABRICS
from tryon_solver.settings import PRESETS


@pytest.fixture(scope="module")
def body():
    return default_body()


def in_size(garment, times):
    """Its pieces so many times as large about their highest point."""
    panels = mesh_with_vertices(load_pattern(DEMO / "patterns" / f"{garment}.json"), 250)
    top = panels.placed[:, 1].max()
    placed = times * (panels.placed - [0, top, 0]) + [0, top, 0]
    return replace(panels, uv=times * panels.uv, placed=placed)


@pytest.mark.parametrize(
    ("garment", "times", "falls"), [("tshirt", 1, 0), ("tshirt", 1.5, 0), ("tshirt", 3, 1), ("skirt", 3, 0)]
)
def test_only_a_collar_wider_than_the_shoulders_slips_off(body, garment, times, falls):
    surface = body.surface(Pose.rest(body))
    assert (slips_off(in_size(garment, times), surface, body.faces) is not None) == bool(falls)


@pytest.mark.long
def test_a_shirt_three_times_too_large_is_refused_as_that(body):
    with pytest.raises(DressingError, match=r"the shoulders with the arms \d+ cm: .* too large for this body") as told:
        dress(in_size("tshirt", 3), body, FABRICS["cotton_jersey"], PRESETS["draft"])
    assert not isinstance(told.value, TightError)  # a larger size is not what to try
    assert "Choose a size below 0." in str(told.value)
