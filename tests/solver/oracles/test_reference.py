"""The reference's parts: distances against IPC Toolkit, derivatives against differences, the residual against the
solver's own gradient."""

from dataclasses import replace

import ipctk
import numpy as np
import pytest
from contact_scenes import DT, SCENES, square_on_sphere
from small_scenes import STILL

from tryon_solver.baselines.newton_ipc import Reference
from tryon_solver.baselines.newton_ipc.distance import closest, distance_gradient, distance_hessian
from tryon_solver.baselines.newton_ipc.potential import Lagged
from tryon_solver.scene import WORN, Attached, Scene
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build
from tryon_solver.stepping.correct import look_around
from tryon_solver.stepping.predict import predict_positions
from tryon_solver.stepping.search import search_around

SEWN_ON = Attached(np.array([30, 400]), np.array([[70, 71, 94], [17, 40, 41]]), np.array([[0.2, 0.3, 0.5]] * 2), 80.0)
TOOLKIT = {
    0: (ipctk.point_triangle_distance, ipctk.point_triangle_distance_gradient, ipctk.point_triangle_distance_hessian),
    1: (ipctk.edge_edge_distance, ipctk.edge_edge_distance_gradient, ipctk.edge_edge_distance_hessian),
}


@pytest.mark.parametrize("kind", [0, 1])
def test_distances_are_the_toolkits(kind, rng):
    """Every feature's case, 300 stencils: d, its gradient and its Hessian from those of the toolkit's d^2."""
    corners = rng.standard_normal((300, 4, 3))
    at = closest(np.full(300, kind), corners)
    slope, hessian = distance_gradient(at), distance_hessian(at, corners)
    free = (at.rates != 0).any(2).sum(1)
    assert (np.bincount(free, minlength=3) > 20).all()  # corners, edges and insides all occur
    value_of, gradient_of, hessian_of = TOOLKIT[kind]
    for k, corner in enumerate(corners):
        d = np.sqrt(value_of(*corner))
        gradient = gradient_of(*corner) / (2 * d)
        expected = hessian_of(*corner) / (2 * d) - np.outer(gradient, gradient) / d
        assert at.d[k] == pytest.approx(d, rel=1e-9)
        np.testing.assert_allclose(slope[k], gradient, rtol=0, atol=1e-8)
        np.testing.assert_allclose(hessian[k], expected, rtol=0, atol=1e-6 * max(1, np.abs(expected).max()))


def touching_state(effects):
    """A square that has come upon a ball askew: a step's problem and a free state of it with contact pairs."""
    case = square_on_sphere()
    scene = Scene(case.scene.garment, case.scene.x_start, case.scene.body, case.scene.fabric, effects)
    ref = Reference(scene)
    motion = ref.start(STILL)
    n = ref.discrete.cloth_count
    # settle it by hand: down until the nearest pair has a fifth of its activation distance left, and stretched
    cloth = motion.x[:n].copy()
    cloth[:, [0, 2]] *= 1.02
    low, high = 0.0, 0.05
    for _ in range(40):
        middle = 0.5 * (low + high)
        gap = smallest_gap(ref, np.vstack([cloth - [0, middle, 0], motion.x[n:]]))
        low, high = (middle, high) if gap > 4e-4 else (low, middle)
    x = np.vstack([cloth - [0, low, 0], motion.x[n:]])
    x = x.astype(np.float32).astype(np.float64)
    return scene, ref, motion, x


def smallest_gap(ref, x):
    """m; that of stencils in reach, else their reach."""
    try:
        g = Lagged(ref.problem(ref.start(STILL), STILL, DT), ref.search, x).pairs.g
    except ValueError:
        return 0.0
    return g.min() if len(g) else ref.discrete.contact.d_hat


def test_residual_is_the_lagged_energys_gradient(rng):
    """Central differences of the energy along random directions, and of its gradient for the exact Hessian."""
    _, ref, motion, x = touching_state((*WORN, SEWN_ON))
    problem = ref.problem(turning(motion, rng), STILL, DT)
    lagged = ref.at(problem, x)
    assert len(lagged.pairs.ids) > 5
    force, hessian = lagged.residual(), lagged.hessian(clamped=False)
    for _ in range(4):
        p = rng.standard_normal(x.shape)
        p /= np.sqrt((p**2).sum(1).max())
        step = 1e-7
        slope = (lagged.energy(x + step * p) - lagged.energy(x - step * p)) / (2 * step)
        assert (force * p).sum() == pytest.approx(slope, rel=1e-5, abs=1e-6 * np.abs(force * p).sum())
        curvature = (lagged.energy(x + 20 * step * p) - 2 * lagged.energy(x) + lagged.energy(x - 20 * step * p)) / (
            400 * step**2
        )
        assert p.ravel() @ (hessian @ p.ravel()) == pytest.approx(curvature, rel=2e-3)


def turning(motion, rng):
    """The same of cloth that turns, and more in some places than in others."""
    cloth = motion.x[: len(motion.v)]
    return replace(motion, v=np.cross([2.0, -3.0, 4.0], cloth) + 0.05 * rng.standard_normal(cloth.shape))


def test_residual_is_the_solvers_gradient(rng):
    """All effects at once, fabric damping too, at a state with stretch and contact: to float32's digits."""
    scene, ref, motion, x = touching_state((*WORN, SEWN_ON))
    motion = turning(motion, rng)
    n = ref.discrete.cloth_count
    problem = ref.problem(motion, STILL, DT)
    expected = ref.at(problem, x)
    found = solvers_gradient(scene, motion, x)
    force = expected.residual()
    assert len(expected.pairs.ids) > 5
    assert found["pairs"] == len(expected.pairs.ids)
    # the gap is a difference of float32 positions: 2^-24 of 0.3 m, times the pair's stiffness, is its force's error
    roundings = 4 * 2.0**-24 * 0.3
    stiff = np.zeros(len(x))
    hessian = expected.hessian(clamped=True)
    stiff[:] = np.abs(hessian.diagonal()).reshape(-1, 3).max(1)
    np.testing.assert_array_less(np.abs(found["gradient"] - force).max(1), 12 * stiff * roundings + 1e-7)
    assert np.abs(force[:n]).max() > 100 * (12 * stiff * roundings).min()


def solvers_gradient(scene, motion, x):
    """What `look_around` of the correction finds at x, in a step from `motion`."""
    sim = build(scene, PRESETS["live"], "cpu", STILL)
    sim.state.x_start.assign(motion.x.astype(np.float32))
    sim.state.v.assign(motion.v.astype(np.float32))
    sim.start_report()
    sim.use_time_step(DT)
    predict_positions(sim)
    sim.state.x.assign(x.astype(np.float32))
    sim.work.direction.zero_()
    search_around(sim, sim.state.x, sim.work.direction)
    sim.x_searched.assign(x.astype(np.float32))
    sim.work.gradient.fill_(np.nan)
    look_around(sim, near=False)
    return {"gradient": sim.work.gradient.numpy().astype(np.float64), "pairs": sim.pairs.size}


@pytest.mark.parametrize("name", SCENES)
def test_scenes_are_of_the_size_they_are_said_to_be(name):
    """500 to 2,000 vertices of cloth, free of contact at the start."""
    case = SCENES[name]()
    ref = Reference(case.scene)
    assert 500 <= ref.discrete.cloth_count <= 2000
    ref.at(ref.problem(ref.start(case.pose_at(0)), case.pose_at(0), DT), ref.start(case.pose_at(0)).x)


def test_states_are_kept_by_content(tmp_path):
    """The same step is read back to the bit; another time step, velocity or fabric is solved anew."""
    case = SCENES["strip below mu"]()
    first = Reference(case.scene, kept_in=tmp_path)
    start = first.start(STILL)
    after = first.step(start, STILL, DT)
    assert len(list(tmp_path.glob("*.npz"))) == 1
    again = Reference(case.scene, kept_in=tmp_path)
    again.search = None  # solving would need it
    np.testing.assert_array_equal(again.step(start, STILL, DT).x, after.x)
    assert again.solved.iterations == first.solved.iterations
    for other in (replace(case.scene.fabric, k_warp=601.0), replace(case.scene.fabric, mu_body=0.59)):
        changed = Reference(replace(case.scene, fabric=other), kept_in=tmp_path)
        assert changed.digest != first.digest
    with pytest.raises(AttributeError):
        again.step(start, STILL, 0.9 * DT)
