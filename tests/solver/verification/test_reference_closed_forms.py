"""The reference against closed forms: a strip that hangs and swings, one that bends, one on an incline."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_bvp
from small_scenes import STILL, fabric, garment_of, rigid_body, sheet, slab, turn

from tryon_solver.baselines.newton_ipc import Reference
from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import parse_pattern
from tryon_solver.scene import AirDrag, BodyContact, Friction, Gravity, Scene, SelfContact, StrainLimit, Wind

G = 9.81


def hanging(columns, rows, width, length, cloth, effects):
    """A strip in the plane z = 0 that hangs by its upper row."""
    garment, flat = sheet(columns, rows, width, length)
    x = np.column_stack([flat[:, 0], -flat[:, 2], 0 * flat[:, 0]])
    top = np.flatnonzero(x[:, 1] > length / 2 - 1e-9)
    return Reference(Scene(garment, x, None, cloth, effects), held=top)


STRIP = {"areal_density": 0.5, "k_warp": 600.0, "k_weft": 150.0, "k_shear": 60.0, "strain_limit": 3.0, "k_bend": 0.0}


def test_hanging_strip_extends_as_its_weight_says():
    """k e(y) = rho g (L - y), the end sinks by rho g L^2/(2 k): linear elements carry each row's mean tension exactly.

    One step of 1e4 s is a static solve. Across a row the vertices' masses differ, which shears it by micrometres.
    """
    length = 0.4
    ref = hanging(4, 21, 0.06, length, fabric(**STRIP), (Gravity(),))
    start = ref.start()
    rest = ref.step(start, None, 1e4)
    sunk = (start.x - rest.x)[:, 1]
    depth = length / 2 - start.x[:, 1]
    expected = STRIP["areal_density"] * G / STRIP["k_weft"] * (length * depth - depth**2 / 2)
    assert expected.max() > 2e-3
    by_row = (-1, 4)
    np.testing.assert_allclose(sunk.reshape(by_row).mean(1), expected.reshape(by_row)[:, 0], rtol=0, atol=1e-7)
    np.testing.assert_allclose(sunk, expected, rtol=0, atol=1e-3 * expected.max())
    assert np.abs(rest.x[:, [0, 2]] - start.x[:, [0, 2]]).max() < 2e-3 * expected.max()


def test_hanging_strip_bounces_with_its_period():
    """Longitudinal waves: omega = pi/(2 L) sqrt(k/rho), of linear elements with lumped mass (2/dy) sqrt(k/rho) sin(pi
    dy/(4 L)). A step of implicit Euler multiplies by 1/(1 - i omega dt): period and decay to a thousandth."""
    length, rows, dt = 0.4, 21, 1e-3
    dy = length / (rows - 1)
    ref = hanging(3, rows, 0.04, length, fabric(**STRIP), ())
    motion = ref.start()
    depth = length / 2 - motion.x[:, 1]
    mode = np.sin(np.pi * depth / (2 * length))
    motion = replace(motion, v=np.column_stack([0 * mode, -0.02 * mode, 0 * mode]))
    omega = 2 / dy * np.sqrt(STRIP["k_weft"] / STRIP["areal_density"]) * np.sin(np.pi * dy / (4 * length))
    # the step (x, v) -> of x'' = -w^2 x by implicit Euler has the eigenvalues 1/(1 -+ i w dt)
    factor = 1 / (1 - 1j * omega * dt)
    found, expected = [], []
    for k in range(1, 61):
        motion = ref.step(motion, None, dt)
        found.append((motion.v[:, 1] @ mode) / (mode @ mode))
        expected.append(-0.02 * (factor**k).real)
    assert min(expected) < 0 < max(expected)  # over half a period
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-3 * 0.02)


def heavy_elastica(length, ratio):
    """Where the free end of a clamped strip is: B theta'' = w (L - s) cos theta, ratio = w L^3/B.

    theta(0) = 0 and theta'(L) = 0, theta the slope. Returns its reach and how far it sinks [m].
    """

    def slopes(s, y):
        return np.vstack([y[1], ratio * (1 - s) * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])])

    s = np.linspace(0, 1, 101)
    guess = np.vstack([-0.5 * s, -0.5 + 0 * s, s, -0.2 * s])
    found = solve_bvp(slopes, lambda a, b: np.array([a[0], b[1], a[2], a[3]]), s, guess, tol=1e-9)
    assert found.success
    return found.y[2, -1] * length, -found.y[3, -1] * length


def meshed_strip(length, width, edge):
    """A strip meshed as garments are, lying in y = 0 from x = 0 on."""
    corners = [[0, 0], [100 * length, 0], [100 * length, 100 * width], [0, 100 * width]]
    panel = {"vertices": corners, "edges": [{"endpoints": [i, (i + 1) % 4]} for i in range(4)]}
    panel |= {"translation": [0, 0, 0], "rotation": [0, 0, 0]}
    pattern = {"pattern": {"panels": {"strip": panel}, "stitches": []}, "properties": {"units_in_meter": 100}}
    mesh = mesh_pattern(parse_pattern(pattern), edge)
    garment = garment_of(mesh.uv, mesh.faces)
    uv = np.empty((garment.vertex_count, 2))
    uv[garment.faces] = garment.uv_corners
    uv -= uv.min(0)
    return garment, np.column_stack([uv[:, 0], 0 * uv[:, 0], -uv[:, 1]])


@pytest.mark.long
@pytest.mark.parametrize("ratio", [2.0, 8.0])
def test_cantilever_bends_as_the_elastica(ratio):
    """A stiff strip clamped at one end: the bending length c = (B/w)^(1/3) alone sets the shape, (L/c)^3 = ratio.

    Two rows of vertices are held. Where beyond them the strip begins to bend is uncertain by half an edge, and the sink
    goes with the fourth power of the length.
    """
    total, edge, bend = 0.164, 4e-3, 2e-5
    garment, x = meshed_strip(total, 0.04, edge)
    clamp = np.flatnonzero(x[:, 0] < 1.2 * edge)
    length = total - x[clamp, 0].max()
    assert length < total - 0.8 * edge
    density = ratio * bend / length**3 / G
    cloth = fabric(areal_density=density, k_bend=bend, k_warp=2e3, k_weft=2e3, k_shear=100.0, strain_limit=3.0)
    ref = Reference(Scene(garment, x, None, cloth, (Gravity(),)), held=clamp)
    motion = ref.start()
    for _ in range(12):  # each long against the strip's swinging, short enough that Newton follows the turn
        motion = ref.step(motion, None, 0.2)
    assert np.abs(motion.v).max() < 1e-4
    end = motion.x[x[:, 0] > total - 1e-9].mean(0)
    reach, sink = heavy_elastica(length, ratio)
    assert reach < 0.98 * length
    print(f"reach {end[0] - total + length:.5f} against {reach:.5f}, sink {-end[1]:.5f} against {sink:.5f}")
    assert -end[1] == pytest.approx(sink, rel=4 * 0.5 * edge / length)
    assert end[0] - total + length == pytest.approx(reach, rel=4 * 0.5 * edge / length)


def slide(mu, degrees, steps, presliding=1e-4, dt=1 / 60):
    """Speed down the incline after each step, of a sheet laid on it at rest (steps,) m/s, and how far its contacts have
    given (P,) m."""
    tilt = turn((0, 0, -degrees))
    garment, x = sheet(5, 5, 0.08, 0.08)
    body, faces = slab(0.8, 0.3, 0.02, 0.05)
    x = (x + np.array([-0.25, 0.003, 0.003])) @ tilt.T
    scene = Scene(
        garment,
        x,
        rigid_body(body @ tilt.T, faces),
        fabric(mu_body=mu, mu_self=mu),
        (Gravity(), BodyContact(), Friction(presliding)),
    )
    ref = Reference(scene)
    motion, found = ref.start(STILL), []
    for _ in range(steps):
        motion = ref.step(motion, STILL, dt)
        found.append((motion.v @ tilt[:, 0]).mean())
    return np.array(found), np.linalg.norm(motion.known.given, axis=1)


@pytest.mark.parametrize(("mu", "degrees"), [(0.4, 20), pytest.param(0.6, 30, marks=pytest.mark.long)])
def test_sticks_below_the_threshold(mu, degrees):
    """f1(y) = tan/mu: contacts have given by s (1 - sqrt(1 - tan/mu)), and nothing moves."""
    share = np.tan(np.radians(degrees)) / mu
    assert 0.9 < share < 1
    v, given = slide(mu, degrees, 24)
    print(v, np.quantile(given, [0, 0.5, 1]))
    assert np.abs(v[-3:]).max() < 1e-6
    assert np.median(given) == pytest.approx(1e-4 * (1 - np.sqrt(1 - share)), rel=0.02)


@pytest.mark.parametrize(("mu", "degrees"), [(0.4, 23.5), pytest.param(0.2, 15, marks=pytest.mark.long)])
def test_slides_above_the_threshold(mu, degrees):
    """a = g (sin - mu cos): implicit Euler is exact for a constant force."""
    angle = np.radians(degrees)
    expected = G * (np.sin(angle) - mu * np.cos(angle))
    assert expected > 0.3
    v, given = slide(mu, degrees, 12)
    assert given == pytest.approx(np.full(len(given), 1e-4))
    assert (v[-1] - v[3]) / ((len(v) - 4) / 60) == pytest.approx(expected, abs=0.005 * mu * G * np.cos(angle))


def test_refuses_what_it_has_no_energy_for():
    """An effect it does not know would silently be left out."""
    garment, x = sheet(3, 3, 0.1, 0.1)
    known = Reference(Scene(garment, x, None, fabric(), (Gravity(), StrainLimit(), AirDrag(), SelfContact())))
    assert known.discrete.touches_self
    with pytest.raises(ValueError, match="Wind"):
        Reference(Scene(garment, x, None, fabric(), (Wind(),)))
    with pytest.raises(ValueError, match=r"leave Friction\.static out"):
        Reference(Scene(garment, x, None, fabric(), (SelfContact(), Friction(static=np.zeros((2, 2))))))
