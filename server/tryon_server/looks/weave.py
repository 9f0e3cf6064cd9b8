"""One tile of a weave: which yarn is on top, and how high the surface is. Numbers of texels, no lengths."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tryon_server.looks.look import Look

Floats = npt.NDArray[np.float64]

TEXELS = 480  # along either side of a tile
THREADS = {"plain": 80, "twill": 80, "satin": 80, "knit": 48}  # along either side; a knit's are stitches
COVERAGE = {"plain": 0.5, "twill": 0.75, "satin": 0.8, "knit": 1.0}  # share of the face that shows the warp
DIP = 0.5  # of its height, by which a yarn is lower where it goes under the next one
SLUBS = 7  # swellings of a yarn along a tile
SEED = 20260501  # the same cloth each time


@dataclass(frozen=True, eq=False)
class Tile:
    """A tile of cloth, repeated without a seam; rows go along v, upwards, and columns along u.

    height: (TEXELS, TEXELS) 0 between the yarns to 1 on top of the thickest. warp: whether the warp is on top, bool.
    lightness: how much lighter its yarn is than the mean of all, over that.
    """

    height: Floats
    warp: npt.NDArray[np.bool_]
    lightness: Floats


def tile_of(look: Look) -> Tile:
    """The tile of a look's weave."""
    chance = np.random.default_rng(SEED)
    return _knit(look, chance) if look.weave == "knit" else _woven(look, chance)


def _woven(look: Look, chance: np.random.Generator) -> Tile:
    count = THREADS[look.weave]
    texel = (np.arange(TEXELS) + 0.5) * count / TEXELS
    thread, across = texel.astype(int), texel % 1
    over = _warp_on_top(look.weave, count)
    rises = {}
    light = {}
    for yarn, axis in (("warp", 0), ("weft", 1)):
        swelling, shade = _yarns(count, look, chance)
        on_top = over if yarn == "warp" else ~over
        width = 1 + 0.6 * look.unevenness * swelling[:, thread].T  # (along, yarn)
        profile = _round(across[None, :], np.repeat(width, TEXELS // count, axis=1))
        before, after = np.roll(on_top, 1, axis=0), np.roll(on_top, -1, axis=0)
        if axis == 1:
            before, after = np.roll(on_top, 1, axis=1).T, np.roll(on_top, -1, axis=1).T
        dip = DIP * (~before[np.ix_(thread, thread)] * (1 - across[:, None]) ** 2)
        dip = dip + DIP * (~after[np.ix_(thread, thread)] * across[:, None] ** 2)
        rise, tone = profile * (1 - dip), np.repeat(shade[:, thread].T, TEXELS // count, axis=1)
        rises[yarn], light[yarn] = (rise, tone) if axis == 0 else (rise.T, tone.T)
    warp = over[np.ix_(thread, thread)]
    height = np.where(warp, rises["warp"], rises["weft"])
    return Tile(height / height.max(), warp, np.where(warp, light["warp"], light["weft"]))


def _warp_on_top(weave: str, count: int) -> npt.NDArray[np.bool_]:
    """(weft, warp): whether the warp is on top where they cross. Twill is 3/1 to the right, satin 4/1 in steps of 2."""
    weft, warp = np.mgrid[:count, :count]
    if weave == "plain":
        return (warp + weft) % 2 == 0
    if weave == "twill":
        return (warp - weft) % 4 != 3
    return (warp - 2 * weft) % 5 != 0


def _knit(look: Look, chance: np.random.Generator) -> Tile:
    """The right side of single jersey: each stitch shows the two legs of its loop, which lean towards each other."""
    count = THREADS["knit"]
    texel = (np.arange(TEXELS) + 0.5) * count / TEXELS
    x, y = texel[None, :] % 1, texel[:, None]
    leg = np.abs(2 * x - 1)  # 1 between two wales, 0 in the middle of one
    along = (y + 0.75 * leg) % 1  # a leg rises from the middle outwards
    swelling, shade = _yarns(count, look, chance)
    course = ((y + 0.75 * leg).astype(int)) % count
    column = np.broadcast_to(np.arange(TEXELS) * count // TEXELS, (TEXELS, TEXELS))
    width = 1 + 0.4 * look.unevenness * swelling[course, column]
    height = _round(along, width) * (0.35 + 0.65 * _round((2 * x) % 1, np.ones(1)))
    return Tile(height / height.max(), np.ones((TEXELS, TEXELS), bool), shade[course, column])


def _round(across: Floats, width: Floats) -> Floats:
    """Height over a round yarn, which lies in 0 to 1 and is that wide."""
    return np.sqrt(np.maximum(0.0, 1 - ((2 * across - 1) / width) ** 2))


def _yarns(count: int, look: Look, chance: np.random.Generator) -> tuple[Floats, Floats]:
    """(yarn, place along it): how much thicker than the mean, in -1 to 1, and how much lighter, over the mean."""
    place = np.arange(count) / count
    swelling = np.zeros((count, count))
    for waves in range(1, SLUBS + 1):
        phase = chance.uniform(0, 1, (count, 1))
        swelling += chance.normal(0, 1, (count, 1)) * np.cos(2 * np.pi * (waves * place + phase))
    swelling = np.tanh(swelling / np.sqrt(SLUBS))
    lightness = look.mottle * (0.5 * chance.normal(0, 0.35, (count, 1)) + 0.35 * swelling)
    return swelling, lightness
