"""Patterns for the tests of edits, each made anew."""

import pytest
from pattern_measures import demo, two_squares


@pytest.fixture
def tshirt():
    return demo("tshirt")


@pytest.fixture
def dress():
    return demo("dress")


@pytest.fixture
def skirt():
    return demo("skirt")


@pytest.fixture
def trousers():
    return demo("trousers")


@pytest.fixture
def tube():
    return two_squares()
