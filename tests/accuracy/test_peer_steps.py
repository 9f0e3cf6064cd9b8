"""Steps by Newton's solvers: what falls through air, the body's way, and that a captured step is the launched one."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp

pytest.importorskip("newton", reason="Newton is not installed: pip install -e '.[peers]'")

from contact_scenes import DT, square_on_sphere
from methods import Method
from newton_cloth import GAP, MARGIN
from peer_steps import ByNewton
from small_scenes import STILL, sheet

from tryon_solver.baselines.newton_ipc import Motion
from tryon_solver.scene import AirDrag, Gravity

ABOVE = 0.5  # m that the square is lifted by to touch nothing
FALLS = np.array([0.3, -2.0, 0.1])  # m/s
DRAG = 4.0  # N s/m^3
PULL = np.array([0.0, -9.81, 0.0])  # m/s^2
FAR = 116e-3  # m: further than it falls in a step
TOP = 0.175  # m: of the ball, nearly


@pytest.fixture
def scene():
    """Flat cloth on a ball, in air."""
    case = square_on_sphere()
    garment, flat = sheet(9, 9, 0.2, 0.2)
    effects = Gravity(tuple(PULL)), AirDrag(DRAG)
    return replace(case, scene=replace(case.scene, garment=garment, x_start=flat + [0, TOP, 0], effects=effects))


def falling(scene, away=ABOVE):
    """The square that far from where it begins, and as it falls."""
    cloth = scene.scene.x_start + [0, away, 0]
    by = ByNewton(scene, Method("vbd", at={"iterations": 1}), "cpu")
    return Motion(np.vstack([cloth, by.data.skin(STILL)]), np.tile(FALLS, (len(cloth), 1)), STILL)


@pytest.mark.parametrize(("solver", "kept"), [("vbd", 1.0), ("style3d", 0.998)])
@pytest.mark.parametrize("substeps", [1, 2])
def test_cloth_falls_through_air_as_the_formula_says(scene, solver, kept, substeps):
    """A flat sheet moves as one: backward Euler with the drag of the velocity that each sub-step begins with, of which
    so much is kept after it."""
    motion, h = falling(scene), DT / substeps
    by = ByNewton(scene, Method(solver, at={"iterations": 5, "substeps": substeps, "gap": FAR}), "cpu")
    by.begin(motion, None)
    ended = by.step(STILL, DT)
    way, v = np.zeros(3), FALLS
    braked = DRAG / scene.scene.fabric.areal_density
    for _ in range(substeps):
        v = v + h * (PULL - braked * v)
        way, v = way + h * v, kept * v
    cloth = slice(len(motion.v))
    moved = (ended.x - motion.x)[cloth]
    without_air = DT * FALLS + PULL * h * h * substeps * (substeps + 1) / 2
    assert np.abs(way - without_air).max() > 1e-4, "m: the drag is seen"
    np.testing.assert_allclose(moved, np.tile(way, (len(moved), 1)), atol=5e-6)


def test_vbd_goes_no_further_than_its_bound(scene):
    """Which the gap it looks ahead gives it: why it is given one for steps of 1/60 s."""
    motion = falling(scene)
    by = ByNewton(scene, Method("vbd", at={"iterations": 5}), "cpu")
    by.begin(motion, None)
    moved = (by.step(STILL, DT).x - motion.x)[: len(motion.v)]
    np.testing.assert_allclose(np.linalg.norm(moved, axis=1), 0.5 * 0.85 * (MARGIN + GAP), rtol=0.05)


def test_the_body_goes_its_way_while_the_cloth_does(scene):
    """In each sub-step as much of it; what is told at the end is where the skin is."""
    motion = falling(scene)
    by = ByNewton(scene, Method("vbd", at={"iterations": 1, "substeps": 4}), "cpu")
    begun = Motion(motion.x.copy(), motion.v, STILL)
    begun.x[len(motion.v) :] -= [0.02, 0, 0]  # m: the body comes from there
    by.begin(begun, None)
    ended = by.step(STILL, DT)
    skin = by.data.skin(STILL)
    np.testing.assert_array_equal(ended.x[len(motion.v) :], skin)
    np.testing.assert_allclose(by.mesh.mesh.points.numpy(), skin, atol=1e-6)
    np.testing.assert_allclose(by.mesh.mesh.velocities.numpy(), np.tile([0.02 / DT, 0, 0], (len(skin), 1)), atol=1e-4)


@pytest.mark.gpu
@pytest.mark.parametrize("solver", ["vbd", "style3d"])
@pytest.mark.parametrize("substeps", [1, 2, 3])
def test_a_captured_step_is_the_launched_one(scene, solver, substeps):
    """From the same state, on the ball; and another state's is another."""
    if not wp.is_cuda_available():
        pytest.skip("no CUDA device on this machine")
    motion, other = falling(scene, 0.0), falling(scene, 0.03)
    by = ByNewton(scene, Method(solver, at={"iterations": 10, "substeps": substeps}), "cuda:0")
    ends = []
    for begun in (motion, other, motion):
        by.begin(begun, None)
        ends.append(by.step(STILL, DT).x)
    assert by.graph is not None
    np.testing.assert_allclose(ends[2], ends[0], atol=1e-5)
    assert np.abs(ends[1] - ends[0]).max() > 5e-3, "m"
