"""Is a value what a field takes? What effects, fabrics and scenes ask of theirs, by one rule: it is what the field's
type says, and nothing that might be turned into it.

A number is Python's or numpy's, and no bool. What there are a few of is a tuple; what there are many of, a numpy array
of integers, where they are indices, or of signed numbers. A list is neither: no spec that holds one has a hash, and
what numpy makes of one depends on what is in it, of an empty one no indices. Numbers are what float32 holds, which
devices compute in: 1e39 is infinite there, and 1e-50 is 0.

All raise ValueError, which begins with `name`: that of the effect and of its field, as "wind: shelter".
"""

from __future__ import annotations

import math
import reprlib
from typing import Any

import numpy as np

ROUNDED = 1e-4  # by which shares may miss a whole
BEYOND = 2.0  # a share of a triangle's corner: as far outside as the triangle is high, and no place on cloth
LEAST, MOST = float(np.finfo(np.float32).tiny), float(np.finfo(np.float32).max)


def told(value: object) -> str:
    """The value for people, cut where it is long."""
    if isinstance(value, np.ndarray):
        return f"an array of {value.dtype} of shape {value.shape}"
    if isinstance(value, type):
        return f"the class {value.__name__}, none made of it"
    return " ".join(reprlib.repr(value).split())


def is_whole(value: object) -> bool:
    """Is it a whole number, and no bool?"""
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def as_float(value: object) -> float:
    """The number; NaN for what is none, infinite for a whole one that no float holds."""
    if not (is_whole(value) or isinstance(value, float | np.floating)):
        return math.nan
    try:
        return float(value)  # type: ignore[arg-type]
    except OverflowError:
        return math.inf


def check_number(name: str, value: object, above: bool = False) -> None:
    """Raise ValueError unless it is a finite number of at least 0, or `above` it."""
    if not (LEAST if above else 0.0) <= as_float(value) <= MOST:
        _refuse(name, f"a finite number {'above' if above else 'of at least'} 0", value)


def check_signed(name: str, value: object) -> None:
    """Raise ValueError unless it is a finite number, of any sign."""
    if not abs(as_float(value)) <= MOST:
        _refuse(name, "a finite number", value)


def check_share(name: str, value: object) -> None:
    """Raise ValueError unless it is a number from 0 to 1."""
    if not 0.0 <= as_float(value) <= 1.0:
        _refuse(name, "a share from 0 to 1", value)


def check_whole(name: str, value: object) -> None:
    """Raise ValueError unless it is a whole number of at least 0."""
    if not is_whole(value) or not as_float(value) >= 0.0:
        _refuse(name, "a whole number of at least 0", value)


def check_flag(name: str, value: object) -> None:
    """Raise ValueError unless it is True or False."""
    if not isinstance(value, bool | np.bool_):
        _refuse(name, "True or False", value)


def check_vector(name: str, value: object) -> None:
    """Raise ValueError unless it is a tuple of three finite numbers."""
    if not (isinstance(value, tuple) and len(value) == 3 and all(abs(as_float(part)) <= MOST for part in value)):
        _refuse(name, "a tuple of three finite numbers, along x, y and z", value)


def check_tuple(name: str, value: object, kind: type, example: str) -> None:
    """Raise ValueError unless it is a tuple, of none or more of this `kind`, which are made as the `example` is."""
    if not isinstance(value, tuple):
        raise ValueError(f"{name} is {told(value)}; give a tuple, as ({example},)")
    for k, entry in enumerate(value):
        if not isinstance(entry, kind):
            raise ValueError(f"{name}[{k}] is {told(entry)}; give one as {example}")


def check_wholes(name: str, value: object) -> None:
    """Raise ValueError unless it is a tuple of whole numbers of at least 0."""
    if not isinstance(value, tuple):
        raise ValueError(f"{name} is {told(value)}; give a tuple of whole numbers, as (0,)")
    for k, entry in enumerate(value):
        check_whole(f"{name}[{k}]", entry)


def check_pairs(name: str, value: object, example: str) -> None:
    """Raise ValueError unless it is a tuple of tuples of two finite numbers of at least 0, which `example` says."""
    if not isinstance(value, tuple):
        raise ValueError(f"{name} is {told(value)}; give a tuple, each entry {example}")
    for k, entry in enumerate(value):
        if not (isinstance(entry, tuple) and len(entry) == 2 and all(0.0 <= as_float(part) <= MOST for part in entry)):
            raise ValueError(f"{name}[{k}] is {told(entry)}; give {example}, finite numbers of at least 0")


def check_indices(name: str, value: object, *shape: int | str) -> None:
    """Raise ValueError unless it is a numpy array of integers of this shape, any number where that has a letter; of
    uint64 neither, which numpy turns into floats beside others."""
    whole = isinstance(value, np.ndarray) and value.dtype.kind in "iu" and np.can_cast(value.dtype, np.int64)
    if not (whole and _fits(value, shape)):
        raise ValueError(f"{name} is {told(value)}; give an integer numpy array, as of int32, of shape {_said(shape)}")


def check_numbers(name: str, value: object, *shape: int | str) -> None:
    """Raise ValueError unless it is a numpy array of finite numbers of this shape, any number where that has a letter;
    of no unsigned ones, whose differences are none."""
    if not (isinstance(value, np.ndarray) and value.dtype.kind in "fi" and _fits(value, shape)):
        raise ValueError(f"{name} is {told(value)}; give a numpy array of float64 of shape {_said(shape)}")
    held = np.abs(value.astype(np.float64)) <= MOST
    if not held.all():
        place = tuple(np.argwhere(~held)[0].tolist())
        raise ValueError(f"{name} is {value[place]} at {list(place)}; give finite numbers, which float32 holds")


def check_whole_shares(name: str, value: np.ndarray) -> None:
    """Raise ValueError unless each row of finite numbers (K, C) sums to 1, but for rounding, none of them BEYOND."""
    whole = value.sum(axis=1)
    missed = np.abs(whole - 1.0) > ROUNDED
    if missed.any():
        bad = int(np.argmax(missed))
        raise ValueError(f"{name} of row {bad} sum to {whole[bad]:.6g}; give shares that sum to 1")
    far = np.abs(value).max(axis=1, initial=0.0) > BEYOND
    if far.any():
        bad = int(np.argmax(far))
        raise ValueError(f"{name} of row {bad} lie outside their triangle; give shares from {-BEYOND:g} to {BEYOND:g}")


def _refuse(name: str, what: str, value: object) -> None:
    size = abs(as_float(value))
    beyond = 0.0 < size < LEAST or MOST < size < math.inf
    raise ValueError(f"{name} must be {what}, not {told(value)}{', which float32 does not hold' if beyond else ''}")


def _fits(value: Any, shape: tuple[int | str, ...]) -> bool:
    return value.ndim == len(shape) and all(isinstance(b, str) or a == b for a, b in zip(value.shape, shape))


def _said(shape: tuple[int | str, ...]) -> str:
    return f"({', '.join(map(str, shape))}{',' if len(shape) == 1 else ''})"
