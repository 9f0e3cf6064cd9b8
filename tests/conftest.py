"""What concerns the whole run: shared test code, and the order of the areas."""

import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# The same examples in every run, and no judgement of how long one takes: that is the machine's.
settings.register_profile(
    "tryon", deadline=None, derandomize=True, print_blob=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("tryon")

# What several areas' tests share is importable by name, also in processes that a test spawns.
sys.path.insert(0, str(Path(__file__).parent / "support"))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Browser tests come last: from its first use on, Playwright keeps an event loop running in this thread, and tests
    that start a loop of their own (asyncio.run) can't follow it."""
    items.sort(key=lambda item: item.get_closest_marker("browser") is not None)
