"""Newton's matrix of cloth that is stiff and light: what moves as one is resisted by what it weighs, by no rounding."""

import numpy as np
import pytest
import warp as wp
from newton_product import newton_product
from small_scenes import STILL, fabric, icosphere, rigid_body, sheet

from tryon_solver.scene import WORN, Scene
from tryon_solver.settings import Settings
from tryon_solver.simulation import build
from tryon_solver.stepping.newton import linearise

STIFF = 1e9  # N/m, a steel plate's
DT = 1 / 60


@pytest.fixture(scope="module")
def sim():
    garment, x = sheet(9, 9, 0.3, 0.3)
    cloth = fabric(k_warp=STIFF, k_weft=STIFF, k_shear=0.4 * STIFF, k_bend=10.0)
    rng = np.random.default_rng(3)
    crooked = x + [0, 1.0, 0] + 1e-4 * rng.standard_normal(x.shape)
    made = build(Scene(garment, crooked, rigid_body(*icosphere(0.1, 2)), cloth, WORN), Settings(), "cpu", STILL)
    made.use_time_step(DT)
    made.pairs.size = 0
    for start_step in made.stages.start_step:
        start_step(made.state)
    linearise(made)
    return made


def product(sim, p):
    """Over the cloth, from poison."""
    moved = np.zeros((sim.all_count, 3), np.float32)
    moved[: sim.cloth_count] = p
    out = wp.full(sim.all_count, wp.vec3(np.nan), dtype=wp.vec3, device="cpu")
    newton_product(sim, wp.array(moved, dtype=wp.vec3, device="cpu"), out)
    return out.numpy()[: sim.cloth_count]


def test_a_move_as_one_meets_nothing_but_inertia_and_drag(sim):
    move = np.array([0.3, -0.7, 0.2], np.float32)
    own = sim.work.diagonal.numpy()[: sim.cloth_count, None]
    assert own.min() > 0
    np.testing.assert_allclose(product(sim, move), own * move, rtol=1e-6)


def test_a_stretch_meets_the_cloths_stiffness(sim):
    stretched = 1e-3 * (sim.scene.x_start - sim.scene.x_start.mean(0))
    met = (product(sim, stretched) * stretched).sum()
    area = 0.3 * 0.3
    assert met > 0.5 * STIFF * area * 1e-6  # J, of 2 x 1/2 k A e^2 a direction
