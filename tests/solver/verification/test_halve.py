"""Steps are halved where carrying tears the cloth, and only there; frames stay free of intersections."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp
from frame_judge import FrameJudge
from small_scenes import STILL, fabric, rigid_body, sheet, slab

from tryon_solver.body import quaternions
from tryon_solver.body.model import BodyModel
from tryon_solver.body.pose import Pose
from tryon_solver.rebind import take_over, with_settings
from tryon_solver.scene import WORN, Scene
from tryon_solver.settings import PRESETS, Settings
from tryon_solver.simulation import build
from tryon_solver.stepping.halve import MOST, Halving

FPS = 30.0
UP = np.array([0.0, 1.0, 0.0])


def halving(most):
    garment, x = sheet(3, 3, 0.2, 0.2)
    scene = Scene(garment, x + np.array([0, 0.01, 0]), rigid_body(*slab(0.5, 0.5, 0.05, 0.05)), fabric(), WORN)
    return build(scene, replace(PRESETS["draft"], most_carried=most), "cpu", STILL).halving, x


def two_plates():
    """A plate at the root, and one beside it that a joint a metre off swings away."""
    left, faces = slab(0.5, 0.5, 0.05, 0.025)
    count = len(left)
    return BodyModel(
        np.vstack([left - [0.26, 0, 0], left + [0.26, 0, 0]]),
        np.vstack([faces, faces + count]).astype(np.int32),
        ("root", "arm"),
        np.array([-1, 0], np.int32),
        np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -1.0]]),
        np.repeat(np.array([0, 1], np.int32), count)[:, None],
        np.ones((2 * count, 1), np.float32),
    )


def swung(angle):
    turns = np.tile(quaternions.IDENTITY, (2, 1))
    turns[1] = quaternions.from_axis_angle(UP, angle)
    return Pose(np.zeros(3), turns)


def across_two_plates(most, speed, frames=6):
    """A sheet lies on both while one goes off at `speed` m/s; reports, what carrying added, and verdicts by ipctk."""
    garment, flat = sheet(33, 33, 0.4, 0.4)
    body = two_plates()
    settings = replace(PRESETS["draft"], most_carried=most)
    sim = build(Scene(garment, flat + np.array([0, 0.004, 0]), body, fabric(), WORN), settings, "cpu", swung(0.0))
    judge = FrameJudge(garment.faces, body.faces, sim.cloth_positions(), sim.body_positions())
    for k in range(5):
        sim.advance(swung(0.0), (k + 1) / FPS)
    begun, reports, carried = sim.state.time, [], []
    for k in range(frames):
        t = (k + 1) / FPS
        reports.append(sim.advance(swung(speed * t), begun + t))
        carried.append(float(sim.progress.carried.numpy()[0]))
        assert judge.judge(sim.cloth_positions(), sim.body_positions()).clean
    return reports, carried


def test_what_carrying_adds_is_measured():
    watch, flat = halving(0.5)
    drawn = flat * [1.0, 1.0, 1.7]
    watch.largest.fill_(np.nan)
    before, after = (wp.array(x, dtype=wp.vec3, device="cpu") for x in (flat * 1.1, drawn))
    watch.measure(before, after)
    assert watch.largest.numpy() == pytest.approx([0.6], rel=1e-5)


def looked(watch, grown):
    watch.grown = grown
    watch.look()
    return watch.times


def test_steps_are_halved_as_often_as_what_is_added_asks_for():
    watch, _ = halving(0.5)
    assert looked(watch, 0.5) == 0
    assert looked(watch, 0.51) == 1
    assert looked(watch, 0.13) == 1, "twice as far it would be half of what is too much"
    assert looked(watch, 0.12) == 0
    assert looked(watch, 1.9) == 2
    assert looked(watch, 1e6) == MOST
    assert [looked(watch, 0.0) for _ in range(MOST + 1)] == [2, 1, 0, 0]


def test_the_least_bound_halves_as_often_as_can_be():
    watch, _ = halving(5e-324)
    assert looked(watch, 0.1) == MOST


def test_a_step_is_looked_at_once_however_many_passes_it_takes():
    garment, flat = sheet(5, 5, 0.2, 0.2)
    scene = Scene(garment, flat + np.array([0, 0.004, 0]), rigid_body(*slab(0.5, 0.5, 0.05, 0.05)), fabric(), WORN)
    sim = build(scene, replace(PRESETS["draft"], contact_passes=5), "cpu", STILL)
    looks, look = [], Halving.look

    def counted(watch):
        looks.append(watch.grown)
        look(watch)

    sim.halving.look = counted.__get__(sim.halving)
    steps = sum(sim.advance(STILL, (k + 1) / FPS).steps for k in range(4))
    assert len(looks) == steps


def test_none_leaves_steps_as_they_are():
    assert halving(None)[0] is None


def test_cloth_without_a_body_is_carried_by_nobody():
    garment, x = sheet(3, 3, 0.2, 0.2)
    assert build(Scene(garment, x, None, fabric(), ()), PRESETS["draft"], "cpu").halving is None


@pytest.mark.parametrize("found", [(0, 0, 0, 0), (1, 0), (3, 3, 2, 1, 0, 0), (2, 1, 3, 0, 0, 0, 0, 0), (0, 3)])
def test_steps_fill_an_interval_whatever_is_found_on_the_way(found):
    watch, _ = halving(0.5)
    watch.times = found[0]
    end, later = 0.0, iter(found[1:])
    for begun, size in watch.parts():
        assert begun == end
        assert size in {0.5**k for k in range(MOST + 1)}
        assert (begun / size).is_integer(), "so that every step is one of a few lengths"
        assert size <= 0.5**watch.times
        end = begun + size
        watch.times = next(later, watch.times)
    assert end == 1.0


def test_cloth_that_is_carried_apart_is_not_torn():
    """A plate goes off at 3 m/s under half of a sheet: in steps of 1/30 s carrying draws triangles out manifold. The
    first step shows it; those after it are shorter."""
    most = PRESETS["draft"].most_carried
    whole, by_whole = across_two_plates(1e6, 3.0, frames=3)  # those after it take ever longer
    halved, by_half = across_two_plates(most, 3.0)
    assert {report.steps for report in whole} == {1}
    assert min(by_whole) > 3.0
    assert max(by_half[1:]) < most
    assert halved[1].steps == 2**MOST
    assert halved[-1].steps == 1, "whole again, once the sheet lies on one plate"
    assert max(report.max_stretch for report in whole[1:]) > 2.0
    assert max(report.max_stretch for report in halved[1:]) < 1.1
    assert max(report.error for report in halved[1:]) < 0.2 * max(report.error for report in whole[1:])


def test_cloth_that_is_carried_as_it_lies_takes_whole_steps():
    reports, carried = across_two_plates(PRESETS["draft"].most_carried, 0.05)
    assert {report.steps for report in reports} == {1}
    assert 0.0 < max(carried) < PRESETS["draft"].most_carried


def test_parts_of_a_step_search_with_its_factor():
    """None waits for another to be made; the matrices that are exact are those of the part."""
    garment, flat = sheet(9, 9, 0.2, 0.2)
    scene = Scene(garment, flat + np.array([0, 0.01, 0]), rigid_body(*slab(0.5, 0.5, 0.05, 0.05)), fabric(), WORN)
    sim = build(scene, PRESETS["draft"], "cpu", STILL)
    made = set(sim.inverses)
    sim.halving.times = MOST
    first = next(iter(sim.pose_intervals(STILL, 1 / FPS)))
    assert first.dt == pytest.approx(first.whole / 2**MOST)
    sim.use_time_step(first.dt, first.whole)
    assert set(sim.inverses) == made
    assert sim.factor_key in made
    np.testing.assert_allclose(sim.mass_per_dt2.numpy(), sim.mass / first.dt**2, rtol=1e-6)
    assert sim.state.dt.numpy() == pytest.approx([first.dt])
    sim.use_time_step(first.dt)
    assert len(sim.inverses) == len(made) + 1


def test_what_takes_over_goes_on_with_halved_steps():
    """Another preset's step is cut of the whole one, and halved as often."""
    garment, flat = sheet(5, 5, 0.2, 0.2)
    scene = Scene(garment, flat + np.array([0, 0.01, 0]), rigid_body(*slab(0.5, 0.5, 0.05, 0.05)), fabric(), WORN)
    worn = build(scene, PRESETS["draft"], "cpu", STILL)
    looked(worn.halving, 100.0)
    assert worn.advance(STILL, 1 / FPS).steps > 1
    worn.halving.times = 2
    (other,) = (made for made in with_settings(worn, PRESETS["live"]) if made is not None)
    assert other.whole == pytest.approx(1 / 60)
    take_over(other, worn)
    assert other.halving.times == 2
    made = set(other.inverses)
    other.advance(STILL, 2 / FPS)
    assert set(other.inverses) == made, "what the first step asks for was made beside"


def test_who_is_put_elsewhere_begins_with_whole_steps():
    garment, flat = sheet(5, 5, 0.2, 0.2)
    x = flat + np.array([0, 0.01, 0])
    body = rigid_body(*slab(0.5, 0.5, 0.05, 0.05))
    sim = build(Scene(garment, x, body, fabric(), WORN), PRESETS["draft"], "cpu", STILL)
    looked(sim.halving, 100.0)
    assert sim.advance(STILL, 1 / FPS).steps > 1
    looked(sim.halving, 100.0)
    sim.start_at(x, body.surface(STILL), STILL)
    assert sim.advance(STILL, 2 / FPS).steps == 1


@pytest.mark.parametrize("most", [0.0, -1.0, np.inf, "much"])
def test_what_may_be_added_is_a_number_above_nothing(most):
    with pytest.raises(ValueError, match=r"settings\.most_carried must be a finite number above 0"):
        Settings(most_carried=most)


def test_a_body_that_outruns_the_one_sub_step_of_a_step_leads_in_one_part(monkeypatch):
    """What is led is told from what the body did by where that took everybody: not all of the way, and a part again."""
    garment, flat = sheet(9, 9, 0.4, 0.4)
    settings = replace(PRESETS["draft"], most_carried=1e6, most_substeps=1)
    scene = Scene(garment, flat + np.array([0, 0.004, 0]), two_plates(), fabric(), WORN)
    sim = build(scene, settings, "cpu", swung(0.0))
    parts, arrived, begin, part = [], [], sim.lead.begin_in_parts, sim.lead.part
    monkeypatch.setattr(sim.lead, "begin_in_parts", lambda sim, count: parts.append(count) or begin(sim, count))
    monkeypatch.setattr(sim.lead, "part", lambda sim: arrived.append(sim.x_carried.numpy().copy()) or part(sim))
    sim.advance(swung(3.0 / FPS), 1 / FPS)
    assert parts == [1]
    gone = np.linalg.norm(arrived[0] - sim.state.x_committed.numpy(), axis=1).max()
    assert 0.5 * settings.substep_travel < gone < 1.5 * settings.substep_travel
