"""What a scene does not call for is neither imported, nor compiled, nor launched, nor allocated.

Each scene runs in a process of its own (tests/support/cost_probe.py), for imports can't be undone. Measured on the
processor: Warp's own tracker counts allocations of arrays, trees and grids, in Python and in its native layer.
"""

import json
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

PROBE = Path(__file__).resolve().parents[2] / "support" / "cost_probe.py"
ALL = ("Gravity", "BodyContact", "SelfContact", "Friction", "StrainLimit", "AirDrag", "FabricDamping")
MODULE = {
    "Gravity": "gravity",
    "Friction": "friction",
    "StrainLimit": "strain_limit",
    "AirDrag": "air_drag",
    "FabricDamping": "strain_rate",
}
# these launch nothing of their own
MARKERS = {"BodyContact": "body_contact", "SelfContact": "self_contact", "FabricDamping": "fabric_damping"}


@cache
def probe(effects, *flags):
    """What a scene with these effects costs."""
    command = [sys.executable, str(PROBE), ",".join(effects), *flags]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=240)
    assert done.returncode == 0, done.stderr[-3000:]
    return json.loads(done.stdout.strip().splitlines()[-1])


def parts_of(cost, module):
    """Everything in the costs that belongs to an effect's modules."""
    name = f".{module}"
    files = cost["allocated_in"]
    return {
        "imported": [m for m in cost["imported"] if m.endswith(name)],
        "loaded": [m for m in cost["loaded"] if m.endswith(name)],
        "launched": [k for k in cost["launched"] if f"{name}." in k],
        "allocated_in": [f for f in files if f == f"{module}.py"],
    }


def test_worn_scene_pays_for_all_of_them():
    """The control: with everything listed, each effect shows up in every column, so absence below means something."""
    cost = probe(ALL, "steady")
    assert cost["pairs"] > 0
    for effect, module in MODULE.items():
        parts = parts_of(cost, module)
        assert parts["imported"], effect
        assert parts["loaded"], effect
        assert parts["launched"], effect
    for effect in ("Friction", "StrainLimit"):
        assert parts_of(cost, MODULE[effect])["allocated_in"], effect


@pytest.mark.parametrize(
    "absent",
    [*(pytest.param(e, marks=pytest.mark.long) for e in ("Friction", "StrainLimit", "AirDrag")), "FabricDamping"],
)
def test_absent_effect_costs_nothing(absent):
    """A scene without it, in contact with the body and itself."""
    cost = probe(tuple(e for e in ALL if e != absent))
    assert cost["pairs"] > 0 or absent != "Friction"
    assert parts_of(cost, MODULE[absent]) == {"imported": [], "loaded": [], "launched": [], "allocated_in": []}
    assert MODULE[absent] not in cost["plan"]
    assert MARKERS.get(absent, absent) not in cost["plan"]


def test_bare_scene_costs_nothing_optional():
    """Nothing listed: no effect's module, no contact kernel, not a word of them in the plan."""
    cost = probe(())
    for module in (*MODULE.values(), *MARKERS.values(), "sewing", "pins"):
        assert parts_of(cost, module) == {"imported": [], "loaded": [], "launched": [], "allocated_in": []}, module
        assert module not in cost["plan"]
    assert not [k for k in cost["launched"] if ".effects." in k]
    assert not [k for k in cost["launched"] if k.startswith("tryon_solver.body.")]
    assert cost["allocations"] < probe(ALL, "steady")["allocations"]


FREE = ("Gravity", "StrainLimit", "AirDrag", "FabricDamping")


@pytest.mark.parametrize("effects", [(), FREE, ("Gravity", "Friction")])
def test_scene_that_touches_nothing_has_nothing_of_contact(effects):
    """No module below contact/ is imported, and so a GPU compiles none; what a scene in contact has of them is the
    control."""
    names = ("imported", "loaded", "launched")
    worn, cost = probe(ALL, "steady"), probe(effects)
    files = {f"{name.rpartition('.')[2]}.py" for name in of_contact(worn, "imported")} | {"arm_contact.py"}
    assert all(len(of_contact(worn, name)) > 8 for name in names)
    assert len(files & set(worn["allocated_in"])) > 4
    assert [of_contact(cost, name) for name in names] == [[], [], []]
    assert parts_of(cost, "friction")["imported"] == [], "what can't act is not there either"
    assert not files & set(cost["allocated_in"])


# the core's, launched where a move overshot, where fewer iterations are left than a budget has, and where the largest
# of some numbers is asked for, as of a draft's stretches in any scene
OF_THE_STATE = {
    "tryon_solver.stepping.overshoot.retreat_kernel",
    "tryon_solver.stepping.progress.limit_kernel",
    "tryon_solver.linalg.vectors.largest_number_kernel",
}


@pytest.mark.parametrize("touching", [("Gravity", "SelfContact"), ("Gravity", "BodyContact"), ALL])
def test_no_module_that_all_scenes_have_holds_a_kernel_of_contact(touching):
    """A GPU compiles all kernels of what is imported: those that only a scene in contact launches are in modules that a
    scene without contact does not import."""
    worn, free = probe(touching, "steady"), probe(FREE)
    more = set(worn["launched"]) - set(free["launched"])
    assert len(more) > 10
    there = {kernel for kernel in more if kernel.rpartition(".")[0] in free["imported"]}
    assert there <= OF_THE_STATE


def test_the_step_imports_nothing_of_the_scheme_it_does_not_run():
    names = ("tryon_solver.stepping.two_level", "tryon_solver.subspace.contact_coarse")
    assert not set(names) & set(probe(ALL, "steady")["imported"])


def test_cloth_of_one_piece_that_may_touch_no_body_has_nothing_of_flight():
    """What a worn scene has of it is the control."""
    worn, cost = (parts_of(probe(effects, "steady"), "stepping.fly") for effects in (ALL, ("Gravity", "SelfContact")))
    assert worn["imported"]
    assert worn["launched"]
    assert cost == {"imported": [], "loaded": [], "launched": [], "allocated_in": []}


CLOTH_ALONE = """
import sys
import numpy as np
from tryon_solver.geometry.garment import Garment
from tryon_solver.scene import Gravity, Scene
from tryon_solver.simulation import build

x = np.array([[0.0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]]) * 0.1
faces = np.array([[0, 2, 1], [0, 3, 2]], np.int32)
garment = Garment(faces, x[:, [2, 0]][faces], np.zeros(2, np.int32), 4)
sim = build(Scene(garment, x, None, effects=(Gravity(),)), None, "cpu")
sim.advance(None, 0.1)
assert sim.cloth_positions()[:, 1].max() < -0.01
only = ("enclosed", "lines", "seams", "boundary_loops")
print("of effects:", *(name for name in only if f"tryon_solver.geometry.{name}" in sys.modules))
print("of a body:", *sorted(name for name in sys.modules if name.startswith("tryon_solver.body")))
"""


def test_bare_scene_imports_nothing_of_a_body_nor_of_absent_effects():
    """Neither how one is posed, nor how motions are read, nor how cloth is carried along; nor what gas, elastic and
    creases are checked with."""
    done = subprocess.run([sys.executable, "-c", CLOTH_ALONE], capture_output=True, text=True, check=False, timeout=240)
    assert done.returncode == 0, done.stderr[-3000:]
    assert done.stdout.strip().splitlines()[-2:] == ["of effects:", "of a body:"]


LEFT_IDLE = f"""
import sys
import numpy as np
sys.path.insert(0, {str(Path(__file__).parents[2] / "support")!r})
from small_scenes import fabric, sheet
from tryon_solver import scene as s
from tryon_solver.simulation import build
none, edges = np.zeros(0, np.int32), np.zeros((0, 2), np.int32)
effects = (
    s.Gravity((0.0, 0.0, 0.0)), s.StrainLimit(0.0), s.FabricDamping(0.0), s.Sleep(speed=0.0), s.Pins(none),
    s.Fasteners(edges), s.Sewing(edges, 1.0), s.Attached(none, np.zeros((0, 3), np.int32), np.zeros((0, 3)), 1.0),
    s.Elastic((s.ElasticLine(np.array([[0, 1]]), 0.8, 0.0),)), s.Creases(edges, np.zeros(0)), s.StretchCurves(),
    s.AirDrag(0.0), s.Friction(),
)
garment, x = sheet(4, 4, 0.1, 0.1)
sim = build(s.Scene(garment, x, None, fabric(), effects))
print(len(effects), *(line for line in sim.plan.describe().splitlines() if line.startswith("not in")), sep="; ")
print("imported:", *(effect.module for effect in effects if effect.module in sys.modules))
"""


def test_effects_that_are_listed_with_nothing_to_do_are_not_imported():
    done = subprocess.run([sys.executable, "-c", LEFT_IDLE], capture_output=True, text=True, check=False, timeout=240)
    assert done.returncode == 0, done.stderr[-3000:]
    plan, imported = done.stdout.strip().splitlines()[-2:]
    listed, *left = plan.split("; ")
    assert len(left) == int(listed)
    assert imported == "imported:"


def of_contact(cost, what):
    """Modules or kernels below contact/."""
    return [name for name in cost[what] if name.startswith("tryon_solver.contact.")]


def test_sewing_and_pins_cost_a_worn_garment_nothing():
    cost = probe(ALL, "steady")
    for module in ("sewing", "pins"):
        assert parts_of(cost, module) == {"imported": [], "loaded": [], "launched": [], "allocated_in": []}


def test_step_in_steady_state_allocates_nothing():
    """Two steps of a worn scene after eighty: no array, no tree, no grid, while one wp.zeros is counted as one."""
    cost = probe(ALL, "steady")
    assert cost["control_allocations"] == 1
    assert cost["allocations"] > 50
    assert cost["steady_allocated_in"] == []
    assert cost["steady_allocations"] == 0
