"""A sheet laid on an incline, for the baselines: it stands below the Coulomb threshold and slides above."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from small_scenes import STILL, fabric, rigid_body, sheet, slab, turn

from tryon_solver.scene import BodyContact, Friction, Gravity, Scene

G, DT = 9.81, 1 / 60


def slide(make_solver: Callable[[Scene], Any], mu: float, degrees: float, steps: int) -> np.ndarray:
    """Speed down the incline after each step (steps,) m/s, from rest."""
    tilt = turn((0, 0, -degrees))
    garment, x = sheet(5, 5, 0.08, 0.08)
    body, faces = slab(0.8, 0.3, 0.02, 0.05)
    x = (x + np.array([-0.25, 0.0018, 0.003])) @ tilt.T
    scene = Scene(
        garment,
        x,
        rigid_body(body @ tilt.T, faces),
        fabric(mu_body=mu, mu_self=mu),
        (Gravity(), BodyContact(), Friction()),
    )
    solver = make_solver(scene)
    motion, found = solver.start(STILL), []
    for _ in range(steps):
        motion = solver.step(motion, STILL, DT)
        found.append((motion.v @ tilt[:, 0]).mean())
    return np.array(found)


def check_coulomb(make_solver: Callable[[Scene], Any]) -> None:
    """It stands below tan = mu; above, it accelerates by g (sin - mu cos)."""
    assert np.abs(slide(make_solver, 0.4, 15, 15)[-3:]).max() < 2e-3
    angle = np.radians(30)
    v = slide(make_solver, 0.3, 30, 15)
    assert (v[-1] - v[3]) / (11 * DT) == pytest.approx(G * (np.sin(angle) - 0.3 * np.cos(angle)), rel=0.05)
