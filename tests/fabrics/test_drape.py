"""Fabrics hang in the order that was published; and the page of them is that of the kept runs."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
from choose_bending import choose
from cusick import FINE, LIVE, MESHES, STARTS, Mesh, draped, draped_often, hem, mean_and_spread
from discretisation_disc import DISC, disc_scene, of_shadow
from discretisation_rest import live_with
from fabrics_page import kept_in, write

from tryon_solver.materials.fabric import FABRICS, Fabric
from tryon_solver.settings import PRESETS

KEPT = Path(__file__).parents[2] / "docs" / "fabrics"
APART = ("viscose_jersey", "polyester_satin", "cotton_canvas")  # 10 to 25, 43 to 70 and 85 to 100 % as published
QUICK = Mesh(14.0)  # that a short test can wait for


def ordered_pairs(names) -> list[tuple[str, str]]:
    """Fabrics of which the first was published to hang more than the second, whatever the sample."""
    pairs = []
    for limp, stiff in permutations(names, 2):
        first, second = FABRICS[limp].drape, FABRICS[stiff].drape
        if first is not None and second is not None and first[1] < second[0]:
            pairs.append((limp, stiff))
    return pairs


def test_a_flat_disc_throws_a_shadow_of_its_own_size():
    scene = disc_scene(QUICK.edge, live_with(), fabric=FABRICS["denim"])
    flat = scene.x_start.copy()
    flat[:, 1] = 0.0
    coefficient, _ = of_shadow(scene, flat)
    assert coefficient == pytest.approx(1.0, abs=0.01)  # a polygon of 72 corners is 0.1 % of the radius off a circle
    np.testing.assert_array_equal(hem(scene, flat), 0)


def test_a_disc_that_hangs_straight_down_throws_the_pedestal_s_shadow():
    scene = disc_scene(QUICK.edge, live_with(), fabric=FABRICS["denim"])
    hung = scene.x_start.copy()
    radius = np.linalg.norm(hung[:, [0, 2]], axis=1)
    beyond = np.maximum(radius - DISC.pedestal, 0.0)
    hung[:, [0, 2]] *= (np.minimum(radius, DISC.pedestal) / np.maximum(radius, 1e-9))[:, None]
    hung[:, 1] = -beyond
    coefficient, _ = of_shadow(scene, hung)
    assert coefficient == pytest.approx(0.0, abs=0.01)
    assert hem(scene, hung).min() == pytest.approx(DISC.pedestal - DISC.radius, abs=2e-3)


@pytest.mark.long
def test_three_fabrics_far_apart_hang_in_their_order():
    limp, between, stiff = (draped(FABRICS[name], QUICK) for name in APART)
    assert len(ordered_pairs(APART)) == 3
    assert limp["coefficient"] < between["coefficient"] - 0.1
    assert between["coefficient"] < stiff["coefficient"] - 0.1


def test_a_start_turns_the_mesh_against_the_warp_and_folds_otherwise():
    settings = PRESETS["live"]
    straight, turned = (disc_scene(QUICK.edge, settings, start=start) for start in (STARTS[0], STARTS[2]))
    edges = [scene.garment.uv_corners[:, 1] - scene.garment.uv_corners[:, 0] for scene in (straight, turned)]
    directions = [np.arctan2(edge[:, 1], edge[:, 0]) for edge in edges]
    turn = np.angle(np.exp(1j * (directions[1] - directions[0])))
    np.testing.assert_allclose(turn, np.deg2rad(STARTS[2].turned), atol=1e-9)
    assert np.abs(straight.x_start[:, 1] - turned.x_start[:, 1]).max() > 1e-3


@pytest.mark.long
@pytest.mark.timeout(3600)
def test_all_fabrics_hang_in_their_order_and_ranges():
    found = {name: mean_and_spread(draped_often(fabric, LIVE))[0] for name, fabric in FABRICS.items()}
    pairs = ordered_pairs(FABRICS)
    assert len(pairs) > 15
    assert [(limp, stiff) for limp, stiff in pairs if found[limp] >= found[stiff]] == []
    assert [name for name, fabric in FABRICS.items() if not fabric.drape[0] <= found[name] <= fabric.drape[1]] == []


def test_the_kept_runs_are_in_their_order_and_ranges_and_a_finer_mesh_says_the_same():
    kept = kept_in(KEPT / "runs")
    assert set(kept) == {(name, mesh) for name in FABRICS for mesh in MESHES}
    assert [key for key, run in kept.items() if run["k_bend"] != FABRICS[key[0]].k_bend] == []
    for mesh in MESHES:
        for limp, stiff in ordered_pairs(FABRICS):
            assert mean_and_spread(kept[limp, mesh]) < mean_and_spread(kept[stiff, mesh]), (limp, stiff, mesh)
    for name, fabric in FABRICS.items():
        mean, _ = mean_and_spread(kept[name, LIVE])
        assert fabric.drape[0] <= mean <= fabric.drape[1], name
    changes = [abs(kept[name, FINE]["coefficient"][0] - kept[name, LIVE]["coefficient"][0]) for name in FABRICS]
    assert 0 < max(changes) < 0.05


def test_the_stiffness_of_what_was_chosen_is_the_last_trial_s():
    kept = kept_in(KEPT / "runs")
    chosen = json.loads((KEPT / "chosen.json").read_text())
    assert len(chosen) >= 3
    for name, trials in chosen.items():
        assert trials[-1]["k_bend"] == FABRICS[name].k_bend
        assert (trials[-1]["mean"], trials[-1]["spread"]) == pytest.approx(
            mean_and_spread(kept[name, LIVE]), abs=1e-4
        )  # rounded to that


def by_law(fabric):
    """A drape that rises with the stiffness' logarithm: 0.45 at 6e-6, and 0.1 less for each halving."""
    mean = 0.45 + 0.1 * np.log2(fabric.k_bend / 6e-6)
    return {"coefficient": [mean - 0.005, mean + 0.005]}


def test_stiffness_is_chosen_within_the_range_and_kept_where_it_is():
    stiff = replace(FABRICS["cotton_jersey"], k_bend=6e-6, drape=(0.18, 0.31))
    trials = choose(stiff, by_law)
    assert len(trials) > 1
    assert trials[0]["k_bend"] == 6e-6
    margin = 2 * trials[-1]["spread"]
    assert 0.18 + margin <= trials[-1]["mean"] <= 0.31 - margin
    within = replace(stiff, drape=(0.4, 0.5))
    assert [trial["k_bend"] for trial in choose(within, by_law)] == [6e-6]
    limp = replace(stiff, drape=(0.7, 0.8))
    assert choose(limp, by_law)[-1]["k_bend"] > 6e-6


def test_a_fabric_that_can_not_be_chosen_is_refused():
    with pytest.raises(ValueError, match="drape is None; give the range"):
        choose(replace(FABRICS["denim"], drape=None), by_law)
    with pytest.raises(RuntimeError, match=r"8 trials miss 0\.18 to 0\.31"):
        choose(FABRICS["cotton_jersey"], lambda _: {"coefficient": [0.9, 0.91]})


def test_the_page_is_that_of_the_kept_runs(tmp_path):
    assert write(tmp_path / "fabrics.md", KEPT / "runs") == 0
    assert (tmp_path / "fabrics.md").read_text() == KEPT.with_suffix(".md").read_text()
    assert (tmp_path / "fabrics" / "drape.svg").read_text() == (KEPT / "drape.svg").read_text()


@pytest.mark.parametrize(("field", "value"), [("drape", (0.5, 0.4)), ("drape", (0.2, 1.2)), ("k_bend", -1.0)])
def test_a_fabric_that_can_not_be_is_refused_by_its_field(field, value):
    with pytest.raises(ValueError, match=field):
        Fabric(**{**FABRICS["denim"].__dict__, field: value})
