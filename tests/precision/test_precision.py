"""A step in float32 is the step in float64 to 0.05 mm, and the twin that says so is one."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp
from compared import PLACES, apart, compared_steps
from contact_scenes import DT, sleeve_on_limb
from in_float64 import DOUBLE, twin_module
from precision_cases import Case
from twin_step import Moment, Stepper

from tryon_solver.scene import WORN
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build
from tryon_solver.stepping import correct

LIMIT = 0.05e-3  # m
SLEEVE = sleeve_on_limb()
LIVE = PRESETS["live"]
BARRIER = twin_module("contact.barrier").barrier


def sleeve(first, last, preset="live"):
    """A sewn sleeve of 528 vertices on a limb that bends: contact, friction, carried motion, damping."""
    scene = replace(SLEEVE.scene, effects=WORN)
    return Case("sleeve", scene, replace(PRESETS[preset], largest_step=DT), SLEEVE.pose_at, first, last, DT)


@pytest.fixture(scope="module")
def steps():
    """Three steps, the second of them with contact passes, too."""
    return list(compared_steps(sleeve(10, 12), every=1, converge=2))


@pytest.fixture(scope="module")
def start():
    """A simulation before its tenth step, and its states before the first and now."""
    case = sleeve(10, 10)
    run = build(case.scene, LIVE, "cpu", case.stance_at(0), tangled=True)  # not looked at: no trees are built yet
    first = Moment.of(run)
    for number in range(1, 10):
        run.advance(case.stance_at(number), number * DT)
    return run, first, Moment.of(run)


def tenth(stepper, moment):
    """From that state."""
    return stepper.step(moment, SLEEVE.pose_at(10), 10 * DT)


def test_step_is_that_in_float64(steps):
    assert len(steps) == 3
    for step in steps:
        assert step.precisions.one.report.pairs > 100
        assert 0 < step.precisions.rms <= LIMIT
        assert step.precisions.largest <= LIMIT


def test_converged_step_is_that_in_float64(steps):
    converged = [step.converged for step in steps if step.converged]
    assert len(converged) == 2
    for step in converged:
        assert max(taken.report.residual for taken in (step.one, step.other)) < LIVE.correction_tolerance
        assert 0 < step.largest <= LIMIT


def test_precisions_part_by_rounding_only_up_to_the_correction(steps):
    """Carrying, the contact-free step and the cycles have no threshold to fall to either side of."""
    for step in steps:
        assert list(step.precisions.at) == list(PLACES)
        for place in PLACES[:3]:
            assert 0 < step.precisions.at[place].max() < 0.01e-3


def test_starts_that_float32_does_not_tell_apart_are_another_in_float64(steps):
    for step in steps:
        assert 0 < step.starts.rms <= LIMIT


def test_twin_is_in_float64(start):
    """All that its kernels declare, and all arrays of its state and workspace. Warp mixes no types by itself: what is
    declared float64 is computed in it."""
    _, _, moment = start
    sim = Stepper(sleeve(1, 1).scene, LIVE, moment.stance, in_float64=True).sim
    for arrays in (sim.state, sim.work, sim.pairs, sim.cg, sim.search, sim.contact, sim.region):
        for name, value in vars(arrays).items():
            if isinstance(value, wp.array):
                assert getattr(value.dtype, "_wp_scalar_type_", value.dtype) in (wp.float64, wp.int32, wp.int64), name
    names = ("contact.pairs", "contact.bounds", "effects.friction", "effects.slip", "stepping.correct")
    names += ("linalg.pcg", "linalg.ell")
    values = [value for name in names for value in vars(twin_module(name)).values()]
    kernels = [value for value in values if isinstance(value, wp.Kernel)]
    assert len(kernels) > 10
    for kernel in kernels:
        assert kernel.module.name.startswith(DOUBLE)
        for argument in kernel.adj.args:
            declared = getattr(argument.type, "dtype", argument.type)
            assert declared not in (wp.float32, wp.vec3, wp.vec4, wp.mat33, float), (kernel.key, argument.label)


@wp.kernel
def barrier_kernel(out: wp.array(dtype=wp.float64)):
    out[0] = BARRIER(wp.float64(0.1), wp.float64(0.3), wp.float64(0.03))
    out[1] = BARRIER(wp.float64(0.1), wp.float64(0.3), wp.float64(0.2))


def test_twins_functions_keep_all_digits():
    """Literals too: the barrier, and its expansion about the floor, whose half is one."""
    out = wp.zeros(2, dtype=wp.float64, device="cpu")
    wp.launch(barrier_kernel, 1, [], [out], device="cpu")
    log, reach = np.log(0.2 / 0.3), 0.2 - 0.3
    slope = -2 * reach * log - reach**2 / 0.2
    curvature = -2 * log - 4 * reach / 0.2 + (reach / 0.2) ** 2
    expanded = -(reach**2) * log + (slope + 0.5 * curvature * -0.1) * -0.1
    np.testing.assert_allclose(out.numpy(), [-(0.2**2) * np.log(0.1 / 0.3), expanded], rtol=1e-13)


def test_moment_is_all_that_a_step_takes_over(start):
    """A simulation put into it takes the same step, to the last bit, whatever it did before."""
    run, first, moment = start
    case = sleeve(1, 1)
    other = Stepper(case.scene, LIVE, case.stance_at(0), in_float64=False)
    other.step(first, case.stance_at(1), DT)  # builds its trees, in whose order pairs are summed
    tenth(other, moment)
    again = tenth(other, moment)
    run.advance(case.stance_at(10), 10 * DT)
    np.testing.assert_array_equal(again.x, run.cloth_positions())


def test_positions_rounded_to_float16_are_seen(start, monkeypatch):
    """As coarse as half precision is a metre from the origin, where the correction takes forces from them."""
    _, _, moment = start
    case = sleeve(1, 1)
    single, double = (Stepper(case.scene, LIVE, case.stance_at(0), in_float64) for in_float64 in (False, True))
    exact = tenth(double, moment)
    fine = apart(10, tenth(single, moment), exact)
    plain = correct.elastic_gradient

    def rounding(sim, x, *others, **options):
        coarse = (x.numpy() + 1.0).astype(np.float16).astype(np.float32) - 1.0
        plain(sim, wp.array(coarse, dtype=wp.vec3, device="cpu"), *others, **options)

    monkeypatch.setattr(correct, "elastic_gradient", rounding)
    assert apart(10, tenth(single, moment), exact).rms > LIMIT > fine.rms
