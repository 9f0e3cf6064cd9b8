"""Fixtures of the solver's tests. Scenes and references are in tests/support."""

import numpy as np
import pytest
import warp as wp


@pytest.fixture(scope="module", params=["cpu", pytest.param("cuda:0", marks=pytest.mark.gpu)])
def device(request: pytest.FixtureRequest) -> str:
    """A processor, and a GPU where there is one."""
    wp.init()
    if request.param != "cpu" and not wp.is_cuda_available():
        pytest.skip("no CUDA device on this machine")
    return request.param


@pytest.fixture
def rng():
    """Random numbers, the same on every run."""
    return np.random.default_rng(20240607)
