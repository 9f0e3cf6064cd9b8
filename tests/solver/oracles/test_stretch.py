"""The larger principal stretch against the singular values of each triangle's map."""

import numpy as np
import pytest
import warp as wp

from tryon_solver.geometry.garment import Garment
from tryon_solver.materials.device import RestShape
from tryon_solver.materials.stretch import StretchMeter


@pytest.mark.parametrize("device", ["cpu", pytest.param("cuda:0", marks=pytest.mark.gpu)])
def test_against_singular_values(device):
    wp.init()
    if device != "cpu" and not wp.is_cuda_available():
        pytest.skip("no CUDA device on this machine")
    random = np.random.default_rng(2)
    count = 300
    uv = random.normal(size=(count, 3, 2))
    turned = np.linalg.det(uv[:, 1:] - uv[:, :1]) < 0
    uv[turned] = uv[turned][:, ::-1]
    placed = random.normal(size=(3 * count, 3)).astype(np.float32)
    placed[-3:] = np.column_stack([uv[-1], np.zeros(3)])  # the last one is as at rest
    faces = np.arange(3 * count).reshape(-1, 3)
    triangles = Garment(faces, uv, np.zeros(count, np.int32), 3 * count)  # which share nothing
    rest = RestShape.build(triangles, np.ones(count), device)
    rest.take(uv)
    meter = StretchMeter.build(rest)
    meter.stretch.fill_(np.nan)
    found = meter.larger(wp.array(placed, dtype=wp.vec3, device=device))
    sides = placed[triangles.faces].astype(np.float64)
    maps = np.einsum("tia,tid->tad", sides, triangles.corner_gradients())
    np.testing.assert_allclose(found, np.linalg.svd(maps, compute_uv=False)[:, 0], rtol=2e-6)
    assert found[-1] == pytest.approx(1.0, abs=1e-6)
