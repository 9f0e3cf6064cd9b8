"""Fabrics hang in the order that was published; and the page of them is that of the kept runs."""

from __future__ import annotations

from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
from cusick import COARSE, EDGE, draped, hem
from discretisation_disc import DISC, disc_scene, of_shadow
from discretisation_rest import live_with
from fabrics_page import read, write

from tryon_solver.materials.fabric import FABRICS, Fabric

KEPT = Path(__file__).parents[2] / "docs" / "fabrics"
APART = ("viscose_jersey", "polyester_satin", "cotton_canvas")  # 10 to 25, 43 to 70 and 85 to 100 % as published
QUICK = 14.0  # mm: edges of the mesh that a short test can wait for


def ordered_pairs(names) -> list[tuple[str, str]]:
    """Fabrics of which the first was published to hang more than the second, whatever the sample."""
    pairs = []
    for limp, stiff in permutations(names, 2):
        first, second = FABRICS[limp].drape, FABRICS[stiff].drape
        if first is not None and second is not None and first[1] < second[0]:
            pairs.append((limp, stiff))
    return pairs


def test_a_flat_disc_throws_a_shadow_of_its_own_size():
    scene = disc_scene(QUICK, live_with(), fabric=FABRICS["denim"])
    flat = scene.x_start.copy()
    flat[:, 1] = 0.0
    coefficient, _ = of_shadow(scene, flat)
    assert coefficient == pytest.approx(1.0, abs=0.01)  # a polygon of 72 corners is 0.1 % of the radius off a circle
    np.testing.assert_array_equal(hem(scene, flat), 0)


def test_a_disc_that_hangs_straight_down_throws_the_pedestal_s_shadow():
    scene = disc_scene(QUICK, live_with(), fabric=FABRICS["denim"])
    hung = scene.x_start.copy()
    radius = np.linalg.norm(hung[:, [0, 2]], axis=1)
    beyond = np.maximum(radius - DISC.pedestal, 0.0)
    hung[:, [0, 2]] *= (np.minimum(radius, DISC.pedestal) / np.maximum(radius, 1e-9))[:, None]
    hung[:, 1] = -beyond
    coefficient, _ = of_shadow(scene, hung)
    assert coefficient == pytest.approx(0.0, abs=0.01)
    assert hem(scene, hung).min() == pytest.approx(DISC.pedestal - DISC.radius, abs=2e-3)


def test_three_fabrics_far_apart_hang_in_their_order():
    limp, between, stiff = (draped(FABRICS[name], QUICK) for name in APART)
    assert len(ordered_pairs(APART)) == 3
    assert limp["coefficient"] < between["coefficient"] - 0.1
    assert between["coefficient"] < stiff["coefficient"] - 0.1


@pytest.mark.long
@pytest.mark.timeout(1200)
def test_all_fabrics_hang_in_their_order():
    found = {name: draped(fabric, COARSE) for name, fabric in FABRICS.items()}
    pairs = ordered_pairs(FABRICS)
    assert len(pairs) > 15
    assert [(limp, stiff) for limp, stiff in pairs if found[limp]["coefficient"] >= found[stiff]["coefficient"]] == []


def test_the_kept_runs_are_in_their_order_and_a_finer_mesh_says_the_same():
    kept = {(run["fabric"], run["edge"]): run for run in map(read, (KEPT / "runs").glob("*.json"))}
    assert set(kept) == {(name, edge) for name in FABRICS for edge in (COARSE, EDGE)}
    for limp, stiff in ordered_pairs(FABRICS):
        assert kept[limp, EDGE]["coefficient"] < kept[stiff, EDGE]["coefficient"]
    changes = [abs(kept[name, EDGE]["coefficient"] - kept[name, COARSE]["coefficient"]) for name in FABRICS]
    assert 0 < max(changes) < 0.03


def test_the_page_is_that_of_the_kept_runs(tmp_path):
    assert write(tmp_path / "fabrics.md", KEPT / "runs") == 0
    assert (tmp_path / "fabrics.md").read_text() == KEPT.with_suffix(".md").read_text()
    assert (tmp_path / "fabrics" / "drape.svg").read_text() == (KEPT / "drape.svg").read_text()


@pytest.mark.parametrize(("field", "value"), [("drape", (0.5, 0.4)), ("drape", (0.2, 1.2)), ("k_bend", -1.0)])
def test_a_fabric_that_can_not_be_is_refused_by_its_field(field, value):
    with pytest.raises(ValueError, match=field):
        Fabric(**{**FABRICS["denim"].__dict__, field: value})
