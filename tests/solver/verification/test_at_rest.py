"""Cloth at rest on a ball: the contact carries exactly its weight, and nothing trembles."""

import numpy as np
import pytest
from contact_state import contact_gradient
from scipy.signal import butter, sosfiltfilt
from small_scenes import STILL, fabric, icosphere, rigid_body, sheet

from tryon_solver.contact import pairs
from tryon_solver.scene import WORN, Scene
from tryon_solver.simulation import build

DT, SETTLING, WINDOW = 1 / 60, 150, 60


@pytest.fixture(scope="module")
def rest():
    """The simulation after it settled, its weight [N]; positions (T, N, 3) m and forces (T, 3) N of the last second."""
    garment, x = sheet(15, 15, 0.5, 0.5)
    ball, faces = icosphere(0.17, 3)
    scene = Scene(garment, x + np.array([0, 0.174, 0]), rigid_body(ball, faces), fabric(), WORN)
    sim = build(scene, None, "cpu", STILL)
    frames, forces = [], []
    for k in range(SETTLING + WINDOW):
        report = sim.advance(STILL, (k + 1) * DT)
        assert report.retries == 0
        if k >= SETTLING:
            frames.append(sim.cloth_positions().astype(np.float64))
            forces.append(force_on_body(sim))
    return sim, sim.mass.sum() * 9.81, np.array(frames), np.array(forces)


def force_on_body(sim):
    """(3,) N: barrier and friction summed over the collision surface; the gradient there is minus the force."""
    pairs.collect(sim.pairs, sim.candidates, sim.contact, sim.state.x)
    return -contact_gradient(sim, friction=True)[sim.cloth_count :].sum(0)


def test_contact_carries_the_weight(rest):
    sim, weight, _, forces = rest
    assert sim.pairs.size > 50
    np.testing.assert_allclose(forces[:, 1], -weight, rtol=0.01)
    np.testing.assert_allclose(forces[:, [0, 2]], 0, atol=0.01 * weight)


def test_contact_forces_balance(rest):
    """What the cloth gets from the contacts the surface gets back, to the digits of float32 sums."""
    sim = rest[0]
    pairs.collect(sim.pairs, sim.candidates, sim.contact, sim.state.x)
    found = contact_gradient(sim, friction=True)
    np.testing.assert_allclose(found.sum(0), 0, atol=1e-5 * np.abs(found).sum())


def test_nothing_trembles(rest):
    """RMS velocity above 8 Hz (Butterworth of order 4, forth and back) at most 1 mm/s; the whole of it, 5 mm/s."""
    _, _, frames, _ = rest
    velocity = np.diff(frames, axis=0) / DT
    fast = sosfiltfilt(butter(4, 8, "high", fs=1 / DT, output="sos"), velocity, axis=0)
    trembling = float(np.sqrt((fast**2).sum(-1).mean()))
    print(f"trembling {1e3 * trembling:.4f} mm/s, speed {1e3 * np.sqrt((velocity**2).sum(-1).mean()):.3f} mm/s")
    assert trembling <= 1e-3
    assert np.sqrt((velocity**2).sum(-1).mean()) <= 5e-3


def test_it_hangs_over_the_ball(rest):
    """A frozen or fallen cloth would pass the tests above: its corners hang low, its top lies on the ball."""
    sim, _, frames, _ = rest
    heights = frames[-1, :, 1]
    assert heights.max() == pytest.approx(0.17 + sim.contact.sizes.xi_body, abs=2e-3)
    assert heights.min() < 0.0
    radius = np.linalg.norm(frames[-1], axis=1)
    assert radius.min() > 0.168
    assert sim.stretches().max() < sim.scene.fabric.strain_limit + 0.02
