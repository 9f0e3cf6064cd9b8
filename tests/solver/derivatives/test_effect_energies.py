"""Gradients and Hessians of the effects' energies against central differences of the same in numpy float64."""

import numpy as np
import pytest
import reference_energies as reference
from drape_states import compressed, crumpled, rounded, sheared, stretched, term_hessian, vertex_gradient
from effect_terms import contribution, effect_gradient
from small_scenes import device_vectors, fabric, flattened, icosphere, sheet

from tryon_solver.geometry.garment import Garment
from tryon_solver.scene import Creases, Elastic, ElasticLine, Fasteners, Pressure, Scene, StretchCurves
from tryon_solver.simulation import build

STEP = 1e-6
CLOTH = fabric(k_bend=3e-5)  # of k_warp 250 and k_weft 200 N/m
COLUMN = np.array([[2, 7], [7, 12], [12, 17], [17, 22]], np.int32)  # down the middle of a sheet of 5 x 5
ROW = np.array([[10, 11], [11, 12], [12, 13], [13, 14]], np.int32)


def built(*effects):
    garment, x = sheet(5, 5, 0.1, 0.1)
    return build(Scene(garment, x, None, CLOTH, effects)), np.column_stack([x[:, 0], -x[:, 2]])


def elastic_energy(uv, lines):
    def energy(x):
        total = np.zeros(x.shape[:-2])
        for edges, ratio, stiffness in lines:
            rest = np.linalg.norm(uv[edges[:, 0]] - uv[edges[:, 1]], axis=1)
            length = np.linalg.norm(x[..., edges[:, 0], :] - x[..., edges[:, 1], :], axis=-1)
            total = total + (stiffness / (2 * rest) * np.maximum(length - ratio * rest, 0) ** 2).sum(-1)
        return total

    return energy


@pytest.mark.parametrize("kind", [stretched, compressed, crumpled])
def test_elastic(rng, kind):
    """Two lines that cross, one tight everywhere, one slack where the cloth is compressed."""
    lines = ((COLUMN, 0.5, 12.0), (ROW, 0.9, 7.0))
    sim, uv = built(Elastic(tuple(ElasticLine(*line) for line in lines)))
    x, energy = rounded(kind(uv, rng)), elastic_energy(uv, lines)
    expected = reference.gradient(energy, x, STEP)
    assert np.abs(expected).max() > 1.0
    np.testing.assert_allclose(effect_gradient(sim, "elastic", x), expected, rtol=0, atol=1e-4 * np.abs(expected).max())
    assert contribution(sim, "elastic").energy(device_vectors(x)) == pytest.approx(float(energy(x)), rel=1e-5)
    hessian = reference.hessian(energy, x, 20 * STEP)
    found = term_hessian(sim.scene.garment, contribution(sim, "elastic"), x)
    np.testing.assert_allclose(found, hessian, rtol=0, atol=2e-4 * np.abs(hessian).max())


BUTTONS = np.array([[0, 24], [20, 4], [10, 11], [2, 24], [7, 8]], np.int32)


def fastener_energy(start, closed, way, stiffness):
    """Of springs that are at rest by a `way` [m] shorter than the pairs are apart at the start."""
    a, b = BUTTONS.T
    rest = np.maximum(np.linalg.norm(start[a] - start[b], axis=1) - way, 0)

    def energy(x):
        length = np.linalg.norm(x[..., a, :] - x[..., b, :], axis=-1)
        return (closed * stiffness / 2 * np.maximum(length - rest, 0) ** 2).sum(-1)

    return energy


@pytest.mark.parametrize("kind", [stretched, compressed, crumpled])
@pytest.mark.parametrize("speed", [0.6, 50.0])
def test_fasteners(rng, kind, speed):
    """Over a step in which buttons come together by a centimetre, or altogether; some share a triangle, or a vertex."""
    stiffness, closed = 40.0, np.array([1.0, 0.5, 1.0, 0.25, 0.0])
    sim, uv = built(Fasteners(BUTTONS, stiffness, speed))
    term = contribution(sim, "fasteners")
    sim.state.dt.fill_(1 / 60)
    term.values["closed"].assign(closed.astype(np.float32))
    term.start_step(sim.state)
    energy = fastener_energy(sim.state.x_start.numpy().astype(np.float64), closed, speed / 60, stiffness)
    x = rounded(kind(uv, rng))
    expected = reference.gradient(energy, x, STEP)
    assert np.abs(expected).max() > 0.1
    found = effect_gradient(sim, "fasteners", x)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-4 * np.abs(expected).max())
    assert term.energy(device_vectors(x)) == pytest.approx(float(energy(x)), rel=1e-4)
    hessian = reference.hessian(energy, x, 20 * STEP)
    found = term_hessian(sim.scene.garment, term, x)
    np.testing.assert_allclose(found, hessian, rtol=0, atol=5e-4 * np.abs(hessian).max())


def crease_energy(garment, edges, angles, k_bend):
    """w/2 |h - h0 n|^2 - w/2 |h|^2 with the hinges' rows and areas of the reference's bending."""
    rows, area = reference.hinge_laplacians(garment)
    hinges = garment.hinges()
    numbers = [int(np.flatnonzero((np.sort(hinges[:, :2], axis=1) == sorted(e)).all(axis=1))[0]) for e in edges]
    uv = np.zeros((garment.vertex_count, 2))
    uv[garment.faces] = garment.uv_corners

    def energy(x):
        total = np.zeros(x.shape[:-2])
        for number, edge, angle in zip(numbers, edges, angles):
            h = rows[number] @ x
            normal = 0
            for face in garment.faces[hinges[number, 4:]]:
                a, b, c = (x[..., v, :] for v in face)
                normal = normal + np.cross(b - a, c - a)
            n = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
            h0 = 2 * np.linalg.norm(uv[edge[0]] - uv[edge[1]]) * np.sin(angle / 2)
            w = k_bend / area[number]
            total = total + w / 2 * (((h - h0 * n) ** 2).sum(-1) - (h**2).sum(-1))
        return total

    return energy


@pytest.mark.parametrize("kind", [stretched, crumpled])
def test_creases(rng, kind):
    angles = np.array([1.2, -0.7, 2.5, 0.3])
    sim, uv = built(Creases(COLUMN, angles))
    x = rounded(kind(uv, rng))
    energy = crease_energy(sim.scene.garment, COLUMN, angles, CLOTH.k_bend)
    expected = reference.gradient(energy, x, STEP)
    assert np.abs(expected).max() > 1e-4
    np.testing.assert_allclose(effect_gradient(sim, "creases", x), expected, rtol=0, atol=5e-4 * np.abs(expected).max())
    assert contribution(sim, "creases").energy(device_vectors(x)) == pytest.approx(float(energy(x)), rel=1e-4)


def test_pressure_is_the_gradient_of_minus_p_v(rng):
    """V by the divergence theorem, on a closed surface of any shape."""
    x, faces = icosphere(0.1, 1)
    garment = Garment(faces, flattened(x, faces), np.zeros(len(faces), np.int32), len(x))
    sim = build(Scene(garment, x, None, CLOTH, (Pressure(300.0),)))
    x = rounded(x + 0.02 * rng.standard_normal(x.shape))

    def energy(at):
        a, b, c = (at[..., faces[:, k], :] for k in range(3))
        return -300.0 * (a * np.cross(b, c)).sum((-1, -2)) / 6

    expected = reference.gradient(energy, x, STEP)
    assert np.abs(expected).max() > 0.1
    found = vertex_gradient(garment, contribution(sim, "pressure"), x)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-4 * np.abs(expected).max())


STEEP = StretchCurves(warp=((0.1, 40.0), (0.25, 200.0)), weft=((0.15, 45.0), (0.2, 90.0), (0.3, 200.0)))
SOFT = StretchCurves(warp=((0.1, 1.0), (0.25, 60.0)), weft=((0.15, 3.0), (0.2, 3.5), (0.3, 100.0)))


@pytest.mark.parametrize("kind", [stretched, sheared, crumpled])
@pytest.mark.parametrize("curves", [STEEP, SOFT], ids=["steep", "soft"])
def test_stretch_curves(rng, kind, curves):
    """In place of the membrane's own stiffness, for strains on all pieces of the curves and beyond. Where a curve is
    softer than that, the Hessian is semidefinite together with the membrane's."""
    sim, uv = built(curves)
    garment, x = sim.scene.garment, rounded(kind(uv, rng))
    own = CLOTH.k_warp, CLOTH.k_weft

    def work(points, k, strain):
        knots = np.array([(0.0, 0.0), *points])
        slopes = np.diff(knots[:, 1]) / np.diff(knots[:, 0])
        begun = np.append(0, np.cumsum((knots[1:, 1] + knots[:-1, 1]) / 2 * np.diff(knots[:, 0])))
        piece = np.clip(np.searchsorted(knots[:, 0], strain) - 1, 0, len(slopes) - 1)
        way = strain - knots[piece, 0]
        whole = begun[piece] + (knots[piece, 1] + slopes[piece] * way / 2) * way
        return np.where(strain > 0, whole - k / 2 * strain**2, 0)

    def energy(at):
        strain = np.linalg.norm(reference.deformation_gradients(at, garment), axis=-2) - 1
        both = sum(work(p, k, strain[..., d]) for d, (p, k) in enumerate(zip((curves.warp, curves.weft), own)))
        return (garment.signed_areas() * both).sum(-1)

    expected = reference.gradient(energy, x, STEP)
    assert np.abs(expected).max() > 0.01
    term = contribution(sim, "stretch_curves")
    found = vertex_gradient(garment, term, x)
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-4 * np.abs(expected).max())
    assert term.energy(device_vectors(x)) == pytest.approx(float(energy(x)), rel=1e-4)
    hessian = reference.hessian(energy, x, STEP)
    if curves is STEEP:
        assert np.linalg.eigvalsh(hessian).min() > -1e-3 * np.abs(hessian).max()
        np.testing.assert_allclose(
            term_hessian(garment, term, x), hessian, rtol=0, atol=2e-3 * np.abs(hessian).max()
        )
    own_hessian = term_hessian(garment, contribution(sim, "membrane"), x)
    both = own_hessian + term_hessian(garment, term, x)
    assert np.linalg.eigvalsh(both).min() > -1e-5 * np.abs(both).max()
    assert np.linalg.eigvalsh(both - own_hessian - hessian).min() > -1e-3 * np.abs(both).max(), "no less than it is"
