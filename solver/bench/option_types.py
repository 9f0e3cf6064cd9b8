"""What the bench's options may be; argparse tells which one is not, and why."""

from __future__ import annotations

import math
from argparse import ArgumentTypeError
from pathlib import Path

from worn import DEMO


def count(word: str) -> int:
    """A whole number from 1 on."""
    number = int(word)
    if number < 1:
        raise ArgumentTypeError(f"{word}: must be 1 or more")
    return number


def count_or_none(word: str) -> int:
    """A whole number from 0 on."""
    return count(word) if int(word) else 0


def above_zero(word: str) -> float:
    """A number above 0, or infinity."""
    number = float(word)
    if not number > 0.0:
        raise ArgumentTypeError(f"{word}: must be above 0")
    return number


def finite(word: str) -> float:
    """A number above 0 that is none without end."""
    number = above_zero(word)
    if math.isinf(number):
        raise ArgumentTypeError(f"{word}: must be finite")
    return number


def motion(word: str) -> str:
    """One of the demo's by name, or a BVH file."""
    known = sorted(place.stem for place in (DEMO / "motions").glob("*.bvh"))
    if word not in known and not Path(word).is_file():
        raise ArgumentTypeError(f"{word}: no file, nor one of the demo's motions: {', '.join(known)}")
    return word


def garment(word: str) -> str:
    """One of the demo's by name."""
    known = sorted(place.stem for place in (DEMO / "patterns").glob("*.json"))
    if word not in known:
        raise ArgumentTypeError(f"{word}: none of the demo's patterns: {', '.join(known)}")
    return word


def device(word: str) -> str:
    """One that there is."""
    import warp as wp

    wp.config.quiet = True
    known = [one.alias for one in wp.get_devices()]
    if word not in known:
        raise ArgumentTypeError(f"{word}: there is {', '.join(known)}")
    return word
