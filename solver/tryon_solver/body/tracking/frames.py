"""Turns from directions."""

from __future__ import annotations

import numpy as np

from tryon_solver.body import quaternions


def frame(first: np.ndarray, second: np.ndarray) -> np.ndarray | None:
    """(3, 3): columns are `first`, made unit, what of `second` is square to it, and their cross product; None where
    the two are parallel or nothing."""
    length = float(np.linalg.norm(first))
    if length < 1e-6:
        return None
    x = first / length
    across = second - x * (x @ second)
    width = float(np.linalg.norm(across))
    if width < 1e-2 * float(np.linalg.norm(second)) or width < 1e-6:
        return None
    y = across / width
    return np.stack([x, y, np.cross(x, y)], axis=1)


def matrix_to_quaternion(matrix: np.ndarray) -> np.ndarray:
    """(4,) unit quaternion x y z w of a rotation matrix (3, 3); Shepperd's choice of the largest component."""
    m = matrix
    diagonal = np.array([m[0, 0], m[1, 1], m[2, 2]])
    trace = diagonal.sum()
    k = int(diagonal.argmax())
    if trace >= diagonal[k]:
        q = np.array([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], 1.0 + trace])
    else:
        i, j = (k + 1) % 3, (k + 2) % 3
        q = np.empty(4)
        q[k] = 1.0 + 2.0 * diagonal[k] - trace
        q[i], q[j] = m[k, i] + m[i, k], m[k, j] + m[j, k]
        q[3] = m[j, i] - m[i, j]
    return q / np.linalg.norm(q)


def swing(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(L, 4): the shortest turns that take the directions a (L, 3) to b (L, 3), none of them zero."""
    a = a / np.linalg.norm(a, axis=-1, keepdims=True)
    b = b / np.linalg.norm(b, axis=-1, keepdims=True)
    q = np.concatenate([np.cross(a, b), 1.0 + (a * b).sum(axis=-1, keepdims=True)], axis=-1)
    for limb in np.flatnonzero(q[:, 3] < 1e-9):
        q[limb] = quaternions.between(a[limb], b[limb])
    return quaternions.normalise(q)
