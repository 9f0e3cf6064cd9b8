"""Newton's solvers play hard cases: what they are given is our scene, and their cloth meets our body."""

import numpy as np
import pytest

newton = pytest.importorskip("newton", reason="Newton is not installed: pip install -e '.[peers]'")

from contact_scenes import icosphere  # noqa: E402
from harness.by_newton import ByNewton  # noqa: E402
from harness.kit import JERSEY, Pins, alone, on_body, square, step_of  # noqa: E402
from harness.one import run_one  # noqa: E402
from harness.others import InexpressibleError  # noqa: E402
from harness.scene import Ask, Run  # noqa: E402
from scenes import named  # noqa: E402
from small_scenes import rigid_body, sheet  # noqa: E402

from tryon_solver.body.pose import Pose  # noqa: E402

PEERS = ("vbd", "style3d")
ASK = Ask(vertices=60)
SIDE = 0.2  # m of a square whose pieces pull at each other
INSTANT = 1e-4  # s: a single step in which nothing gets anywhere


def half_pulled(solver, deformed):
    """(3,) N/m by which one half of a deformed square pulls the other across u = 0, a metre of the cut."""
    garment, flat = sheet(9, 9, SIDE, SIDE)
    by = ByNewton(Run(alone(ASK, garment, deformed(flat), effects=())), solver)
    by.advance(INSTANT)
    cut = np.abs(flat[:, 0]) < 1e-9
    half = (flat[:, 0] < -1e-9) + 0.5 * cut
    return (half[:, None] * by.mass[:, None] * by.velocities()).sum(0) / INSTANT / SIDE


@pytest.mark.parametrize(("solver", "stiffness"), [("vbd", 225.0), ("style3d", 250.0)])
def test_stretch_along_the_warp_costs_what_the_fabric_says(solver, stiffness):
    pull = half_pulled(solver, lambda x: x * [1.01, 1, 1])
    np.testing.assert_allclose(pull, [0.01 * stiffness, 0, 0], atol=0.1 * 0.01 * stiffness)


@pytest.mark.parametrize(("solver", "stiffness"), [("vbd", 112.5), ("style3d", 30.0)])
def test_shear_costs_what_the_docstring_says(solver, stiffness):
    pull = half_pulled(solver, lambda x: x + 0.01 * x[:, [2, 1, 0]] * [0.5, 0, 0.5])
    along = pull @ [0, 0, 1]
    assert along == pytest.approx(0.01 * stiffness, rel=0.1)


def test_bending_of_a_cylinder_costs_half_k_bend_by_its_curvature():
    garment, flat = sheet(25, 13, SIDE, 0.1)
    radius = 0.1
    angle = flat[:, 0] / radius
    round_ = np.column_stack([radius * np.sin(angle), radius * np.cos(angle), flat[:, 2]])
    model = ByNewton(Run(alone(ASK, garment, round_)), "vbd").model
    ends, between = model.edge_indices.numpy()[:, 2:], model.edge_indices.numpy()[:, :2]
    inner = (between >= 0).all(1)
    (a, b), (p, q) = round_[ends[inner]].swapaxes(0, 1), round_[between[inner]].swapaxes(0, 1)
    normal = [np.cross(b - a, c - a) for c in (p, q)]
    m, n = (v / np.linalg.norm(v, axis=1)[:, None] for v in normal)
    bent = np.arccos(np.clip(-(m * n).sum(1), -1, 1))
    stiffness = model.edge_bending_properties.numpy()[inner, 0] * model.edge_rest_length.numpy()[inner]
    assert 0.5 * stiffness @ bent**2 == pytest.approx(0.5 * JERSEY.k_bend * SIDE * 0.1 / radius**2, rel=0.06)
    assert not model.edge_rest_angle.numpy().any()


@pytest.mark.parametrize("solver", PEERS)
def test_a_case_is_played_and_judged(solver, tmp_path):
    seen = tmp_path / "corner.npz"
    asked = Ask(vertices=60, seconds=0.1)
    found = run_one(named("corner"), asked, 1, tell=lambda _text: None, solver=solver, frames=seen)
    assert not found["failure"]
    assert found["frames"] == 6
    assert found["growth"] is None
    assert found["speed_at_end"] > 0.3  # m/s, falling
    assert found["cpu_ms"] > 0
    assert seen.exists()


@pytest.mark.parametrize("solver", PEERS)
def test_cloth_falls_through_air_with_our_masses(solver):
    run = named("corner").set_up(ASK)
    by = ByNewton(run, solver)
    np.testing.assert_allclose(by.model.particle_mass.numpy(), run.sim.mass, rtol=1e-6)
    start = by.cloth()
    by.advance(0.02)  # s, in which drag takes 6 % of the way
    assert (start - by.cloth())[:, 1].mean() == pytest.approx(0.5 * 9.81 * 0.02**2, rel=0.15)


@pytest.mark.parametrize("solver", PEERS)
def test_a_body_that_rises_takes_the_cloth_along(solver):
    garment, x = square(100, 0.1)
    ball = rigid_body(*icosphere(0.1, 3))
    sim = on_body(ASK, garment, x + [0, 0.106, 0], ball)
    speed = 0.2  # m/s

    def stance(t):
        return Pose(np.array([0, speed * t, 0]), np.array([[0.0, 0.0, 0.0, 1.0]]))

    by = ByNewton(Run(sim, stance, step_of(sim), stops=0.4), solver)
    for k in range(1, 25):
        by.advance(k / 60)
    middle = speed * 24 / 60 * np.array([0, 1, 0])
    np.testing.assert_allclose(by.surface().mean(0), middle, atol=1e-6)
    assert np.linalg.norm(by.cloth() - middle, axis=1).min() > 0.099
    assert np.linalg.norm(by.cloth() - middle, axis=1).max() < 0.12


def test_cloth_that_springs_hold_is_not_expressible():
    garment, x = square(60, 0.1)
    run = Run(alone(ASK, garment, x, effects=(Pins(np.array([0], np.int32)),)))
    with pytest.raises(InexpressibleError, match="held by no springs"):
        ByNewton(run, "vbd")
