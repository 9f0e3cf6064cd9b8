"""Unit quaternions as numpy arrays (..., 4), float64, component order x y z w, acting on column vectors.

`multiply(p, q)` turns by q first, then by p, like the matrix product. Sign convention: q and -q are the same rotation.
"""

from __future__ import annotations

import numpy as np

IDENTITY = np.array([0.0, 0.0, 0.0, 1.0])


def multiply(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Hamilton product p q (..., 4), broadcasting."""
    px, py, pz, pw = np.moveaxis(np.asarray(p, dtype=np.float64), -1, 0)
    qx, qy, qz, qw = np.moveaxis(np.asarray(q, dtype=np.float64), -1, 0)
    return np.stack(
        [
            pw * qx + px * qw + py * qz - pz * qy,
            pw * qy - px * qz + py * qw + pz * qx,
            pw * qz + px * qy - py * qx + pz * qw,
            pw * qw - px * qx - py * qy - pz * qz,
        ],
        axis=-1,
    )


def conjugate(q: np.ndarray) -> np.ndarray:
    """The inverse of a unit quaternion."""
    return np.asarray(q) * np.array([-1.0, -1.0, -1.0, 1.0])


def normalise(q: np.ndarray) -> np.ndarray:
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def rotate(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Vectors v (..., 3) turned by q (..., 4): v + 2 w (u x v) + 2 u x (u x v) with q = (u, w)."""
    u, w = q[..., :3], q[..., 3:]
    t = 2.0 * np.cross(u, v)
    return v + w * t + np.cross(u, t)


def _products_to_matrix() -> np.ndarray:
    """(16, 9): what the products q_a q_b of a unit quaternion's parts add to its matrix, beside the identity."""
    entries = np.zeros((4, 4, 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        entries[j, j, i, i] = entries[k, k, i, i] = -2.0
        entries[i, j, i, j] = entries[i, j, j, i] = 2.0
        entries[k, 3, i, j], entries[k, 3, j, i] = -2.0, 2.0
    return entries.reshape(16, 9)


PRODUCTS_TO_MATRIX = _products_to_matrix()
UNTURNED = np.eye(3).reshape(9)


def to_matrix(q: np.ndarray) -> np.ndarray:
    """Rotation matrices (..., 3, 3) of unit quaternions. One product of all: a frame has the body's, and waits."""
    q = np.asarray(q, dtype=np.float64)
    products = (q[..., :, None] * q[..., None, :]).reshape(-1, 16)
    return (products @ PRODUCTS_TO_MATRIX + UNTURNED).reshape(*q.shape[:-1], 3, 3)


def from_axis_angle(axis: np.ndarray, angle: np.ndarray | float) -> np.ndarray:
    """Turn by `angle` [rad] (...) about the unit vector `axis` (..., 3)."""
    half = 0.5 * np.asarray(angle, dtype=np.float64)[..., None]
    axis = np.broadcast_to(axis, (*half.shape[:-1], 3))
    return np.concatenate([np.sin(half) * axis, np.cos(half)], axis=-1)


def between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The shortest turn that takes direction a (3,) to direction b (3,), neither zero. For opposite directions the
    axis is any one perpendicular to a."""
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    q = np.append(np.cross(a, b), 1.0 + a @ b)
    if q[3] < 1e-9:
        perpendicular = np.cross(a, np.eye(3)[np.argmin(np.abs(a))])
        q = np.append(perpendicular / np.linalg.norm(perpendicular), 0.0)
    return normalise(q)


def slerp(a: np.ndarray, b: np.ndarray, t: np.ndarray | float) -> np.ndarray:
    """Spherical interpolation (..., 4) from a (t = 0) to b (t = 1) along the shorter arc; t broadcasts."""
    t = np.asarray(t, dtype=np.float64)[..., None]
    cosine = (a * b).sum(axis=-1, keepdims=True)
    b = np.where(cosine < 0.0, -b, b)
    angle = np.arccos(np.clip(np.abs(cosine), 0.0, 1.0))
    sine = np.sin(angle)
    near = sine < 1e-6  # the chord equals the arc to 1e-12 there
    safe = np.where(near, 1.0, sine)
    weight_a = np.where(near, 1.0 - t, np.sin((1.0 - t) * angle) / safe)
    weight_b = np.where(near, t, np.sin(t * angle) / safe)
    return normalise(weight_a * a + weight_b * b)


def twist_about(q: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """The twist part of q (..., 4) about the unit vector `axis` (3,): q = swing * twist with the swing's axis
    perpendicular to `axis`. Undefined (identity returned) where the swing is half a turn."""
    along = (q[..., :3] * axis).sum(axis=-1, keepdims=True) * axis
    twist = np.concatenate([along, q[..., 3:]], axis=-1)
    length = np.linalg.norm(twist, axis=-1, keepdims=True)
    return np.where(length < 1e-9, IDENTITY, twist / np.where(length < 1e-9, 1.0, length))


def angle_of(q: np.ndarray) -> np.ndarray:
    """Angle of the turn [rad] (...), in [0, pi]."""
    return 2.0 * np.arctan2(np.linalg.norm(q[..., :3], axis=-1), np.abs(q[..., 3]))


def continuous(q: np.ndarray) -> np.ndarray:
    """The same rotations (T, ..., 4) with signs chosen so that successive ones lie in one hemisphere."""
    result = np.array(q, dtype=np.float64)
    for t in range(1, len(result)):
        flipped = (result[t] * result[t - 1]).sum(axis=-1, keepdims=True) < 0.0
        result[t] = np.where(flipped, -result[t], result[t])
    return result
