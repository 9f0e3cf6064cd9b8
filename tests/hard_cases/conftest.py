"""Garments dressed once per session: putting on a T-shirt takes ten seconds. The harness is importable by name."""

import importlib.util
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


@pytest.fixture(scope="session")
def command_line():
    """The command line as a module."""
    spec = importlib.util.spec_from_file_location("hard_cases_main", HERE / "__main__.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
