"""The bench's command line is called here as a function; a process of its own begins with two seconds of imports."""

import importlib.util
from pathlib import Path

import pytest

MAIN = Path(__file__).resolve().parents[3] / "solver" / "bench" / "__main__.py"


@pytest.fixture(scope="session")
def command_line():
    """It as a module."""
    spec = importlib.util.spec_from_file_location("bench_main", MAIN)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
