"""A step's error is measured in several ways, a simulation goes on from any state, and runs go on where they were."""

from dataclasses import replace

import numpy as np
import one_step_errors
import pytest
from accuracy_case import AccuracyCase, presets, scenes, takes_such_steps
from accuracy_patterns import pattern_of
from against_reference import KEPT_IN, ReferenceStep, known_contacts
from contact_scenes import DT, square_on_sphere
from error_measures import Measures
from families import FAMILIES, SWEPT, preset_family
from methods import Method, ours
from one_step_errors import FIRST, measure_errors, measure_trajectories, reference_steps
from recorded import Writer, read
from small_scenes import STILL
from steppers import NO_CONTACTS, Ours, stepper_of
from worn_start import Worn

from tryon_solver.baselines.newton_ipc import Reference, newton
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build

STEPS = 7  # of the square, until it lies on the ball
HEAD = {"case": {}, "family": "presets", "device": "cpu", "methods": {}}


@pytest.fixture(scope="module")
def square():
    """The scene of cloth on a ball, and a step of the reference in which it lies upon it and its rim falls."""
    case = square_on_sphere()
    reference = Reference(case.scene, kept_in=KEPT_IN)
    motion = reference.start(STILL)
    for _ in range(STEPS):
        before, motion = motion, reference.step(motion, STILL, DT)
    assert len(motion.known.ids) > 5
    return case, ReferenceStep(STEPS, before, motion, 0.0)


@pytest.fixture(scope="module")
def contacts(square):
    """What its contacts have given, as the solver lists them."""
    case, step = square
    return known_contacts(build(case.scene, PRESETS["live"], "cpu", STILL, tangled=True), step.before)


def test_a_converged_step_ends_where_the_reference_does_and_a_short_one_does_not(tmp_path):
    """Of a walking T-shirt of few vertices. A file that was cut off in its second state is gone on with there."""
    case = AccuracyCase("tshirt", "walk", 1 / 60, vertices=150, states=2)
    methods = {"draft": ours(PRESETS["draft"]), "passes 20": FAMILIES["others"](case)["passes 20"]}
    path, told = tmp_path / "rows.jsonl", []
    measure_errors(case, methods, "cpu", Writer(tmp_path / "first.jsonl", HEAD), lambda _: None, until=1)
    assert {row["state"] for row in read(tmp_path / "first.jsonl").rows} == {1}, "the second is left to another run"
    measure_errors(case, methods, "cpu", Writer(path, HEAD), told.append)
    rows = read(path).rows
    assert [(row["state"], row["method"]) for row in rows] == [(k, name) for k in (1, 2) for name in methods]
    assert len(told) == 2
    for draft, converged in zip(rows[::2], rows[1::2]):
        assert converged["error"] < 0.05, "mm"
        for figure in ("error", "largest", "strain", "strain_largest", "normal", "normal_largest", "energy"):
            assert draft[figure] > 2 * abs(converged[figure])
        assert draft["error"] / 6 < draft["estimate"] < 6 * draft["error"]
        assert draft["ms"] > draft["ms_correction"] > 0
        assert (draft["void"], draft["crossed"]) == (False, 0)
    whole = path.read_text()
    path.write_text(whole[: whole.rindex('"method"')])
    measure_errors(case, methods, "cpu", Writer(path, HEAD), told.append)
    assert len(told) == 3, "one state is measured again"
    again = read(path).rows
    assert again[:2] == rows[:2], "to the digit, times too: it is kept"
    assert [(row["state"], row["method"]) for row in again] == [(row["state"], row["method"]) for row in rows]
    assert again[3]["error"] < 0.05
    measure_trajectories(case, methods, "cpu", Writer(tmp_path / "ways.jsonl", HEAD), told.append)
    ways = read(tmp_path / "ways.jsonl").rows
    assert ways[0]["error"] == rows[0]["error"]
    assert ways[2]["error"] != rows[2]["error"], "its second step began where its first one ended"


def test_a_step_in_which_the_reference_finds_no_balance_is_passed_over(monkeypatch):
    """It is cut off after a few iterations: the step after it begins where these had come to, which is free."""
    scene, steps = square_on_sphere(), []
    reference = Reference(scene.scene)
    start = reference.start(STILL)

    def step(self, motion, pose, dt):
        steps.append(motion)
        monkeypatch.setattr(newton, "MOST_ITERATIONS", 3 if len(steps) == FIRST + 2 else 200)
        return of_the_reference(self, motion, pose, dt, 1e-6)

    of_the_reference = Reference.step
    monkeypatch.setattr(one_step_errors, "KEPT_IN", None)
    monkeypatch.setattr(Reference, "step", step)
    case = AccuracyCase("tshirt", "walk", DT, states=3)
    found = list(reference_steps(Worn(scene, start.x, start.v), case))
    assert [one.number for one in found] == [FIRST + 1, FIRST + 3]
    (first, third), between = found, steps[FIRST + 1]
    np.testing.assert_array_equal(between.x, first.after.x)
    assert 1e-4 < np.abs(third.before.x - between.x).max() < 0.1
    assert reference.search.free_share(between.x, third.before.x - between.x) == 1.0


def test_a_simulation_that_has_moved_begins_anew_as_if_built_there(square, contacts):
    """Whatever it did before: trees that were built then list the same pairs in another order, so that a step which
    converges ends in the same balance, but for rounding."""
    case, step = square
    settings = FAMILIES["others"](AccuracyCase("", "", DT))["passes 20"]
    used, fresh = (Ours(case, settings, "cpu") for _ in range(2))
    used.begin(step.after, NO_CONTACTS)
    used.step(STILL, 2 * DT)
    ends = []
    for stepper in (used, fresh):
        stepper.begin(step.before, contacts)
        ends.append(stepper.step(STILL, DT).x)
    np.testing.assert_allclose(ends[0], ends[1], rtol=0, atol=5e-6)
    assert np.abs(ends[0] - step.before.x).max() > 1e-3


def test_contacts_are_looked_for_no_further_a_second_time(square):
    """Of state after state with one simulation: each search of a step looks twice as far as the one before."""
    case, step = square
    sim, sizes = build(case.scene, PRESETS["live"], "cpu", STILL, tangled=True), []
    for _ in range(2):
        known_contacts(sim, step.after)
        sizes.append(sim.candidates.size)
    assert sizes[0] == sizes[1] > 0


@pytest.mark.parametrize(
    ("method", "most"),
    [
        (Method("newton_ipc", at={"tolerance": 1e-8}), 1e-9),
        (ours(replace(PRESETS["live"], contact_passes=20), "float64"), 5e-5),
        (ours(PRESETS["live"], "trial"), 1e-2),
        (Method("xpbd", at={"iterations": 60}), 1e-2),
        (Method("chebyshev", at={"iterations": 60}), 1e-2),
    ],
    ids=lambda value: value.solver if isinstance(value, Method) else "",
)
def test_others_take_the_same_step(square, contacts, method, most):
    """From the reference's state to about where it ends, moving by far more than they miss it by."""
    case, step = square
    stepper = stepper_of(case, method, "cpu")
    stepper.begin(step.before, contacts)
    ended = stepper.step(STILL, DT)
    n = len(step.before.v)
    off = np.linalg.norm(ended.x - step.after.x, axis=1)[:n].max()
    assert off <= most
    way = np.linalg.norm(step.after.x - step.before.x, axis=1)[:n].max()
    assert way > 2 * off, "it is not that nothing moves"


def test_with_no_solver_cloth_goes_on_as_it_went(square):
    case, step = square
    stepper = stepper_of(case, Method("inertia"), "cpu")
    stepper.begin(step.before, None)
    ended = stepper.step(STILL, DT)
    n = len(step.before.v)
    assert np.abs(step.before.v).max() > 0.1
    np.testing.assert_array_equal(ended.x[:n], step.before.x[:n] + DT * step.before.v)
    np.testing.assert_array_equal(ended.x[n:], Reference(case.scene).skin(STILL))


def test_measures_of_a_known_displacement(square):
    """Cloth that is shifted is off by the shift and nowhere strained; stretched cloth is strained by its stretch; a
    vertex pushed through the ball crosses it; what is not a number is told so."""
    case, step = square
    n = len(step.before.v)
    measures = Measures(case, step.after.x, DT)
    measures.begin(step)
    exact = measures.of(step.after.x)
    assert (exact["error"], exact["strain"], exact["energy"], exact["crossed"]) == (0, 0, 0, 0)
    up = step.after.x.copy()
    up[:n, 1] += 2e-3
    shifted = measures.of(up)
    assert shifted["error"] == pytest.approx(2, rel=1e-4)
    assert shifted["largest"] == pytest.approx(2, rel=1e-4)
    assert shifted["strain_largest"] < 1e-6
    assert shifted["normal_largest"] < 1e-3
    assert shifted["energy"] > 0
    wide = step.after.x.copy()
    wide[:n] *= 1.01
    stretched = measures.of(wide)
    assert stretched["strain"] == pytest.approx(1.0, rel=0.02), "%, as stretches are about 1"
    assert stretched["normal_largest"] < 1e-3
    through = step.after.x.copy()
    through[np.argmin(np.linalg.norm(through[:n, [0, 2]], axis=1)), 1] -= 0.1
    pushed = measures.of(through)
    assert pushed["crossed"] > 0
    assert pushed["energy"] is None
    assert pushed["normal_largest"] > 10
    through[3] = np.nan
    assert measures.of(through) == {**dict.fromkeys(pushed), "crossed": len(case.scene.garment.faces)}


@pytest.mark.parametrize(("rate", "own"), [(30, 1), (60, 2), (120, 4)])
def test_presets_take_the_cases_steps(rate, own):
    """None cuts one in two, and it is known whose own steps are as long."""
    assert list(presets(1 / rate)) == list(PRESETS)
    assert all(settings.largest_step >= 1 / rate for settings in presets(1 / rate).values())
    assert [takes_such_steps(name, 1 / rate) for name in PRESETS] == [True] * own + [False] * (4 - own)
    cases = scenes(1 / rate)
    assert len(cases) >= 6
    assert 2 <= sum(case.held_out for case in cases) < len(cases)


def test_a_sweep_changes_something_and_takes_the_cases_steps():
    """No two settings of a case are the same; none of a sweep is a preset."""
    case = scenes(1 / 30)[0]
    swept = [(f, m) for f in SWEPT for m in FAMILIES[f](case).values()]
    assert len({(m.solver, str(m.settings)) for _, m in swept}) == len(swept)
    for family, method in swept:
        steps = 1 / 30 / method.settings.largest_step
        assert steps == pytest.approx(method.at.get("substeps", 1)) or family == "precision"
    known = {str(method.settings) for method in preset_family(case).values()}
    assert not {str(m.settings) for f, m in swept if f not in ("precision", "trial")} & known


def test_the_layered_skirt_has_a_second_layer_on_each_panel():
    assert len(pattern_of("layered_skirt").panels) == 2 * len(pattern_of("skirt").panels)
