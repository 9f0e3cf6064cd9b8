"""Garments dressed once per session: putting on a T-shirt takes ten seconds."""

import pytest
from worn_garment import dressed_demo


@pytest.fixture(scope="session")
def tshirt():
    """The demo's T-shirt with edges of 24 mm, some 1,400 vertices."""
    return dressed_demo("tshirt", 0.024)
