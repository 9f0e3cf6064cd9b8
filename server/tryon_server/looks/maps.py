"""Pictures of a fabric's surface, one tile of its weave: base colour, normals and roughness, as glTF 2.0 has them.

They are made here and nowhere else: the page is handed them, and files carry them. A tile's size is in metres of the
pattern, so that a thread is as thick in every garment. Rows go from the top down, as v goes up.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Literal

import numpy as np
import numpy.typing as npt

from tryon_server.looks.look import Colour, Look
from tryon_server.looks.png import png
from tryon_server.looks.weave import COVERAGE, TEXELS, THREADS, Tile, tile_of

Kind = Literal["colour", "normal", "roughness"]
Pixels = npt.NDArray[np.uint8]

SHADE = 0.55  # how much darker it is between the yarns, where little light comes
FUZZ = 0.12  # lightness of raised fibres, over the mean, where they hide the weave
SHEEN_WHITE = 0.5  # share of white in the shine of dyed fibres
SHEEN_ROUGHNESS = 0.5


def tile_size(look: Look) -> tuple[float, float]:
    """How long a tile is along u and v [m]."""
    count = THREADS[look.weave]
    return (count * look.pitch[0], count * look.pitch[1])


def face_colour(look: Look, dye: Colour | None = None) -> Colour:
    """The mean colour of the face, linear RGB: what is seen from afar. A dye colours the warp."""
    share = COVERAGE[look.weave]
    warp = look.colour if dye is None else dye
    weft = warp if look.weft is None else look.weft
    red, green, blue = (share * a + (1 - share) * b for a, b in zip(warp, weft))
    return (red, green, blue)


def sheen_colour(look: Look) -> Colour:
    """Of the soft shine at grazing angles, linear RGB, its strength included."""
    red, green, blue = (look.sheen * (SHEEN_WHITE + (1 - SHEEN_WHITE) * part) for part in face_colour(look))
    return (red, green, blue)


@lru_cache(maxsize=64)
def map_png(look: Look, kind: Kind, dye: Colour | None = None) -> bytes:
    """One of a look's maps as a PNG file; a dye changes the colour only."""
    if kind == "colour":
        return png(colours(look, dye))
    return png(normals(look) if kind == "normal" else roughness(look))


@lru_cache(maxsize=4)
def _napped(look: Look) -> tuple[Tile, npt.NDArray[np.float64]]:
    """The tile, and its height as far as raised fibres leave it to be seen, with what they are like instead."""
    tile = tile_of(look)
    fibres = np.random.default_rng(1).normal(0, 1, tile.height.shape)
    for axis in (0, 1):
        fibres = (np.roll(fibres, 1, axis) + 2 * fibres + np.roll(fibres, -1, axis)) / 4
    fibres = 0.6 + 0.25 * fibres / fibres.std()
    return tile, (1 - look.nap) * tile.height + look.nap * fibres


def colours(look: Look, dye: Colour | None = None) -> Pixels:
    """(TEXELS, TEXELS, 3) sRGB, whose mean is `face_colour`."""
    tile, height = _napped(look)
    warp = np.array(look.colour if dye is None else dye)
    weft = warp if look.weft is None else np.array(look.weft)
    mean = np.array(face_colour(look, dye))
    yarn = np.where(tile.warp[..., None], warp, weft)
    yarn = (1 - 0.7 * look.nap) * yarn + 0.7 * look.nap * mean  # fibres of both lie over each other
    light = (1 - SHADE + SHADE * height) * np.exp(tile.lightness)
    light = light + look.nap * FUZZ * (height - height.mean())
    shaded = yarn * light[..., None]
    average = shaded.mean(axis=(0, 1))
    shaded = shaded * (mean / np.where(average > 0, average, 1))  # black stays black
    return _as_seen(_srgb(shaded))


def normals(look: Look) -> Pixels:
    """(TEXELS, TEXELS, 3): x along u and y along v, -1 to 1 as 0 to 255; z out of the cloth."""
    _, height = _napped(look)
    depth = look.relief * min(look.pitch)
    step = [length / TEXELS for length in tile_size(look)]
    along_u = depth * (np.roll(height, -1, 1) - np.roll(height, 1, 1)) / (2 * step[0])
    along_v = depth * (np.roll(height, -1, 0) - np.roll(height, 1, 0)) / (2 * step[1])
    normal = np.stack([-along_u, -along_v, np.ones_like(height)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return _as_seen(0.5 + 0.5 * normal)


def roughness(look: Look) -> Pixels:
    """(TEXELS, TEXELS, 3): green is roughness, blue metal, as glTF packs the two.

    There is no metal in cloth. But what filaments throw back has been inside of them and has their colour (Irawan and
    Marschner 2012), which among glTF's surfaces only metals do: the look's lustre, less between the yarns.
    """
    _, height = _napped(look)
    rough = look.roughness + 0.5 * (1 - look.roughness) * (1 - height.clip(0, 1))
    return _as_seen(np.stack([np.ones_like(rough), rough, look.lustre * height.clip(0, 1)], axis=-1))


def _srgb(linear: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """IEC 61966-2-1."""
    bright = np.maximum(linear, 0.0031308)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * bright ** (1 / 2.4) - 0.055)


def _as_seen(shares: npt.NDArray[np.float64]) -> Pixels:
    """Rows along v, of shares of 1, as pixels with the largest v on top."""
    return np.flipud(np.rint(255 * shares.clip(0, 1)).astype(np.uint8))
