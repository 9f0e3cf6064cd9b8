"""The script that writes what strangers would bring, as a module."""

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "scripts" / "make_strangers.py"


@pytest.fixture(scope="session")
def strangers() -> ModuleType:
    specification = importlib.util.spec_from_file_location("make_strangers", SCRIPT)
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module
