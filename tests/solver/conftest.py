"""Fixtures of the solver's tests. Scenes and references are in tests/support."""

import numpy as np
import pytest


@pytest.fixture
def rng():
    """Random numbers, the same on every run."""
    return np.random.default_rng(20240607)
