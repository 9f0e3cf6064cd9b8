"""The plan lists exactly what the scene asked for, stage by stage."""

from collections import Counter
from dataclasses import fields, replace

import ipctk
import numpy as np
import pytest
from small_scenes import STILL, fabric, folded_sheet, icosphere, rigid_body, sheet

from tryon_solver.scene import (
    AirDrag,
    BodyContact,
    FabricDamping,
    Friction,
    Gravity,
    Gusts,
    Pins,
    Scene,
    SelfContact,
    Sleep,
    StrainLimit,
    Wind,
)
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build
from tryon_solver.stepping.clocked import calls_in_a_frame, contribution_times, in_a_frame

NAMES = {
    Gravity: "gravity",
    BodyContact: "body_contact",
    SelfContact: "self_contact",
    Friction: "friction",
    StrainLimit: "strain_limit",
    AirDrag: "air_drag",
    FabricDamping: "fabric_damping",
    Sleep: "sleep",
}

IDLE = "not in the step: "


def described(effects, cloth=None):
    """Stage -> names of the contributions in it, as `describe` prints them, and of what has nothing to do why."""
    garment, x = sheet(5, 5, 0.2, 0.2)
    body = rigid_body(*icosphere(0.05, 1)) if any(isinstance(e, BodyContact) for e in effects) else None
    x[:, 1] += 0.06
    sim = build(Scene(garment, x, body, cloth or fabric(), tuple(effects)), None, "cpu", STILL if body else None)
    lines = [line for line in sim.plan.describe().splitlines() if not line.startswith(IDLE)]
    stages = dict(line.split(": ") for line in lines)
    return {stage: [] if names == "-" else names.split(", ") for stage, names in stages.items()}


def idle(effects, cloth=None):
    """What `describe` says of those that have nothing to do."""
    garment, x = sheet(5, 5, 0.2, 0.2)
    plan = build(Scene(garment, x, None, cloth or fabric(), tuple(effects)), None, "cpu").plan
    return [line.removeprefix(IDLE) for line in plan.describe().splitlines() if line.startswith(IDLE)]


def test_bare_scene_has_materials_only():
    plan = described(())
    assert {name for names in plan.values() for name in names} == {"membrane", "bending"}
    assert plan["stiffness"] == ["membrane", "bending"]
    assert plan["touches"] == []
    assert plan["contact"] == []


@pytest.mark.parametrize(
    "kinds", [list(NAMES), [Gravity], [Gravity, BodyContact], [SelfContact, Friction], [StrainLimit]]
)
def test_every_effect_asked_for_is_listed_and_no_other(kinds):
    plan = described([kind() for kind in kinds])
    listed = {name for names in plan.values() for name in names}
    assert listed == {"membrane", "bending"} | {NAMES[kind] for kind in kinds}


def test_effects_take_part_where_they_should():
    plan = described([kind() for kind in NAMES])
    assert plan["add_acceleration"] == ["gravity"]
    assert plan["touches"] == ["body_contact", "self_contact"]
    assert plan["contact"] == ["friction"]
    assert plan["add_velocity_gradient"] == ["air_drag"]
    assert plan["diagonal"] == ["air_drag"]
    assert "membrane" in plan["project"]
    assert set(plan["add_triangle_hessian"]) >= {"membrane", "strain_limit"}


@pytest.mark.parametrize(
    ("effect", "cloth"),
    [
        (Gravity((0.0, 0.0, 0.0)), None),
        (StrainLimit(0.0), None),
        (AirDrag(0.0), None),
        (FabricDamping(0.0), None),
        (Sleep(speed=0.0), None),
        (Friction(), fabric(mu_body=0.0, mu_self=0.0)),
    ],
)
def test_effect_with_nothing_to_do_is_left_out(effect, cloth):
    """Bound once, at build: a zero is not carried through every step."""
    plan = described((SelfContact(), effect), cloth)
    assert NAMES[type(effect)] not in {name for names in plan.values() for name in names}


def test_the_plan_says_what_has_nothing_to_do_and_why():
    (told,) = idle((Gravity(), Friction()))
    assert told == "friction, nothing touches: list BodyContact or SelfContact for it to act"
    assert idle((SelfContact(), Friction())) == []
    (told,) = idle((Gravity((0.0, 0.0, 0.0)),))
    assert told.startswith("gravity, ")


def test_fabric_without_bending_has_no_bending_term():
    plan = described((), fabric(k_bend=0.0))
    assert {name for names in plan.values() for name in names} == {"membrane"}


def test_the_plan_tells_what_calls_take_when_it_is_asked_to():
    """Every stage that does something in a step has a time; steps go on as if nothing had been measured."""
    garment, x = sheet(5, 5, 0.2, 0.2)
    x[:, 1] += 0.053
    effects = (Gravity(), BodyContact(), SelfContact(), Friction(), StrainLimit(), FabricDamping())
    blown = (*effects, Wind((1.0, 0.0, 0.0), Gusts()))
    ends = []
    for measuring in (False, True):
        sim = build(Scene(garment, x, rigid_body(*icosphere(0.05, 1)), fabric(), blown), None, "cpu", STILL)
        for k in range(12):
            sim.advance(STILL, (k + 1) / 60)
            if measuring and k == 8:
                times = contribution_times(sim, repeats=2)
        ends.append(sim.cloth_positions())
    assert (ends[0] == ends[1]).all()
    assert set(times["wind"]) == {"start_step", "add_velocity_gradient", "add_diagonal"}
    assert set(times["friction"]) == {"start_step", "contact"}
    asked_of_contact = {"detection", "assembly", "product", "time_of_impact", "verification"}
    assert set(times["body_contact"]) == asked_of_contact
    assert set(times["self_contact"]) == {"detection", "assembly"}  # it is nowhere near itself
    assert all(taken > 0 for stages in times.values() for taken in stages.values())
    told = sim.plan.describe({"gravity": {"add_acceleration": 0.25}})
    assert "add_acceleration: gravity 0.250 ms" in told.splitlines()
    assert "0.250" not in sim.plan.describe()
    told = sim.plan.describe({"body_contact": {"detection": 0.5, "assembly": 0.25}})
    assert "touches: body_contact (detection 0.500 ms, assembly 0.250 ms), self_contact" in told.splitlines()


def test_effect_listed_twice_is_refused():
    garment, x = sheet(5, 5, 0.2, 0.2)
    with pytest.raises(ValueError, match="Gravity is listed twice"):
        Scene(garment, x, None, fabric(), (Gravity(), Gravity()))


def test_body_contact_without_a_body_is_refused():
    garment, x = sheet(5, 5, 0.2, 0.2)
    with pytest.raises(ValueError, match="BodyContact needs a body"):
        Scene(garment, x, None, fabric(), (BodyContact(),))


@pytest.mark.parametrize("preset", ["draft", "live"])
def test_how_often_a_frame_calls_a_stage(preset):
    """Counted in the calls themselves, of a sheet on a ball in a wind."""
    garment, x = sheet(15, 15, 0.3, 0.3)
    x[:, 1] += 0.102
    effects = (Gravity(), BodyContact(), Friction(), FabricDamping(), Wind((3.0, 0.0, 0.0)), StrainLimit())
    scene = Scene(garment, x, rigid_body(*icosphere(0.1, 2)), fabric(), effects)
    sim = build(scene, PRESETS[preset], "cpu", STILL)
    for k in range(6):
        sim.advance(STILL, (k + 1) / 30)
    counted = Counter()

    def counting(stage, call):
        def called(*given):
            counted[stage] += 1
            return call(*given)

        return called

    plain = [one.name for one in fields(sim.stages) if one.name not in ("dyads", "sleep", "contact")]
    ones = {name: tuple(counting(name, call) for call in getattr(sim.stages, name)[:1]) for name in plain}
    rest = {name: getattr(sim.stages, name)[1:] for name in plain}
    (term,) = sim.stages.contact
    contact = (replace(term, add_stiffness=counting("contact", term.add_stiffness)),)
    sim.stages = replace(sim.stages, contact=contact, **{name: ones[name] + rest[name] for name in plain})
    for k in range(4):
        counted.clear()
        sim.advance(STILL, (k + 7) / 30)
        told = calls_in_a_frame(sim)
        assert len(counted) > 7
        for stage, count in counted.items():
            assert told[stage] == pytest.approx(count, rel=0.25), (stage, count, told[stage])
    assert in_a_frame({"start_step": 2.0, "project": 1.0}, {"start_step": 1, "project": 12}) == 14.0


@pytest.mark.parametrize("pull", [30.0, 60.0])
def test_measuring_changes_nothing_that_the_next_step_goes_by(pull):
    """A sheet folded over itself, its upper layer pulled down at ever more: the list of what it may meet, which was
    made when it was slow, is extended and not made anew. Judged by IPC Toolkit, and held to what is not measured."""
    garment, x, layer = folded_sheet(7e-3)
    effects = (Gravity((0.0, -1e-3, 0.0)), Pins(np.flatnonzero(layer == 0).astype(np.int32), 1e3), SelfContact())
    mesh = ipctk.CollisionMesh(x, ipctk.edges(garment.faces), garment.faces)
    ends = []
    for measured in (False, True):
        sim = build(Scene(garment, x, None, fabric(), effects), PRESETS["live"], "cpu")
        gravity = next(one for one in sim.plan.contributions if one.name == "gravity").values["acceleration"]
        for k, g in enumerate((1e-3, 1e-3, 1e-3, 6.0, pull, pull, pull)):
            if measured and k == 4:
                contribution_times(sim, repeats=1)
            gravity.assign(np.array([[0.0, -g, 0.0]], np.float32))
            began = sim.cloth_positions().astype(np.float64)
            sim.advance(None, (k + 1) / 60)
            ended = sim.cloth_positions().astype(np.float64)
            assert ipctk.is_step_collision_free(mesh, *(np.asfortranarray(one) for one in (began, ended)))
        ends.append(ended)
    assert np.abs(ends[0] - x).max() > 0.01
    np.testing.assert_array_equal(ends[1], ends[0])
