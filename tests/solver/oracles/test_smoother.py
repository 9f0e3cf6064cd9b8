"""Smoother and cycles on layers in hard contact: the quadratic energy never rises, in either scheme."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
import warp as wp
from small_scenes import layers

from tryon_solver.contact.pairs import ContactPairs
from tryon_solver.scene import Scene, SelfContact
from tryon_solver.settings import PRESETS
from tryon_solver.simulation import build
from tryon_solver.step import SCHEMES
from tryon_solver.stepping.gradient import invert_diagonal_blocks
from tryon_solver.stepping.proxy import project_locally
from tryon_solver.stepping.smooth import smooth_in_full_space
from tryon_solver.stepping.two_level import assemble_coarse_level

LAYERS, COLUMNS = 4, 7


def stack(scheme="subspace_lbfgs"):
    """Four sheets on top of each other."""
    garment, x = layers(LAYERS, COLUMNS, COLUMNS, 0.18, 0.002)
    return build(Scene(garment, x, None, effects=(SelfContact(),)), replace(PRESETS["live"], scheme=scheme))


@pytest.fixture(scope="module")
def sim():
    return stack()


def stack_contacts(sim, rng, stiffness):
    """Vertices in two point-triangle contacts each and as many edge-edge ones, of `stiffness` times the diagonal.

    Sets the solver's pairs; returns their (3N, 3N) matrix in float64.
    """
    garment = sim.scene.garment
    faces, panel = garment.faces, garment.panel_of_face
    diagonal = (sim.stiffness_matrix.diagonal() + sim.mass / sim.dt**2).mean()
    layer_of = np.repeat(np.arange(LAYERS), COLUMNS**2)
    ids, lam, normals = [], [], []
    for vertex in range(sim.cloth_count):
        for other in (layer_of[vertex] - 1, layer_of[vertex] + 1):
            if 0 <= other < LAYERS:
                face = faces[rng.choice(np.flatnonzero(panel == other))]
                ids.append([vertex, *face])
                lam.append([1.0, *-rng.dirichlet((1, 1, 1))])
    for _ in range(sim.cloth_count):
        lower = rng.integers(LAYERS - 1)
        a = faces[rng.choice(np.flatnonzero(panel == lower))][:2]
        b = faces[rng.choice(np.flatnonzero(panel == lower + 1))][:2]
        s, t = rng.uniform(0, 1, 2)
        ids.append([*a, *b])
        lam.append([1 - s, s, t - 1, -t])
    ids, lam = np.array(ids, np.int32), np.array(lam)
    normals = np.array([0, 1.0, 0]) + 0.3 * rng.standard_normal((len(ids), 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    weight = np.full(len(ids), stiffness * diagonal)
    pairs = ContactPairs.allocate(len(ids), "cpu")
    for name, values, dtype in (("ids", ids, wp.vec4i), ("lam", lam, wp.vec4), ("normal", normals, wp.vec3)):
        getattr(pairs, name).assign(wp.array(values, dtype=dtype, device="cpu"))
    pairs.curvature.assign(weight.astype(np.float32))
    pairs.size = len(ids)
    pairs.counters.assign([len(ids), 0])
    sim.pairs = pairs
    rows = np.zeros((len(ids), 3 * sim.cloth_count))
    for k in range(4):
        for axis in range(3):
            rows[np.arange(len(ids)), 3 * ids[:, k] + axis] += lam[:, k] * normals[:, axis]
    return (rows * weight[:, None]).T @ rows


def quadratic(sim, contact):
    """(3N, 3N): elastic and inertial part, and the contacts."""
    free = sim.stiffness_matrix + sp.diags(sim.mass / sim.dt**2)
    return np.kron(free.toarray(), np.eye(3)) + contact


@pytest.mark.parametrize("stiffness", [1.0, 30.0, 100.0, 1000.0])
@pytest.mark.parametrize("start", ["rough", "smooth", "one vertex"])
def test_smoother_never_raises_the_energy(sim, rng, stiffness, start):
    matrix = quadratic(sim, stack_contacts(sim, rng, stiffness))
    n = sim.cloth_count
    error = {
        "rough": 1e-3 * rng.standard_normal((n, 3)),
        "smooth": 1e-2 * np.column_stack([np.cos(9 * sim.scene.x_start[:, k]) for k in (0, 2, 0)]),
        "one vertex": 1e-2 * (np.arange(n) == n // 3)[:, None] * np.ones(3),
    }[start]
    invert_diagonal_blocks(sim)
    sim.state.x.assign(error.astype(np.float32))  # the minimum is at zero
    before = sim.state.x.numpy().astype(np.float64).ravel()
    sim.work.gradient.assign((matrix @ before).reshape(n, 3).astype(np.float32))
    energies = [0.5 * before @ matrix @ before]
    for _ in range(6):
        smooth_in_full_space(sim)
        x = sim.state.x.numpy().astype(np.float64).ravel()
        energies.append(0.5 * x @ matrix @ x)
        expected = (matrix @ x).reshape(n, 3)
        # the gradient is updated with the positions, not recomputed: it must not drift from them
        np.testing.assert_allclose(sim.work.gradient.numpy(), expected, atol=2e-4 * np.abs(matrix @ before).max())
    assert energies[0] > 0
    assert (np.diff(energies) <= 1e-6 * energies[0]).all()
    assert energies[-1] < 0.9 * energies[0]


def test_block_jacobi_of_stencil_sums_is_bounded_by_four(sim, rng):
    """What the smoother's polynomial relies on, and that the bound of contact-free cloth would not do."""
    matrix = quadratic(sim, stack_contacts(sim, rng, 100.0))
    blocks = np.stack([matrix[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] for i in range(sim.cloth_count)])
    inverse = sp.block_diag(np.linalg.inv(blocks)).toarray()
    largest = np.linalg.eigvals(inverse @ matrix).real.max()
    print(f"largest eigenvalue of D^-1 A with stacked contact: {largest:.2f}")
    assert 2.2 < largest <= 4.0
    free = quadratic(sim, np.zeros_like(matrix))
    alone = np.linalg.eigvals(free / np.repeat(free.diagonal(), 1)[:, None]).real.max()
    assert alone <= sim.spectral_bound


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("stiffness", [30.0, 100.0])
def test_whole_cycle_never_raises_the_energy(rng, stiffness, scheme):
    """All of a cycle but the local step, which would leave the frozen model."""
    sim = stack(scheme)
    matrix = quadratic(sim, stack_contacts(sim, rng, stiffness))
    n = sim.cloth_count
    invert_diagonal_blocks(sim)
    start = (5e-3 * rng.standard_normal((n, 3)) + 0.01).astype(np.float32)
    sim.state.x.assign(start)
    sim.work.gradient.assign((matrix @ start.ravel()).reshape(n, 3).astype(np.float32))
    for verb in sim.scheme.prepare:
        verb(sim)
    energies = [0.5 * start.ravel() @ matrix @ start.ravel()]
    for _ in range(10):
        for verb in sim.scheme.cycle:
            if verb is not project_locally:
                verb(sim)
        x = sim.state.x.numpy().astype(np.float64).ravel()
        energies.append(0.5 * x @ matrix @ x)
    assert (np.diff(energies) <= 1e-6 * energies[0]).all()
    left = energies[-1] / energies[0]
    print(f"{scheme}, contact {stiffness:.0f} x the diagonal: energy left after 10 cycles {left:.1e}")
    assert energies[-1] < 0.05 * energies[0]


def test_coarse_level_inverts_the_reduced_matrix_with_contact(rng):
    """P^T (H + C) P in float64 from the whole matrix, against what the second scheme factorises from the pairs."""
    sim = stack("contact_coarse")
    matrix = quadratic(sim, stack_contacts(sim, rng, 100.0))
    assemble_coarse_level(sim)
    spread = np.kron(sim.coarse.basis.toarray(), np.eye(3))
    reduced = spread.T @ matrix @ spread
    size = sim.coarse.size
    inverse = sim.coarse.inverse.numpy().astype(np.float64).transpose(0, 2, 1, 3).reshape(3 * size, 3 * size)
    np.testing.assert_allclose(inverse @ reduced, np.eye(3 * size), atol=2e-3)
