"""Pictures of triangles: numpy draws them, zlib packs them. Nothing else is needed, and no display."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

LIGHT = np.array([-0.45, 0.65, 0.6]) / np.linalg.norm([-0.45, 0.65, 0.6])  # to the right, up, to the eye
AMBIENT = 0.45
FINER = 2  # pixels a side are drawn for each one that is shown
PAPER = np.array([1.0, 1.0, 1.0])
LINE, LINE_WIDTH = 0.72, 0.6  # how dark the sides of triangles are drawn, and how wide in pixels as drawn


@dataclass(frozen=True)
class Surface:
    """Triangles as they are drawn: positions (K, 3) m, faces (T, 3), RGB (T, 3) of front and back from 0 to 1.

    With `lines` their sides are drawn, too; without, they are shaded as one smooth surface.
    """

    x: np.ndarray
    faces: np.ndarray
    front: np.ndarray
    back: np.ndarray
    lines: bool = True


@dataclass(frozen=True)
class Camera:
    """Looks at `centre` (3,) m from so many degrees right of +z and above the ground; shows `reach` m to each side."""

    azimuth: float
    elevation: float
    centre: np.ndarray
    reach: float

    def axes(self) -> np.ndarray:
        """(3, 3): to the right, up, and to the eye."""
        a, e = np.radians([self.azimuth, self.elevation])
        eye = np.array([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)])
        right = np.cross([0.0, 1.0, 0.0], eye)
        right /= np.linalg.norm(right)
        return np.array([right, np.cross(eye, right), eye])

    def seen(self, x: np.ndarray, pixels: int) -> np.ndarray:
        """(K, 3) columns, rows and nearness of positions (K, 3) m, in pixels; rows grow downwards."""
        at = (x - self.centre) @ self.axes().T * (0.5 * pixels / self.reach)
        return np.column_stack([at[:, 0] + 0.5 * pixels, 0.5 * pixels - at[:, 1], at[:, 2]])


def drawn(surfaces: Sequence[Surface], camera: Camera, pixels: int) -> np.ndarray:
    """(pixels, pixels, 3) uint8."""
    size = FINER * pixels
    image = np.tile(PAPER, (size, size, 1))
    depth = np.full((size, size), -np.inf)
    for surface in surfaces:
        _draw(surface, camera, image, depth)
    small = image.reshape(pixels, FINER, pixels, FINER, 3).mean((1, 3))
    return np.round(255 * np.clip(small, 0, 1)).astype(np.uint8)


def _draw(surface: Surface, camera: Camera, image: np.ndarray, depth: np.ndarray) -> None:
    """Over what is further off."""
    size, axes = len(image), camera.axes()
    corners = camera.seen(surface.x.astype(np.float64), size)[surface.faces]
    x = surface.x.astype(np.float64)[surface.faces]
    normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    facing = _flat(normal) if surface.lines else _smooth(surface, normal)
    bright = AMBIENT + (1 - AMBIENT) * np.abs(np.clip(facing @ (axes.T @ LIGHT), -1, 1))
    colour = np.where((normal @ axes[2] > 0)[:, None], surface.front, surface.back)
    low = np.floor(corners[:, :, :2].min(1)).astype(int).clip(0, size)
    high = (np.ceil(corners[:, :, :2].max(1)).astype(int) + 1).clip(0, size)
    (ax, ay), (bx, by) = ((corners[:, k, :2] - corners[:, 0, :2]).T for k in (1, 2))
    twice = ax * by - ay * bx  # the signed area as it is seen, twice
    for t in np.flatnonzero((low < high).all(1) & (np.abs(twice) > 1e-9)):
        (left, top), (right, bottom) = low[t], high[t]
        columns, rows = np.meshgrid(np.arange(left, right) + 0.5, np.arange(top, bottom) + 0.5)
        p = np.stack([columns, rows], -1)
        share = np.empty((*columns.shape, 3))
        for k in range(3):
            a, b = corners[t, (k + 1) % 3, :2], corners[t, (k + 2) % 3, :2]
            share[..., k] = ((b[0] - a[0]) * (p[..., 1] - a[1]) - (b[1] - a[1]) * (p[..., 0] - a[0])) / twice[t]
        near = share @ corners[t, :, 2]
        window = depth[top:bottom, left:right]
        shown = (share >= 0).all(-1) & (near > window)
        tone = share @ bright[t]
        if surface.lines:
            sides = np.linalg.norm(corners[t, [2, 0, 1], :2] - corners[t, [1, 2, 0], :2], axis=1)
            from_side = (share * (np.abs(twice[t]) / np.maximum(sides, 1e-9))).min(-1)
            tone = tone * np.where(from_side < LINE_WIDTH, LINE, 1.0)
        window[shown] = near[shown]
        image[top:bottom, left:right][shown] = (tone[..., None] * colour[t])[shown]


def _flat(normal: np.ndarray) -> np.ndarray:
    """(T, 3, 3) unit normal at each corner: the triangle's own."""
    return np.repeat((normal / np.maximum(np.linalg.norm(normal, axis=1), 1e-30)[:, None])[:, None], 3, axis=1)


def _smooth(surface: Surface, normal: np.ndarray) -> np.ndarray:
    """(T, 3, 3) unit normal at each corner: the mean over the triangles around it."""
    total = np.zeros((len(surface.x), 3))
    np.add.at(total, surface.faces.ravel(), np.repeat(normal, 3, axis=0))
    return (total / np.maximum(np.linalg.norm(total, axis=1), 1e-30)[:, None])[surface.faces]


def write_png(path: Path, image: np.ndarray) -> None:
    """(H, W, 3) uint8, each row as its differences to the one above, which packs smooth pictures well."""
    height, width, _ = image.shape
    above = np.vstack([np.zeros((1, width, 3), np.uint8), image[:-1]])
    rows = (image - above).reshape(height, -1)
    packed = zlib.compress(np.column_stack([np.full(height, 2, np.uint8), rows]).tobytes(), 9)

    def chunk(name: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", packed) + chunk(b"IEND", b""))
