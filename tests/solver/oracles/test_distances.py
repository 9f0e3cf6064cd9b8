"""Distances, closest points and their types against IPC Toolkit, on random and on degenerate stencils."""

import ipctk
import numpy as np
import pytest
from contact_probes import solver_distances, verifier_distances
from reference_distances import EDGE_EDGE, POINT_TRIANGLE, stencil_distances

ROUNDING = 2.0**-24
ORACLE = {POINT_TRIANGLE: ipctk.point_triangle_distance, EDGE_EDGE: ipctk.edge_edge_distance}
# closest feature -> which weights differ from zero
POINT_TRIANGLE_WEIGHTS = {
    ipctk.PointTriangleDistanceType.P_T0: (1, 1, 0, 0),
    ipctk.PointTriangleDistanceType.P_T1: (1, 0, 1, 0),
    ipctk.PointTriangleDistanceType.P_T2: (1, 0, 0, 1),
    ipctk.PointTriangleDistanceType.P_E0: (1, 1, 1, 0),
    ipctk.PointTriangleDistanceType.P_E1: (1, 0, 1, 1),
    ipctk.PointTriangleDistanceType.P_E2: (1, 1, 0, 1),
    ipctk.PointTriangleDistanceType.P_T: (1, 1, 1, 1),
}
EDGE_EDGE_WEIGHTS = {
    ipctk.EdgeEdgeDistanceType.EA0_EB0: (1, 0, 1, 0),
    ipctk.EdgeEdgeDistanceType.EA0_EB1: (1, 0, 0, 1),
    ipctk.EdgeEdgeDistanceType.EA1_EB0: (0, 1, 1, 0),
    ipctk.EdgeEdgeDistanceType.EA1_EB1: (0, 1, 0, 1),
    ipctk.EdgeEdgeDistanceType.EA_EB0: (1, 1, 1, 0),
    ipctk.EdgeEdgeDistanceType.EA_EB1: (1, 1, 0, 1),
    ipctk.EdgeEdgeDistanceType.EA0_EB: (1, 0, 1, 1),
    ipctk.EdgeEdgeDistanceType.EA1_EB: (0, 1, 1, 1),
    ipctk.EdgeEdgeDistanceType.EA_EB: (1, 1, 1, 1),
}


def as_float32(stencils):
    return stencils.astype(np.float32).astype(np.float64)


def random_stencils(rng, count):
    """Two centimetres large, up to 4 m from the origin."""
    return as_float32(0.02 * rng.standard_normal((count, 4, 3)) + rng.uniform(-4, 4, (count, 1, 3)))


def oracle(kind, stencils):
    return np.sqrt([ORACLE[kind](*s) for s in stencils])


def exact_distances(kind, stencils):
    """In extended precision: float64 cancels by more than a rounding of float32 where a sliver is flat to 1e-5."""
    return stencil_distances(np.full(1, kind), stencils.astype(np.longdouble)[:, None])[0][:, 0]


def size_of(stencils):
    return np.abs(stencils - stencils[:, :1]).max(axis=(1, 2))


@pytest.mark.parametrize("kind", [POINT_TRIANGLE, EDGE_EDGE])
def test_distance_of_random_stencils_is_the_oracles(rng, kind):
    stencils = random_stencils(rng, 4000)
    expected = oracle(kind, stencils)
    found, lam = solver_distances(kind, stencils)
    size = size_of(stencils)
    # differences to the first vertex are exact; then some tens of roundings relative to the stencil's size
    np.testing.assert_allclose(found, expected, rtol=0, atol=float((64 * ROUNDING * size).max()))
    np.testing.assert_allclose(lam.sum(axis=1), 0, atol=4 * ROUNDING)
    points = np.einsum("si,sid->sd", lam, stencils - stencils[:, :1])
    tolerance = float((64 * ROUNDING * size).max())
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), expected, rtol=0, atol=tolerance)
    one_side = 1 if kind == POINT_TRIANGLE else 2
    assert (lam[:, :one_side] >= -ROUNDING).all()
    assert (lam[:, one_side:] <= ROUNDING).all()


@pytest.mark.parametrize("kind", [POINT_TRIANGLE, EDGE_EDGE])
def test_verification_in_float64_agrees_to_the_last_digits(rng, kind):
    stencils = np.concatenate([random_stencils(rng, 4000), degenerate_stencils(rng, 500)])
    found = verifier_distances(kind, stencils)
    expected = stencil_distances(np.full(1, kind), stencils[:, None])[0][:, 0]
    # squares cancel where a distance is small against the stencil
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("kind", [POINT_TRIANGLE, EDGE_EDGE])
def test_closest_feature_is_the_oracles(rng, kind):
    """Every type occurs; the weights say which vertices take part, away from where two types meet."""
    stencils = random_stencils(rng, 4000)
    if kind == POINT_TRIANGLE:
        types = [ipctk.point_triangle_distance_type(*s) for s in stencils]
        table = POINT_TRIANGLE_WEIGHTS
    else:
        types = [ipctk.edge_edge_distance_type(*s) for s in stencils]
        table = EDGE_EDGE_WEIGHTS
    assert set(types) == set(table)
    _, exact = stencil_distances(np.full(1, kind), stencils[:, None])
    smallest = np.where(exact == 0, np.inf, np.abs(exact)).min(axis=-1)[:, 0]
    clear = smallest > 1e-4
    assert clear.mean() > 0.95
    _, lam = solver_distances(kind, stencils)
    found = np.abs(lam) > 1e-5
    expected = np.array([table[t] for t in types], bool)
    # an edge-edge stencil whose types tie (parallel lines) has several right answers; random ones don't
    wrong = (found != expected).any(axis=1) & clear
    assert wrong.sum() == 0


DEGENERATE = ("edge to a point", "flat triangle", "all in one point", "touching", "parallel", "collinear", "in plane")


def degenerate_stencils(rng, count):
    """Collapsed, touching, parallel and collinear stencils, a centimetre large, within a decimetre of the origin."""
    base = 0.01 * rng.standard_normal((count, 4, 3)) + 0.1 * rng.uniform(-1, 1, (count, 1, 3))
    cases = []
    for name in DEGENERATE:
        s = base.copy()
        along = s[:, 1] - s[:, 0]
        if name == "edge to a point":
            s[:, 3] = s[:, 2]
        elif name == "flat triangle":
            s[:, 3] = s[:, 1] + rng.uniform(-1, 2, (count, 1)) * (s[:, 2] - s[:, 1])
        elif name == "all in one point":
            s[:] = s[:, :1]
        elif name == "touching":
            s[:, 2] = s[:, 0]
        elif name == "parallel":
            s[:, 3] = s[:, 2] + rng.uniform(-2, 2, (count, 1)) * along
        elif name == "collinear":
            s[:, 2] = s[:, 0] + rng.uniform(-2, 3, (count, 1)) * along
            s[:, 3] = s[:, 0] + rng.uniform(-2, 3, (count, 1)) * along
        else:
            s[:, 0] = s[:, 1:].mean(axis=1)
        cases.append(s)
    return as_float32(np.concatenate(cases))


@pytest.mark.parametrize("kind", [POINT_TRIANGLE, EDGE_EDGE])
def test_distance_of_degenerate_stencils(rng, kind):
    """Finite, and the true distance but for some tens of roundings of the stencil's size."""
    stencils = degenerate_stencils(rng, 500)
    expected = exact_distances(kind, stencils)
    found, lam = solver_distances(kind, stencils)
    assert np.isfinite(found).all()
    assert np.isfinite(lam).all()
    excess = (found - expected) / (ROUNDING * size_of(stencils) + 1e-15)
    assert excess.min() > -64
    assert excess.max() < 64


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def two_directions(rng, count):
    """Two orthogonal unit vectors (count, 3) each."""
    along = unit(rng.standard_normal((count, 3)))
    other = rng.standard_normal((count, 3))
    return along, unit(other - (other * along).sum(axis=1, keepdims=True) * along)


@pytest.mark.parametrize("flat_corner", [0, 1, 2])
@pytest.mark.parametrize("altitude_share", [1.0, 0.1, 1e-2, 1e-3, 1e-4, 1e-6, 0.0])
def test_distance_to_a_sliver_is_the_true_one(rng, altitude_share, flat_corner):
    """A triangle folded flat must not hide how close it is, whichever corner its flat angle is at."""
    count = 4000
    longest = 10 ** rng.uniform(-3, -1.3, (count, 1))
    along, across = two_directions(rng, count)
    altitude = altitude_share * longest * 10 ** rng.uniform(-1, 0, (count, 1))
    # half of the apexes very close to one end of the longest side
    anywhere, near_an_end = rng.uniform(-0.2, 1.2, (count, 1)), 10 ** rng.uniform(-6, 0, (count, 1))
    share = np.where(rng.random((count, 1)) < 0.5, anywhere, near_an_end)
    triangles = np.stack([np.zeros((count, 3)), longest * along, share * longest * along + altitude * across], axis=1)
    triangles = np.roll(triangles, flat_corner, axis=1)
    foot = np.einsum("sk,skd->sd", rng.dirichlet([0.6] * 3, count), triangles)
    point = foot + 10 ** rng.uniform(-8, -2, (count, 1)) * rng.standard_normal((count, 3))
    stencils = np.concatenate([point[:, None], triangles], axis=1) + rng.uniform(-0.1, 0.1, (count, 1, 3))
    stencils = as_float32(stencils)
    found, _ = solver_distances(POINT_TRIANGLE, stencils)
    excess = (found - exact_distances(POINT_TRIANGLE, stencils)) / (ROUNDING * size_of(stencils))
    assert excess.max() < 64
    assert excess.min() > -16


@pytest.mark.parametrize("sine", [1.0, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 0.0])
def test_distance_of_nearly_parallel_edges_is_the_true_one(rng, sine):
    """Crossing or nearly so, at every small angle."""
    count = 4000
    first, second = 10 ** rng.uniform(-3, -1.3, (2, count, 1))
    along, across = two_directions(rng, count)
    gap = 10 ** rng.uniform(-8, -2, (count, 1)) * np.cross(along, across)
    turned = unit(along + sine * 10 ** rng.uniform(-1, 0, (count, 1)) * across)
    s, t = rng.uniform(-0.2, 1.2, (2, count, 1))
    first_edge = [-s * first * along, (1 - s) * first * along]
    second_edge = [gap - t * second * turned, gap + (1 - t) * second * turned]
    stencils = as_float32(np.stack(first_edge + second_edge, axis=1) + rng.uniform(-0.1, 0.1, (count, 1, 3)))
    found, _ = solver_distances(EDGE_EDGE, stencils)
    excess = (found - exact_distances(EDGE_EDGE, stencils)) / (ROUNDING * size_of(stencils))
    assert excess.max() < 64
    assert excess.min() > -16


def test_oracle_itself_agrees_with_the_float64_reference(rng):
    """Two independent oracles: the reference used elsewhere in these tests is held to the toolkit here."""
    for kind in (POINT_TRIANGLE, EDGE_EDGE):
        stencils = random_stencils(rng, 1000)
        expected = stencil_distances(np.full(1, kind), stencils[:, None])[0][:, 0]
        np.testing.assert_allclose(oracle(kind, stencils), expected, rtol=1e-9, atol=1e-12)
