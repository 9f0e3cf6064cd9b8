"""Distinct rows of small whole numbers, such as edges: numpy sorts rows as records, ten times as slowly as numbers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Distinct(NamedTuple):
    """`rows` (K, d) ascending by column; of each the `first` place it is at and how often it is there (`counts`);
    `which` (N,) of them each row is."""

    rows: np.ndarray
    first: np.ndarray
    which: np.ndarray
    counts: np.ndarray


def ascending(pairs: np.ndarray) -> np.ndarray:
    """(K, 2) pairs with the smaller number first: numpy's sort along an axis of two takes many times as long."""
    a, b = np.asarray(pairs).T
    return np.column_stack([np.minimum(a, b), np.maximum(a, b)])


def distinct(rows: np.ndarray) -> Distinct:
    """Of rows (N, d) of whole numbers from 0 on. Raises OverflowError where they can't be told apart by 63 bits."""
    rows = np.asarray(rows)
    sizes = [int(column.max(initial=0)) + 1 for column in rows.T]
    if np.prod([float(size) for size in sizes]) >= 2.0**63:
        raise OverflowError(f"rows of numbers up to {max(sizes) - 1} are too large to be counted")
    key = np.zeros(len(rows), np.int64)
    for column, size in zip(rows.T, sizes):
        key = key * size + column
    below = int(np.prod(sizes))
    if below <= len(key):
        return _counted(rows, key, below)
    _, first, which, counts = np.unique(key, return_index=True, return_inverse=True, return_counts=True)
    return Distinct(rows[first], first, which.ravel(), counts)


def _counted(rows: np.ndarray, key: np.ndarray, below: int) -> Distinct:
    """The same by counting, where no row's `key` (N,) is beyond a number `below` that is no larger than N: nothing has
    to be sorted."""
    counts = np.bincount(key, minlength=below)
    there = np.flatnonzero(counts)
    number, first = np.zeros(below, np.int64), np.zeros(below, np.int64)
    number[there] = np.arange(len(there))
    first[key[::-1]] = np.arange(len(key))[::-1]  # of those with one key the last one that is written stays
    return Distinct(rows[first[there]], first[there], number[key], counts[there])
