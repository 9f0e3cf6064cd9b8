"""Adding an effect adds exactly its own modules, kernels and memory, and a scene without it has none of them.

All effects' scenes, in one process (tests/support/effect_costs.py): first without, then with, one after the other.
"""

import json
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "support" / "effect_costs.py"
OF_THE_CORE = {"Sleep", "Sleep, awake"}  # they leave the core nothing to do: no kernel is theirs alone
NOTHING_TO_KEEP = {"AirDrag", *OF_THE_CORE}
EVERYWHERE = {"Gravity", "AirDrag", "BodyContact", "Friction", "Pins"}  # other effects' scenes have them, too


@pytest.fixture(scope="module")
def costs():
    done = subprocess.run([sys.executable, str(SCRIPT)], capture_output=True, text=True, check=False, timeout=280)
    assert done.returncode == 0, done.stderr[-3000:]
    return {cost["name"]: cost for cost in json.loads(done.stdout.strip().splitlines()[-1])}


def test_every_effect_has_a_scene(costs):
    from tryon_solver import scene

    kinds = {name for name, kind in vars(scene).items() if isinstance(kind, type) and hasattr(kind, "module")}
    assert len(kinds) > 15
    assert kinds <= set(costs)


def test_modules_are_imported_when_the_first_scene_with_the_effect_is_built(costs):
    """All scenes have been built without their effect before, so what a scene without it imports is imported."""
    seen = set()
    for name, cost in costs.items():
        if name not in EVERYWHERE and not set(cost["own"]) <= seen:
            assert set(cost["imported"]) == set(cost["own"]) - seen, name
        assert set(cost["imported"]) <= set(cost["own"]), name
        seen |= set(cost["own"])


# the core's, launched where a move overshot, and where fewer iterations are left than a budget has
OF_THE_STATE = {"tryon_solver.stepping.overshoot.retreat_kernel", "tryon_solver.stepping.progress.limit_kernel"}


def test_kernels_are_its_own(costs):
    for name, cost in costs.items():
        modules = {kernel.rpartition(".")[0] for kernel in set(cost["launched"]) - OF_THE_STATE}
        if name in OF_THE_CORE:
            assert not modules & {m for other in costs.values() for m in other["own"]}, name
            continue
        assert modules & set(cost["own"]), name
        assert modules <= set(cost["own"]), name


def test_memory_is_allocated_by_its_modules(costs):
    for name, cost in costs.items():
        files = {f"{module.rpartition('.')[2]}.py" for module in cost["own"]}
        if name in OF_THE_CORE:
            assert not set(cost["allocated_in"]) & files
        else:
            assert set(cost["allocated_in"]) <= files, name
            assert bool(cost["allocated_in"]) == (name not in NOTHING_TO_KEEP), name
            assert (cost["bytes"] > 0) == (name not in NOTHING_TO_KEEP), name


def test_room_for_sums_in_any_order_is_taken_by_who_adds_to_them_and_as_it_is_built(monkeypatch):
    """On a GPU, where graphs may take no memory; here the room is of no places."""
    from effect_scenes import SCENES

    monkeypatch.syspath_prepend(str(SCRIPT.parents[1] / "examples"))

    taken = {}
    for scene in SCENES:
        sim, pose = scene.built(9, True)
        taken[scene.name] = set(vars(sim.sums)) & {"vectors", "numbers", "blocks"}
        for k in range(3):
            sim.advance(pose, (k + 1) / 60)
        assert set(vars(sim.sums)) & {"vectors", "numbers", "blocks"} == taken[scene.name], scene.name
    assert [name for name in ("Gravity", "AirDrag", "FabricDamping", "StrainLimit") if taken[name]] == []
    assert {name for name in taken if len(taken[name]) == 3} >= {"BodyContact", "SelfContact", "Adhesion"}
    assert taken["Elastic"] == taken["Fasteners"] == {"vectors", "blocks"}
