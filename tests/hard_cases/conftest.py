"""Garments dressed once per session: putting on a T-shirt takes ten seconds. The harness is importable by name."""

import sys
from pathlib import Path

import pytest
from worn_garment import dressed_demo

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "proof" / "support")]


@pytest.fixture(scope="session")
def tshirt():
    """The demo's T-shirt with edges of 24 mm, some 1,400 vertices."""
    return dressed_demo("tshirt", 0.024)
