"""Chebyshev-Jacobi projective dynamics against closed forms."""

import numpy as np
import pytest
from incline import check_coulomb
from small_scenes import fabric, sheet

from tryon_solver.baselines.chebyshev_jacobi_pd import ChebyshevJacobi
from tryon_solver.scene import AirDrag, Gravity, Scene, StrainLimit

G, DT = 9.81, 1 / 60


def test_free_fall_is_implicit_eulers():
    """x = g h^2 k (k + 1)/2 after k sub-steps of h: a rigid fall strains nothing."""
    garment, x = sheet(4, 4, 0.1, 0.1)
    solver = ChebyshevJacobi(Scene(garment, x, None, fabric(), (Gravity(), StrainLimit())), substeps=5)
    motion = solver.start()
    for _ in range(3):
        motion = solver.step(motion, None, DT)
    h = DT / 5
    np.testing.assert_allclose(motion.x - x, np.tile([0, -G * h * h * 15 * 16 / 2, 0], (16, 1)), rtol=0, atol=1e-9)


STRIP = {"areal_density": 0.5, "k_warp": 300.0, "k_weft": 150.0, "k_shear": 60.0, "strain_limit": 3.0, "k_bend": 0.0}


def hung(iterations, steps, substeps):
    """How far the end of a strip of 30 cm has sunk, over what its weight says."""
    length = 0.3
    garment, flat = sheet(3, 10, 0.06, length)
    x = np.column_stack([flat[:, 0], -flat[:, 2], 0 * flat[:, 0]])
    top = np.flatnonzero(x[:, 1] > length / 2 - 1e-9)
    scene = Scene(garment, x, None, fabric(**STRIP), (Gravity(), AirDrag(20.0)))
    solver = ChebyshevJacobi(scene, held=top, substeps=substeps, iterations=iterations)
    motion = solver.start()
    for _ in range(steps):
        motion = solver.step(motion, None, DT)
    bottom = x[:, 1] < -length / 2 + 1e-9
    expected = STRIP["areal_density"] * G * length**2 / (2 * STRIP["k_weft"])
    assert expected > 1e-3
    return (x - motion.x)[bottom, 1].mean() / expected


@pytest.mark.long
def test_hanging_strip_extends_as_its_weight_says():
    """The end sinks by rho g L^2/(2 k)."""
    assert hung(40, 40, 8) == pytest.approx(1, rel=0.01)


def test_weights_speed_the_iterations_up(monkeypatch):
    """One step from rest against the same with a thousand iterations; without the weights it is Jacobi."""
    settled = hung(1000, 1, 1)
    fast = abs(hung(40, 1, 1) - settled)
    monkeypatch.setattr("tryon_solver.baselines.chebyshev_jacobi_pd.solver.DELAY", 10**6)
    slow = abs(hung(40, 1, 1) - settled)
    assert slow > 1e-4
    assert fast < 0.2 * slow


@pytest.mark.long
def test_coulomb_threshold():
    check_coulomb(lambda scene: ChebyshevJacobi(scene, iterations=20))
