"""Wind: terminal speed, a hanging strip's angle, the body's shelter, gusts; closed forms of the flat plate's law."""

import numpy as np
import pytest
import warp as wp
from scipy.optimize import brentq
from small_scenes import STILL, fabric, rigid_body, sheet, slab, turn

from tryon_solver.effects.wind import sines_of
from tryon_solver.scene import AirDrag, Gravity, Gusts, Pins, Scene, Sleep, Wind
from tryon_solver.simulation import build

G, DT = 9.81, 1 / 60
RHO, C = 1.2, 1.2
ULP = 2.0**-24


def force_of(sim, x=None):
    """(N, 3) N: what the wind presses with at x, in a step that starts at rest from the state's x_start."""
    wind = next(c for c in sim.plan.contributions if c.name == "wind")
    sim.state.dt.fill_(DT)
    wind.start_step(sim.state)
    gradient = wp.zeros(sim.cloth_count, dtype=wp.vec3, device="cpu")
    x = sim.state.x if x is None else wp.array(x.astype(np.float32), dtype=wp.vec3, device="cpu")
    wind.add_velocity_gradient(sim.state, x, gradient)
    return -gradient.numpy().astype(np.float64)


def test_flat_sheet_falls_at_its_terminal_speed():
    """Implicit in the speed, its square's other factor of the step before: v' = (v + dt g)/(1 + dt rho c v/(2 sigma));
    in the end rho c v^2/2 = sigma g."""
    garment, x = sheet(7, 7, 0.3, 0.3)
    cloth = fabric()
    sim = build(Scene(garment, x, None, cloth, (Gravity(), Wind(along=0.0))))
    speed = 0.0
    for k in range(60):
        sim.advance(None, (k + 1) * DT)
        speed = (speed + DT * G) / (1 + DT * RHO * C * speed / (2 * cloth.areal_density))
        np.testing.assert_allclose(-sim.state.v.numpy()[:, 1], speed, rtol=0, atol=60 * 4 * ULP / DT + 1e-3 * speed)
    assert speed == pytest.approx(np.sqrt(2 * cloth.areal_density * G / (RHO * C)), rel=1e-3)


def hanging_strip(speed, cloth, rate, seconds):
    """A strip of 30 cm in a steady wind: the tangent of its lean in the mean, and its RMS speed, over the last two
    fifths of the time."""
    garment, flat = sheet(3, 13, 0.05, 0.3)
    x = np.column_stack([flat[:, 0], -flat[:, 2], 0 * flat[:, 0]])
    top = np.flatnonzero(x[:, 1] > 0.149).astype(np.int32)
    effects = (Gravity(), Pins(top), Wind((0.0, 0.0, speed), along=0.0))
    sim = build(Scene(garment, x, None, cloth, effects))
    leaning, squared = [], []
    for k in range(round(seconds * rate)):
        sim.advance(None, (k + 1) / rate)
        if k >= 0.6 * seconds * rate:
            hung = sim.cloth_positions().astype(np.float64)
            leaning.append(hung[x[:, 1] < -0.149].mean(0) - hung[top].mean(0))
            squared.append((sim.state.v.numpy() ** 2).sum(1).mean())
    _, down, along = np.mean(leaning, axis=0)
    return along / -down, float(np.sqrt(np.mean(squared)))


def lean(speed, cloth):
    """Across the strip, sigma g sin a = rho c/2 U U cos a wherever it hangs: it is straight, and this is tan a."""
    return RHO * C * speed**2 / (2 * cloth.areal_density * G)


def flutter_speed(cloth, length):
    """Where the wind's wave overtakes the strip's own at its top. Small moves w across a strip at the angle a, z above
    its free end, follow sigma w_tt + d w_t + b w_s = (T w_s)_s with T = sigma g z cos a, b = rho c/2 U^2 sin a and
    d = rho c/2 U (1 + cos^2 a): like roll waves (Whitham 1974, section 3.1) they grow on their way down where
    b/d = U sin a/(1 + cos^2 a) is more than sqrt(T/sigma)."""

    def faster(speed):
        tangent = lean(speed, cloth)
        cosine = 1 / np.sqrt(1 + tangent**2)
        return speed * tangent * cosine / (1 + cosine**2) - np.sqrt(G * cosine * length)

    return brentq(faster, 0.3, 20.0)


@pytest.mark.parametrize("speed", [0.8, 1.5])
def test_hanging_strip_leans_at_the_angle_of_pressure_to_weight(speed):
    cloth = fabric(k_bend=1e-8)
    tangent, rms = hanging_strip(speed, cloth, 60, 4.0)
    assert rms < 2e-3
    assert tangent == pytest.approx(lean(speed, cloth), rel=5e-3)


@pytest.mark.parametrize("density", [0.18, pytest.param(0.4, marks=pytest.mark.long)])
def test_strip_flutters_where_the_winds_wave_overtakes_its_own(density):
    cloth = fabric(k_bend=1e-8, areal_density=density)
    critical = flutter_speed(cloth, 0.3)
    assert hanging_strip(0.85 * critical, cloth, 60, 4.0)[1] < 2e-3
    assert hanging_strip(1.5 * critical, cloth, 60, 4.0)[1] > 0.1


def test_flutter_is_of_the_equations_and_not_of_the_steps():
    """With steps a third as long a strip in 3 m/s moves as fast, and leans as far, in the mean."""
    cloth = fabric(k_bend=6e-6)
    (tangent, rms), (finer, finer_rms) = (hanging_strip(3.0, cloth, rate, 3.0) for rate in (60, 180))
    assert rms > 0.1
    assert rms == pytest.approx(finer_rms, rel=0.25)
    assert tangent == pytest.approx(finer, rel=0.05)


def test_free_cloth_comes_to_go_with_the_wind():
    garment, x = sheet(5, 5, 0.2, 0.2)
    sim = build(Scene(garment, x @ turn((0, 0, 90)).T, None, fabric(), (Wind((3.0, 0.0, 0.0)),)))
    for k in range(120):
        sim.advance(None, (k + 1) * DT)
    v = sim.state.v.numpy()
    # v' = v + dt w (U - v)^2: what is left after a time t is 1/(w t) with w = rho c/(2 sigma)
    left = 1 / (RHO * C / (2 * 0.18) * 2.0 + 1 / 3.0)
    np.testing.assert_allclose(v[:, 0].mean(), 3.0 - left, atol=0.02 * left)


def test_force_is_that_of_a_convex_potential_and_within_the_bound(rng):
    """dt/2 sum_i (v_i - u)^T W_i (v_i - u) by central differences, crumpled cloth in motion; W_i from its formula."""
    garment, x = sheet(4, 4, 0.1, 0.1)
    u, along = np.array([2.0, -1.0, 0.5]), 0.2
    sim = build(Scene(garment, x, None, fabric(), (Wind(tuple(u), along=along),)))
    start = (x + 0.02 * rng.standard_normal(x.shape)).astype(np.float32).astype(np.float64)
    v = rng.standard_normal(x.shape).astype(np.float32).astype(np.float64)
    sim.state.x_start.assign(start.astype(np.float32))
    sim.state.v.assign(v.astype(np.float32))
    end = (start + DT * v + 0.01 * rng.standard_normal(x.shape)).astype(np.float32).astype(np.float64)
    w = np.zeros((len(x), 3, 3))
    for face, area in zip(garment.faces, garment.signed_areas()):
        a, b, c = start[face]
        n = np.cross(b - a, c - a)
        n /= np.linalg.norm(n)
        nn = np.outer(n, n)
        plate = RHO / 2 * np.linalg.norm(u - v[face].mean(0)) * (C * nn + along * (np.eye(3) - nn))
        w[face] += area / 3 * plate

    def potential(at):
        r = (at - start) / DT - u
        return DT / 2 * np.einsum("ni,nij,nj", r, w, r)

    shifts = 1e-5 * np.eye(x.size).reshape(-1, *x.shape)
    expected = np.array([potential(end + s) - potential(end - s) for s in shifts]).reshape(x.shape) / 2e-5
    assert np.abs(expected).max() > 1e-3
    np.testing.assert_allclose(-force_of(sim, end), expected, rtol=0, atol=1e-4 * np.abs(expected).max())
    bound = wp.zeros(len(x), dtype=wp.float32, device="cpu")
    next(c for c in sim.plan.contributions if c.name == "wind").add_diagonal(sim.state, bound)
    largest = np.linalg.eigvalsh(w).max(axis=1) / DT
    assert (bound.numpy() >= largest * (1 - 1e-5)).all()
    assert (bound.numpy() < 3 * largest).all()


@pytest.mark.parametrize("away", [0.3, 0.8])
def test_body_shelters_what_is_behind_it_and_nothing_else(away):
    """Pressure is (1 - shelter e^(-way/length))^2 of what it is in the open, the way from the body's front."""
    shelter, length, thick = 0.7, 0.5, 0.1
    garment, flat = sheet(5, 5, 0.2, 0.2)
    standing = flat @ turn((0, 0, 90)).T
    body, faces = slab(1.0, 1.0, thick, 0.1)
    wall = body @ turn((0, 0, -90)).T  # from x = -thick to 0

    def pressed(x, share):
        wind = Wind((2.0, 0.0, 0.0), shelter=share, shelter_length=length)
        return force_of(build(Scene(garment, x, rigid_body(wall, faces), fabric(), (wind,)), None, "cpu", STILL))[:, 0]

    open_air = pressed(standing + [away, 0, 0], 0.0).sum()
    assert open_air == pytest.approx(RHO * C / 2 * 4.0 * 0.04, rel=1e-4)
    behind = pressed(standing + [away, 0, 0], shelter).sum()
    assert behind == pytest.approx(open_air * (1 - shelter * np.exp(-(away + thick) / length)) ** 2, rel=1e-3)
    for elsewhere in ([-thick - 0.02, 0, 0], [away, 0, 0.8], [away, 1.2, 0]):
        assert pressed(standing + elsewhere, shelter).sum() == pytest.approx(open_air, rel=1e-4)


def test_gusts_have_the_intensity_and_the_spectrum_asked_for():
    """Their variance is the spectrum's between the first and the last sine; a pinned sheet feels them, to the digit."""
    gusts, speed = Gusts(0.25, 2.0, seed=3), 4.0
    sines = sines_of(gusts, speed)
    lowest, highest = 0.02 * speed / 2.0, 20 * speed / 2.0
    f = np.geomspace(lowest, highest, 20001)
    density = 4 * 0.25**2 * 2.0 / speed * (1 + 70.8 * (f * 2.0 / speed) ** 2) ** (-5 / 6)
    variance = np.trapezoid(density, f) if hasattr(np, "trapezoid") else np.trapz(density, f)
    assert 0.89 * 0.25**2 < variance < 0.25**2
    assert (sines[:, 0] ** 2 / 2).sum() == pytest.approx(variance, rel=0.05)
    garment, flat = sheet(3, 3, 0.1, 0.1)
    x = flat @ turn((0, 0, 90)).T
    scene = Scene(garment, x, None, fabric(), (Wind((speed, 0.0, 0.0), gusts), Pins(np.arange(9, dtype=np.int32))))
    sim = build(scene)
    felt = []
    for k in range(20):
        force = force_of(sim)[:, 0].sum()
        share = 1 + (sines[:, 0] * np.cos(2 * np.pi * sines[:, 1] * (k + 1) * DT + sines[:, 2])).sum()
        felt.append((force, RHO * C / 2 * 0.01 * (speed * share) ** 2))
    felt = np.array(felt)
    assert np.ptp(felt[:, 1]) > 0.1 * felt[:, 1].mean()
    np.testing.assert_allclose(felt[:, 0], felt[:, 1], rtol=1e-4)


def test_wind_is_checked_by_name():
    garment, x = sheet(3, 3, 0.1, 0.1)
    with pytest.raises(ValueError, match=r"along 2\.0 exceeds broadside"):
        Wind(along=2.0)
    with pytest.raises(ValueError, match="gusts are a share of the wind's speed"):
        Wind(gusts=Gusts())
    blowing = Wind((1.0, 0.0, 0.0), Gusts())
    for effects, said in (
        ((Wind(), AirDrag()), "two laws of the same air"),
        ((blowing, Sleep()), "asleep feels no gusts"),
        ((Wind(shelter=0.5),), "shelter needs a body"),
    ):
        with pytest.raises(ValueError, match=said):
            Scene(garment, x, None, fabric(), effects)
